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
  parts_.push_back({physics->AddBody(rigid, pose), rigid});
  const btMatrix3x3 to_chassis = body().rigid->getWorldTransform().getBasis().transpose();
  for (size_t w = 0; w < kJoints.size(); ++w) {
    const RobotLink& link = robot.MovedBy(kJoints[w]);
    if (link.collisions.size() != 1 ||
        link.collisions.front().geometry.type != Geometry::Type::kCylinder) {
      throw std::runtime_error("wheel '" + link.name + "' needs one cylinder as <collision>");
    }
    const btVector3 axis = pose.getBasis() * link.pose.getBasis() * link.axis;
    wheels_[w].name = kJoints[w];
    parts_.push_back({physics->AddBody({&link}, pose), {&link}});
    motors_[w] = physics->AddHinge(body(), parts_.back().body, pose * link.pose.getOrigin(), axis);
    axes_[w] = to_chassis * axis;
    wheel_radius_ = link.collisions.front().geometry.size.x();
  }
  separation_ =
      parameters_.separation_multiplier * (robot.MovedBy(kJoints[0]).pose.getOrigin().y() -
                                           robot.MovedBy(kJoints[1]).pose.getOrigin().y());
}

bool Husky::Command(const std::array<double, 3>& velocity, double yaw_rate, double time) {
  const bool finite = std::isfinite(velocity[0]) && std::isfinite(yaw_rate);
  command_speed_ =
      finite ? std::clamp(velocity[0], -parameters_.max_speed, parameters_.max_speed) : 0.0;
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
  const btMatrix3x3& attitude = body().rigid->getWorldTransform().getBasis();
  for (size_t w = 0; w < wheels_.size(); ++w) {
    const btVector3 relative =
        parts_[w + 1].body.rigid->getAngularVelocity() - body().rigid->getAngularVelocity();
    wheels_[w].speed = (attitude * axes_[w]).dot(relative);
    wheels_[w].angle += wheels_[w].speed * Physics::kStep;
  }
  const double left = wheel_radius_ * (wheels_[0].speed + wheels_[2].speed) / 2;
  const double right = wheel_radius_ * (wheels_[1].speed + wheels_[3].speed) / 2;
  odometry_speed_ = (left + right) / 2;
  odometry_yaw_rate_ = (right - left) / separation_;
  const double middle_yaw = odometry_yaw_ + odometry_yaw_rate_ * Physics::kStep / 2;
  odometry_x_ += odometry_speed_ * std::cos(middle_yaw) * Physics::kStep;
  odometry_y_ += odometry_speed_ * std::sin(middle_yaw) * Physics::kStep;
  odometry_yaw_ = std::remainder(odometry_yaw_ + odometry_yaw_rate_ * Physics::kStep, 2 * M_PI);
}

OdometrySample Husky::Odometry() const {
  OdometrySample sample;
  sample.pose.setOrigin({btScalar(odometry_x_), btScalar(odometry_y_), 0});
  sample.pose.setRotation(btQuaternion(btVector3(0, 0, 1), btScalar(odometry_yaw_)));
  sample.velocity.setX(btScalar(odometry_speed_));
  sample.angular_velocity.setZ(btScalar(odometry_yaw_rate_));
  return sample;
}

}  // namespace tld_follower::sim
