// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>

#include "sim/mobile_robot.h"

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
class Husky : public MobileRobot {
 public:
  /// `pose` is where the root link of `robot`, which must outlive this object, starts. Throws
  /// std::runtime_error for an unsuitable robot.
  Husky(const HuskyParameters& parameters, const Robot& robot, const btTransform& pose,
        Physics* physics);

  /// Takes the forward velocity and the yaw rate; a command that is not finite stops the robot.
  bool Command(const std::array<double, 3>& velocity, double yaw_rate, double time) override;
  void Actuate(double time) override;
  void Measure() override;

  /// What the wheels alone tell.
  OdometrySample Odometry() const override;
  std::vector<JointSample> Joints() const override { return {wheels_.begin(), wheels_.end()}; }
  bool flies() const override { return false; }
  bool ready() const override { return true; }

 private:
  HuskyParameters parameters_;
  std::array<JointSample, 4> wheels_;
  std::array<btHingeConstraint*, 4> motors_{};
  std::array<btVector3, 4> axes_;  // In the frame of the chassis' rigid body.
  double wheel_radius_ = 0;
  double separation_ = 0;  // True distance of left and right wheels times the multiplier [m].
  double command_speed_ = 0, command_yaw_rate_ = 0, command_time_ = 0;
  double speed_ = 0, yaw_rate_ = 0;  // After the ramp.
  double odometry_x_ = 0, odometry_y_ = 0, odometry_yaw_ = 0;
  double odometry_speed_ = 0, odometry_yaw_rate_ = 0;
};

}  // namespace tld_follower::sim
