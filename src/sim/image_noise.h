// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sim/camera.h"

namespace tld_follower::sim {

/// Gaussian noise of a camera's sensor, cut out of one tile at a place that is fresh for each
/// image.
class ImageNoise {
 public:
  /// `sigma` in grey levels; 0 for none. Throws std::invalid_argument unless 0 <= sigma <= 40.
  ImageNoise(double sigma, uint64_t seed);

  /// Adds noise to the image of `eye` in frame number `frame`; the same arguments, the same noise.
  void Add(uint64_t frame, Eye eye, std::vector<uint8_t>* image) const;

 private:
  uint64_t seed_;
  std::vector<int8_t> tile_;  // Empty for no noise.
};

}  // namespace tld_follower::sim
