// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "sim/mobile_robot.h"
#include "sim/noise.h"

namespace tld_follower::sim {

/// Errors of the vehicle's sensors as standard deviations; config/spiri.yaml gives their sources.
struct SensorParameters {
  double acceleration_noise = 0.35;  ///< White, each axis [m/s^2].
  double gyroscope_noise = 0.05;     ///< White, each axis [rad/s].
  double gyroscope_drift = 0.005;    ///< Wandering, each axis [rad/s].
  double range_noise = 0.01;         ///< [m]
  double range_max = 6.0;            ///< [m]
  double tilt_noise = 0.003;         ///< Roll and pitch of the odometry [rad].
  double velocity_noise = 0.03;      ///< White, each axis of the odometry [m/s].
  double velocity_drift = 0.02;      ///< Wandering, x and y of the odometry [m/s].
  double altitude_noise = 0.005;     ///< Of the odometry [m].
  double yaw_rate_drift = 0.002;     ///< Wandering, integrated into the odometry's yaw [rad/s].
  double drift_time = 5.0;           ///< Correlation time of all that wanders [s].
};

/// What an IMU reads, in body axes.
struct ImuSample {
  btVector3 acceleration{0, 0, 0};      ///< Specific force [m/s^2].
  btVector3 angular_velocity{0, 0, 0};  ///< [rad/s]
  btQuaternion attitude = btQuaternion::getIdentity();
};

/// Inertial unit, range finder and odometry (optical flow, range and gyroscope fused) of the
/// vehicle, with noise and drift. Velocity errors are integrated into the odometry's place.
class Sensors {
 public:
  Sensors(const SensorParameters& parameters, uint64_t seed, const Body& body,
          const btVector3& gravity);

  /// Takes a sample of the inertial unit and of the odometry, `dt` seconds after the last one.
  void Sample(double dt);

  const SensorParameters& parameters() const { return parameters_; }
  const ImuSample& imu() const { return imu_; }
  const OdometrySample& odometry() const { return odometry_; }

  /// Reads the range finder that looks along the body's -z [m]; infinity if nothing is in range.
  double ReadRange(const Physics& physics);

 private:
  void SampleImu(double dt);
  void SampleOdometry(double dt);

  SensorParameters parameters_;
  Body body_;
  btVector3 gravity_;
  btTransform start_;
  btVector3 last_velocity_;
  Noise imu_noise_, range_noise_, odometry_noise_;
  std::array<Drift, 3> gyroscope_drift_;
  std::array<Drift, 2> velocity_drift_;
  Drift yaw_rate_drift_;
  double yaw_error_ = 0;
  btVector3 travelled_{0, 0, 0};
  ImuSample imu_;
  OdometrySample odometry_;
};

}  // namespace tld_follower::sim
