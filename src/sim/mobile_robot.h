// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/battery.h"
#include "sim/physics.h"
#include "sim/robot.h"

namespace tld_follower::sim {

/// Links of a robot that move as one rigid body, whose own frame is that of the first link.
struct RobotPart {
  Body body;
  std::vector<const RobotLink*> links;
};

/// State of a joint that turns, forward positive.
struct JointSample {
  std::string name;
  double angle = 0;  ///< Unwrapped [rad].
  double speed = 0;  ///< [rad/s]
};

/// What a robot knows of its own motion. Pose in the frame in which it started; twist in the body's
/// axes.
struct OdometrySample {
  btTransform pose = btTransform::getIdentity();
  btVector3 velocity{0, 0, 0};          ///< [m/s]
  btVector3 angular_velocity{0, 0, 0};  ///< [rad/s]
};

/// A robot that is led by velocities: the vehicle that carries the cameras, or its target.
class MobileRobot {
 public:
  virtual ~MobileRobot() = default;

  /// A velocity in the robot's yaw frame (x forward, y left, z up) [m/s] and a yaw rate [rad/s],
  /// given at `time` [s]; what the robot can't do of it is left out. A command that is not finite
  /// makes the robot stay where it is and returns false.
  virtual bool Command(const std::array<double, 3>& velocity, double yaw_rate, double time) = 0;

  /// Sets motors and forces for the physics step that starts at `time` [s].
  virtual void Actuate(double time) = 0;

  /// Reads its own motion after the step.
  virtual void Measure() = 0;

  /// As its own drive tells.
  virtual OdometrySample Odometry() const = 0;
  virtual std::vector<JointSample> Joints() const { return {}; }

  /// What it lives on; null where that is not simulated.
  virtual const Battery* battery() const { return nullptr; }

  virtual bool flies() const = 0;
  /// It obeys commands: it is where it works, on the ground or in the air.
  virtual bool ready() const = 0;

  /// The first part carries the rest.
  const std::vector<RobotPart>& parts() const { return parts_; }
  const Body& body() const { return parts_.front().body; }

 protected:
  std::vector<RobotPart> parts_;
};

}  // namespace tld_follower::sim
