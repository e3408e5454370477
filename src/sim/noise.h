// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace tld_follower::sim {

/// SplitMix64 (Steele et al. 2014): one well mixed number for each (seed, stream) pair.
inline uint64_t Mix(uint64_t seed, uint64_t stream) {
  uint64_t z = seed + (stream + 1) * 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

/// Normally distributed numbers from a seed. Each consumer owns a stream, so that one being asked
/// more often does not change another.
class Noise {
 public:
  Noise(uint64_t seed, uint64_t stream) : engine_(Mix(seed, stream)) {}
  double operator()(double sigma) { return sigma * normal_(engine_); }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

/// A slowly wandering error: Ornstein-Uhlenbeck process of standard deviation `sigma` and
/// correlation time `tau` [s], started at zero.
class Drift {
 public:
  Drift(double sigma, double tau) : sigma_(sigma), tau_(tau) {}
  double Advance(double dt, Noise* noise) {
    const double keep = std::exp(-dt / tau_);
    value_ = keep * value_ + (*noise)(sigma_ * std::sqrt(1 - keep * keep));
    return value_;
  }

 private:
  double sigma_, tau_;
  double value_ = 0;
};

}  // namespace tld_follower::sim
