// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>

#include "sim/physics.h"
#include "sim/robot.h"

namespace tld_follower::sim {

/// Drive of the ground robot; config/husky.yaml gives each number's source. Masses, wheels and
/// their places stand in the URDF file.
struct HuskyParameters {
  double separation_multiplier = 1.875;  ///< Effective over true wheel separation when it skids.
  double max_speed = 1.0;                ///< [m/s]
  double max_acceleration = 3.0;         ///< [m/s^2]
  double max_yaw_rate = 2.0;             ///< [rad/s]
  double max_yaw_acceleration = 6.0;     ///< [rad/s^2]
  double command_timeout = 0.25;         ///< Stop if no command came for so long [s].
  double max_wheel_torque = 30.0;        ///< [N m]
};

/// The ground robot: a chassis and four wheels on hinges with velocity motors, steered by skidding.
class Husky {
 public:
  struct Wheel {
    std::string joint;
    Body body;
    double angle = 0;  ///< Forward positive, unwrapped [rad].
    double speed = 0;  ///< [rad/s]
  };
  /// What the wheels alone tell: pose in the frame where it started, and speeds.
  struct Odometry {
    double x = 0, y = 0, yaw = 0;
    double speed = 0, yaw_rate = 0;
  };

  /// `pose` is where the root link starts. Throws std::runtime_error for an unsuitable robot.
  Husky(const HuskyParameters& parameters, const Robot& robot, const btTransform& pose,
        Physics* physics);

  /// Speed forward [m/s] and yaw rate [rad/s], given at `time` [s]. A command that is not finite
  /// stops the robot and returns false.
  bool Command(double speed, double yaw_rate, double time);

  /// Sets the motors for the physics step that starts at `time` [s].
  void Actuate(double time);

  /// Reads the wheels after the step and updates the odometry.
  void Measure();

  const Body& chassis() const { return chassis_; }
  const std::array<Wheel, 4>& wheels() const { return wheels_; }
  const Odometry& odometry() const { return odometry_; }

 private:
  HuskyParameters parameters_;
  Body chassis_;
  std::array<Wheel, 4> wheels_;
  std::array<btHingeConstraint*, 4> motors_{};
  std::array<btVector3, 4> axes_;  // In the frame of the chassis' rigid body.
  double wheel_radius_ = 0;
  double separation_ = 0;  // True distance of left and right wheels times the multiplier [m].
  double command_speed_ = 0, command_yaw_rate_ = 0, command_time_ = 0;
  double speed_ = 0, yaw_rate_ = 0;  // After the ramp.
  Odometry odometry_;
};

}  // namespace tld_follower::sim
