// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/node_handle.h>

#include "sim/simulation.h"

namespace tld_follower::sim {

enum class Mode {
  kRealtime,  ///< As the wall clock goes; slips rather than skip a frame.
  kFast,      ///< As fast as the machine can.
  kLockstep,  ///< After each frame, waits for the commands that answer it.
};

struct NodeParameters {
  SimulationConfig simulation;
  Mode mode = Mode::kRealtime;
  bool paused = false;
  bool lockstep_target = false;   ///< Lockstep waits for the target's command as well.
  double lockstep_timeout = 5.0;  ///< [s of wall-clock time]
};

/// Reads what config/simulator.yaml, spiri.yaml, husky.yaml and ugv.yaml document from the private
/// namespace. What is not given keeps its default. Throws std::invalid_argument naming the
/// parameter if one has a wrong type or value.
NodeParameters ReadParameters(const ros::NodeHandle& private_handle);

}  // namespace tld_follower::sim
