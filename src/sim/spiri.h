// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include "sim/mobile_robot.h"

namespace tld_follower::sim {

/// Rotors, drag, gains and limits of the drone; config/spiri.yaml gives each number's source.
/// Mass and inertia stand in the URDF file.
struct SpiriParameters {
  double arm = 0.165;                  ///< Centre to rotor axis; rotors stand in an X [m].
  double motor_constant = 8.54858e-6;  ///< Thrust per squared rotor speed [N s^2/rad^2].
  double moment_constant = 0.016;      ///< Reaction torque per thrust [m].
  double max_rotor_speed = 500;        ///< [rad/s]
  double time_constant_up = 0.0125;    ///< Rotor speed lag when it rises [s].
  double time_constant_down = 0.025;   ///< The same when it falls [s].
  double drag_xy = 0.12;               ///< Force per squared airspeed [N s^2/m^2].
  double drag_z = 0.1;                 ///< The same along the body's z [N s^2/m^2].
  double drag_roll_pitch = 0.074;      ///< Torque per squared angular rate [N m s^2/rad^2].
  double drag_yaw = 0.051;             ///< The same about the body's z [N m s^2/rad^2].
  double velocity_xy_p = 3.4;          ///< Velocity error to acceleration [1/s].
  double velocity_xy_i = 0.1;          ///< [1/s^2]
  double velocity_z_p = 5.0;           ///< [1/s]
  double velocity_z_i = 1.0;           ///< [1/s^2]
  double position_p = 1.5;             ///< Hold of place and altitude to velocity [1/s].
  double attitude_p = 400.0;           ///< Tilt error to angular acceleration [1/s^2].
  double attitude_d = 40.0;            ///< Body rate to angular acceleration [1/s].
  double heading_p = 1.0;              ///< Heading hold to yaw rate [1/s].
  double yaw_rate_p = 5.0;             ///< Yaw rate error to angular acceleration [1/s].
  double max_tilt = 0.35;              ///< [rad]
  double max_speed_xy = 4.0;           ///< Commands are clipped to this [m/s].
  double max_speed_z = 1.0;            ///< [m/s]
  double max_yaw_rate = 2.0;           ///< [rad/s]
  double command_timeout = 0.3;        ///< Hover if no command came for so long [s].
  double take_off_altitude = 0.65;     ///< Of the body's origin; here above the world's z = 0 [m].
  double take_off_speed = 0.5;         ///< Also of the landing [m/s].
  double rotor_radius = 0.1;           ///< [m]
  double rotor_efficiency = 0.5;       ///< Ideal power of a rotor over the power that it takes.
  double electronics_power = 6.0;      ///< Of all but the rotors [W].
  double reserve = 0.1;                ///< Share of the battery's charge at which it lands.
  BatteryParameters battery;
};

/// The drone: one rigid body, four rotors with lag, drag, and the controller that turns a velocity
/// into attitude and thrust.
///
/// The cascade has hector_quadrotor's form: velocity PI in the yaw frame -> acceleration -> tilt
/// (limited) and thrust -> attitude PD -> rotors. It takes off by itself unless it starts that
/// high, then obeys commands and holds its place when there are none; it lands by itself on the
/// last of its battery. Its own state feeds it, as in the thesis' simulator.
///
/// Rotors push harder near the ground (Cheeseman & Bennett 1955, ARC R&M 3021): by
/// 1 / (1 - (R / 4z)^2) at a height of z, but never more than at z = R / 2.
class Spiri : public MobileRobot {
 public:
  /// `pose` is where the root link of `robot`, which must outlive this object, starts. Throws
  /// std::runtime_error for an unsuitable robot or parameters.
  Spiri(const SpiriParameters& parameters, const Robot& robot, const btTransform& pose,
        Physics* physics);

  /// Obeyed after take-off. A command that is not finite makes the drone hover.
  bool Command(const std::array<double, 3>& velocity, double yaw_rate, double time) override;
  void Actuate(double time) override;
  void Measure() override {}

  /// The state that its controller flies by: without error.
  OdometrySample Odometry() const override;
  const Battery* battery() const override { return &battery_; }
  bool flies() const override { return true; }
  /// Take-off is complete, landing has not begun.
  bool ready() const override { return flying_ && !landing_; }
  const std::array<double, 4>& rotor_speeds() const { return rotor_speeds_; }

 private:
  struct Setpoint {
    btVector3 velocity{0, 0, 0};
    double yaw_rate = 0;
    double time = 0;
  };

  btVector3 WantedVelocity(double time);
  btVector3 WantedForce(const btVector3& wanted_velocity);
  btVector3 WantedTorque(const btVector3& wanted_force, double wanted_yaw_rate) const;
  void DriveRotors(double thrust, const btVector3& torque);
  void ApplyForces();
  double GroundEffect() const;
  double Power() const;
  void Land(const btVector3& place, const btVector3& speed);

  SpiriParameters parameters_;
  const Physics* physics_;
  btTransform start_;
  Battery battery_;
  double mass_;
  btVector3 inertia_;
  double gravity_;
  std::optional<Setpoint> command_;
  bool flying_ = false;
  bool landing_ = false, landed_ = false;
  double standing_ = 0;            // How long it stands on the ground after a flight [s].
  std::optional<btVector3> hold_;  // The place that is held while there is no command.
  double altitude_;                // Altitude that is held, moved by vertical commands.
  double heading_;                 // The same for yaw.
  btVector3 integral_{0, 0, 0};    // Acceleration, world axes.
  std::array<double, 4> rotor_speeds_{};
};

/// Rotation about z that turns the world's x axis over the body's, i.e. the heading [rad].
double Heading(const btMatrix3x3& attitude);

}  // namespace tld_follower::sim
