// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <deque>
#include <string>
#include <utility>

#include "sim/simulation.h"

namespace tld_follower::sim {

/// Turns the simulation's state into the messages of /gazebo.
class Publishers {
 public:
  Publishers(ros::NodeHandle handle, ros::NodeHandle private_handle, const Simulation& simulation);

  /// Publishes the static transforms anew; the start poses are those of `simulation` now.
  void PublishStart(const Simulation& simulation, const ros::Time& stamp);

  /// Publishes all that is due at `moment`. The clock comes first, the images last.
  void Publish(Simulation* simulation, const Moment& moment, const ros::Time& stamp);

  void PublishClock(const ros::Time& stamp);

  /// Forgets the past of the real-time factor, after a pause.
  void RestartStopwatch() { stopwatch_.clear(); }
  /// Simulated over wall-clock time in the last second; 0 while unknown.
  double real_time_factor() const;

 private:
  void PublishTick(const Simulation& simulation, const ros::Time& stamp);
  void PublishSlowTick(const Simulation& simulation, const ros::Time& stamp);
  void PublishFrame(Simulation* simulation, const ros::Time& stamp);
  void PublishRange(Simulation* simulation, const ros::Time& stamp);
  void PublishPictures(Simulation* simulation);
  void PublishTruth(const Simulation& simulation, const TargetMask& mask, const ros::Time& stamp);
  void TakeTime(const ros::Time& stamp);

  ros::Publisher clock_, left_image_, right_image_, left_info_, right_info_, joint_states_;
  ros::Publisher target_odometry_, imu_, range_, odometry_, ground_truth_, target_ground_truth_;
  ros::Publisher tf_, tf_static_, truth_, depth_, labels_;
  const std::string target_odometry_frame_, target_frame_;
  sensor_msgs::CameraInfo left_camera_, right_camera_;
  StereoImages images_;
  std::deque<std::pair<double, double>> stopwatch_;  // Wall-clock and simulated time of frames [s].
};

}  // namespace tld_follower::sim
