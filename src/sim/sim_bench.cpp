// SPDX-License-Identifier: BSD-3-Clause
// bullet_sim_bench WORLD: prints what pictures and physics cost, as one JSON object.
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>

#include "sim/simulation.h"

namespace tld_follower::sim {
namespace {

constexpr int kTakeOff = 90;      // Frames until the drone hovers.
constexpr int kFrames = 90;       // That are measured.
constexpr double kSpeed = 0.5;    // Of the target, so that its wheels turn [m/s].
constexpr double kTurnRate = 1.;  // It circles in front of the drone [rad/s].

// CPU time of this process, all threads [s].
double Now() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

struct Costs {
  double pair = 0;  // Of a stereo pair [s].
  double step = 0;  // Of a step of the physics [s].
};

Costs Measure(const SimulationConfig& config) {
  Simulation simulation(
      config, [](const std::string& warning) { std::fprintf(stderr, "%s\n", warning.c_str()); });
  Costs costs;
  StereoImages images;
  for (int frame = 0; frame < kTakeOff + kFrames; ++frame) {
    const bool counts = frame >= kTakeOff;
    simulation.target().Command({kSpeed, 0, 0}, kTurnRate, simulation.time());
    const int64_t begin = simulation.time_ns();
    const double start = Now();
    while (!simulation.Advance().frame) continue;
    const double stepped = Now();
    if (!counts && frame + 1 < kTakeOff) continue;  // The first picture is slow.
    simulation.Render(&images, nullptr);
    if (!counts) continue;
    const double steps = 1e-9 * double(simulation.time_ns() - begin) / Physics::kStep;
    costs.step += (stepped - start) / steps / kFrames;
    costs.pair += (Now() - stepped) / kFrames;
  }
  return costs;
}

void Run(const char* world) {
  SimulationConfig config;
  config.world_file = world;
  const Costs large = Measure(config);
  config.camera.width = 320;
  config.camera.height = 240;
  const Costs small = Measure(config);
  std::printf("{\"pair_cpu_ms\": {\"320x240\": %.3f, \"640x480\": %.3f}, \"step_us\": %.3f}\n",
              1e3 * small.pair, 1e3 * large.pair, 1e6 * large.step);
}

}  // namespace
}  // namespace tld_follower::sim

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: bullet_sim_bench WORLD\n");
    return 2;
  }
  try {
    tld_follower::sim::Run(argv[1]);
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    return 1;
  }
  return 0;
}
