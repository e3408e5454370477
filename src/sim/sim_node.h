// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/Twist.h>
#include <geometry_msgs/Vector3.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <tld_follower/Step.h>

#include <cstdint>
#include <string>

#include "sim/diagnostics_node.h"
#include "sim/parameters_node.h"
#include "sim/publishers_node.h"

namespace tld_follower::sim {

/// The ROS side of the simulator: one thread that advances it, publishes, and serves callbacks
/// between frames, while waiting and while paused.
class SimNode {
 public:
  /// Throws std::exception with one readable sentence if the simulation cannot start.
  SimNode();

  /// Runs until ROS shuts down.
  void Run();

 private:
  using Empty = std_srvs::Empty;

  /// A robot's commands.
  struct Commands {
    ros::Subscriber subscriber;
    bool came = false;      // Since the last frame.
    ros::WallTime warning;  // When one was last refused with a warning.
  };

  void Subscribe(const std::string& topic, MobileRobot& (Simulation::*robot)(), Commands* commands);
  void OnCommand(const geometry_msgs::Twist& twist, MobileRobot* robot, Commands* commands);
  void OnWind(const geometry_msgs::Vector3& wind);
  bool OnPause(Empty::Request&, Empty::Response&);
  bool OnUnpause(Empty::Request&, Empty::Response&);
  bool OnResetWorld(Empty::Request&, Empty::Response&);
  bool OnResetSimulation(Empty::Request&, Empty::Response&);
  bool OnStep(tld_follower::Step::Request& request, tld_follower::Step::Response& response);

  void Advance();
  bool WaitsForCommands();
  double SecondsAhead();
  void RestartTime();
  void Reset(int64_t start_ns);
  ros::Time Stamp() const;

  ros::NodeHandle handle_, private_handle_;
  // Commands have their own queue, so that the step service can receive them while it runs.
  ros::CallbackQueue command_queue_;
  NodeParameters parameters_;
  Simulation simulation_;
  Publishers publishers_;
  Diagnostics diagnostics_;
  Commands vehicle_commands_, target_commands_;
  ros::Subscriber wind_;
  ros::ServiceServer pause_, unpause_, reset_world_, reset_simulation_, step_;

  bool paused_;
  int64_t start_ns_ = 0;  // ROS time of the simulation's start.
  bool waiting_ = false;  // Lockstep: the last frame is not answered yet.
  ros::WallTime frame_published_;
  // Realtime: a moment of the simulation and the wall-clock time at which it is due.
  double anchor_time_ = 0;
  ros::WallTime anchor_wall_;
  ros::WallTime slip_warning_, wind_warning_;
  Pace pace_;
};

}  // namespace tld_follower::sim
