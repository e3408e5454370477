// SPDX-License-Identifier: BSD-3-Clause
#include "sim/sensors.h"

#include <limits>

#include "sim/spiri.h"

namespace tld_follower::sim {
namespace {

enum Stream : uint64_t { kImu = 1, kRange = 2, kOdometry = 3 };

btVector3 White(double sigma, Noise* noise) {
  const double x = (*noise)(sigma), y = (*noise)(sigma), z = (*noise)(sigma);
  return {btScalar(x), btScalar(y), btScalar(z)};
}

btMatrix3x3 Yaw(double angle) {
  return btMatrix3x3(btQuaternion(btVector3(0, 0, 1), btScalar(angle)));
}

}  // namespace

Sensors::Sensors(const SensorParameters& parameters, uint64_t seed, const Body& body,
                 const btVector3& gravity)
    : parameters_(parameters),
      body_(body),
      gravity_(gravity),
      start_(body.Pose()),
      last_velocity_(body.Velocity()),
      imu_noise_(seed, kImu),
      range_noise_(seed, kRange),
      odometry_noise_(seed, kOdometry),
      gyroscope_drift_{Drift(parameters.gyroscope_drift, parameters.drift_time),
                       Drift(parameters.gyroscope_drift, parameters.drift_time),
                       Drift(parameters.gyroscope_drift, parameters.drift_time)},
      velocity_drift_{Drift(parameters.velocity_drift, parameters.drift_time),
                      Drift(parameters.velocity_drift, parameters.drift_time)},
      yaw_rate_drift_(parameters.yaw_rate_drift, parameters.drift_time) {}

void Sensors::Sample(double dt) {
  SampleImu(dt);
  SampleOdometry(dt);
}

void Sensors::SampleImu(double dt) {
  const btMatrix3x3 to_body = body_.Pose().getBasis().transpose();
  const btVector3 velocity = body_.Velocity();
  const btVector3 specific_force = (velocity - last_velocity_) / btScalar(dt) - gravity_;
  last_velocity_ = velocity;
  imu_.acceleration = to_body * specific_force + White(parameters_.acceleration_noise, &imu_noise_);
  btVector3 drift;
  for (int axis = 0; axis < 3; ++axis) {
    drift[axis] = btScalar(gyroscope_drift_[axis].Advance(dt, &imu_noise_));
  }
  imu_.angular_velocity =
      to_body * body_.AngularVelocity() + drift + White(parameters_.gyroscope_noise, &imu_noise_);
}

void Sensors::SampleOdometry(double dt) {
  Noise* const noise = &odometry_noise_;
  const btTransform pose = start_.inverse() * body_.Pose();
  const double yaw = Heading(pose.getBasis());
  yaw_error_ += yaw_rate_drift_.Advance(dt, noise) * dt;

  const btVector3 tilt_error = White(parameters_.tilt_noise, noise);
  const btMatrix3x3 tilt = Yaw(-yaw) * pose.getBasis() *
                           btMatrix3x3(btQuaternion(btScalar(0), tilt_error.y(), tilt_error.x()));
  odometry_.pose.setBasis(Yaw(yaw + yaw_error_) * tilt);

  btVector3 level = Yaw(-yaw) * start_.getBasis().transpose() * body_.Velocity();
  level += White(parameters_.velocity_noise, noise);
  level += btVector3(btScalar(velocity_drift_[0].Advance(dt, noise)),
                     btScalar(velocity_drift_[1].Advance(dt, noise)), 0);
  travelled_ += btScalar(dt) * (Yaw(yaw + yaw_error_) * level);
  odometry_.pose.setOrigin({travelled_.x(), travelled_.y(),
                            pose.getOrigin().z() + btScalar((*noise)(parameters_.altitude_noise))});
  odometry_.velocity = tilt.transpose() * level;
  odometry_.angular_velocity = imu_.angular_velocity;
  imu_.attitude = btTransform(odometry_.pose.getBasis()).getRotation();
}

double Sensors::ReadRange(const Physics& physics) {
  const btTransform pose = body_.Pose();
  const double error = range_noise_(parameters_.range_noise);
  const double distance = physics.CastRay(pose.getOrigin(), -pose.getBasis().getColumn(2),
                                          parameters_.range_max, body_.rigid);
  if (distance >= parameters_.range_max) return std::numeric_limits<double>::infinity();
  return distance + error;
}

}  // namespace tld_follower::sim
