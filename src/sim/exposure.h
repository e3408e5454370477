// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sim/noise.h"
#include "sim/renderer.h"

namespace tld_follower::sim {

/// A camera's gain that wanders, alike for both eyes.
class Exposure {
 public:
  /// `change` is the gain's standard deviation [stops], 0 for a gain of 1; `time` its correlation
  /// time [s].
  Exposure(double change, double time, uint64_t seed);

  /// The next picture, `dt` [s] after the last.
  void Advance(double dt);
  /// Multiplies what was drawn by the gain; what is too bright is white.
  void Apply(StereoImages* images) const;

 private:
  double change_;
  Noise noise_;
  Drift drift_;
  double stops_ = 0;
};

/// Averages pictures: motion blur.
class Blur {
 public:
  void Add(const StereoImages& images);
  /// The mean of all pictures since the last call.
  void Take(StereoImages* images);

 private:
  std::vector<uint16_t> left_, right_;
  uint16_t count_ = 0;
};

}  // namespace tld_follower::sim
