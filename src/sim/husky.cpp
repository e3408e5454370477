// SPDX-License-Identifier: BSD-3-Clause
#include "sim/husky.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tld_follower::sim {
namespace {

// Order matters: left wheels are even, right wheels odd.
constexpr std::array<const char*, 4> kJoints{"front_left_wheel", "front_right_wheel",
                                             "rear_left_wheel", "rear_right_wheel"};

double Approach(double value, double target, double step) {
  return value + std::clamp(target - value, -step, step);
}

}  // namespace

Husky::Husky(const HuskyParameters& parameters, const Robot& robot, const btTransform& pose,
             Physics* physics)
    : parameters_(parameters) {
  std::vector<const RobotLink*> rigid;
  for (const RobotLink& link : robot.links) {
    if (!link.moving) rigid.push_back(&link);
  }
  chassis_ = physics->AddBody(rigid, pose);
  const btMatrix3x3 to_chassis = chassis_.rigid->getWorldTransform().getBasis().transpose();
  for (size_t w = 0; w < kJoints.size(); ++w) {
    const RobotLink& link = robot.MovedBy(kJoints[w]);
    if (link.collisions.size() != 1 ||
        link.collisions.front().geometry.type != Geometry::Type::kCylinder) {
      throw std::runtime_error("wheel '" + link.name + "' needs one cylinder as <collision>");
    }
    const btVector3 axis = pose.getBasis() * link.pose.getBasis() * link.axis;
    wheels_[w].joint = kJoints[w];
    wheels_[w].body = physics->AddBody({&link}, pose);
    motors_[w] = physics->AddHinge(chassis_, wheels_[w].body, pose * link.pose.getOrigin(), axis);
    axes_[w] = to_chassis * axis;
    wheel_radius_ = link.collisions.front().geometry.size.x();
  }
  separation_ =
      parameters_.separation_multiplier * (robot.MovedBy(kJoints[0]).pose.getOrigin().y() -
                                           robot.MovedBy(kJoints[1]).pose.getOrigin().y());
}

bool Husky::Command(double speed, double yaw_rate, double time) {
  const bool finite = std::isfinite(speed) && std::isfinite(yaw_rate);
  command_speed_ = finite ? std::clamp(speed, -parameters_.max_speed, parameters_.max_speed) : 0.0;
  command_yaw_rate_ =
      finite ? std::clamp(yaw_rate, -parameters_.max_yaw_rate, parameters_.max_yaw_rate) : 0.0;
  command_time_ = time;
  return finite;
}

void Husky::Actuate(double time) {
  if (time - command_time_ > parameters_.command_timeout) command_speed_ = command_yaw_rate_ = 0;
  speed_ = Approach(speed_, command_speed_, parameters_.max_acceleration * Physics::kStep);
  yaw_rate_ =
      Approach(yaw_rate_, command_yaw_rate_, parameters_.max_yaw_acceleration * Physics::kStep);
  for (size_t w = 0; w < wheels_.size(); ++w) {
    const double side = w % 2 == 0 ? -1 : 1;
    const double rim_speed = speed_ + side * yaw_rate_ * separation_ / 2;
    // Bullet counts the motor's speed from the child to the parent, hence the sign.
    motors_[w]->enableAngularMotor(true, btScalar(-rim_speed / wheel_radius_),
                                   btScalar(parameters_.max_wheel_torque * Physics::kStep));
  }
}

void Husky::Measure() {
  const btMatrix3x3& attitude = chassis_.rigid->getWorldTransform().getBasis();
  for (size_t w = 0; w < wheels_.size(); ++w) {
    const btVector3 relative =
        wheels_[w].body.rigid->getAngularVelocity() - chassis_.rigid->getAngularVelocity();
    wheels_[w].speed = (attitude * axes_[w]).dot(relative);
    wheels_[w].angle += wheels_[w].speed * Physics::kStep;
  }
  const double left = wheel_radius_ * (wheels_[0].speed + wheels_[2].speed) / 2;
  const double right = wheel_radius_ * (wheels_[1].speed + wheels_[3].speed) / 2;
  odometry_.speed = (left + right) / 2;
  odometry_.yaw_rate = (right - left) / separation_;
  const double middle_yaw = odometry_.yaw + odometry_.yaw_rate * Physics::kStep / 2;
  odometry_.x += odometry_.speed * std::cos(middle_yaw) * Physics::kStep;
  odometry_.y += odometry_.speed * std::sin(middle_yaw) * Physics::kStep;
  odometry_.yaw = std::remainder(odometry_.yaw + odometry_.yaw_rate * Physics::kStep, 2 * M_PI);
}

}  // namespace tld_follower::sim
