// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "sim/simulation.h"

namespace tld_follower::sim {

inline std::string WorldFile(const std::string& name) { return TLD_WORLDS "/" + name; }

/// Collects warnings.
struct Warnings {
  std::vector<std::string> lines;
  WarningSink Sink() {
    return [this](const std::string& line) { lines.push_back(line); };
  }
};

/// A simulation of `world` with images so small that flying is all that costs time. A warning
/// fails.
inline SimulationConfig FlightConfig(const std::string& world = "empty.world") {
  SimulationConfig config;
  config.world_file = WorldFile(world);
  config.camera.width = config.camera.height = 16;
  return config;
}

inline void ThrowWarning(const std::string& line) { throw std::runtime_error(line); }

/// Advances to `time` [s] since the start; calls `before` with the simulation at each moment.
template <typename Callback>
void RunUntil(double time, Simulation* simulation, Callback before) {
  while (simulation->time() < time - 1e-9) {
    before();
    simulation->Advance();
  }
}

inline void RunUntil(double time, Simulation* simulation) {
  RunUntil(time, simulation, [] {});
}

/// A text file that is gone at the end of the test.
class TemporaryFile {
 public:
  TemporaryFile(const std::string& name, const std::string& text)
      : path_(std::filesystem::temp_directory_path() / (std::to_string(getpid()) + "_" + name)) {
    std::ofstream(path_) << text;
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace tld_follower::sim
