// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include "sim/parameters_node.h"
#include "sim/simulation.h"

namespace tld_follower::sim {

/// How the simulation keeps up, counted since the node's start.
struct Pace {
  double real_time_factor = 0;     ///< Over the last second; 0 while unknown.
  double lost_time = 0;            ///< By which realtime fell behind the wall clock for good [s].
  uint64_t late_frames = 0;        ///< Before which it fell behind.
  uint64_t unanswered_frames = 0;  ///< Of lockstep, whose commands did not come in time.
};

/// Publishes /diagnostics and the vehicle's battery, once a second of simulated time.
class Diagnostics {
 public:
  Diagnostics(ros::NodeHandle handle, const Simulation& simulation, Mode mode);

  void Publish(const Simulation& simulation, const Pace& pace, const ros::Time& stamp) const;

 private:
  const Mode mode_;
  ros::Publisher diagnostics_, battery_;
};

}  // namespace tld_follower::sim
