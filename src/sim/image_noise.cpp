// SPDX-License-Identifier: BSD-3-Clause
#include "sim/image_noise.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sim/noise.h"

namespace tld_follower::sim {
namespace {

constexpr uint64_t kStream = 10;
constexpr size_t kTileSize = (1u << 20) + 7;  // No multiple of a row, so rows do not repeat.

}  // namespace

ImageNoise::ImageNoise(double sigma, uint64_t seed) : seed_(Mix(seed, kStream)) {
  if (!(sigma >= 0 && sigma <= 40)) {
    throw std::invalid_argument("image_noise must be 0 to 40 grey levels");
  }
  if (sigma == 0) return;
  Noise noise(seed_, 0);
  tile_.resize(kTileSize);
  for (int8_t& value : tile_) {
    value = int8_t(std::clamp(std::lround(noise(sigma)), -127l, 127l));
  }
}

void ImageNoise::Add(uint64_t frame, Eye eye, std::vector<uint8_t>* image) const {
  if (tile_.empty()) return;
  size_t offset = Mix(seed_, 1 + 2 * frame + uint64_t(eye)) % tile_.size();
  for (size_t done = 0; done < image->size();) {
    const size_t count = std::min(image->size() - done, tile_.size() - offset);
    uint8_t* const pixels = image->data() + done;
    const int8_t* const noise = tile_.data() + offset;
    for (size_t i = 0; i < count; ++i) {
      const int16_t value = int16_t(int16_t(pixels[i]) + noise[i]);
      pixels[i] = uint8_t(std::clamp<int16_t>(value, 0, 255));
    }
    done += count;
    offset = 0;
  }
}

}  // namespace tld_follower::sim
