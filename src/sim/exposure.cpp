// SPDX-License-Identifier: BSD-3-Clause
#include "sim/exposure.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tld_follower::sim {
namespace {

constexpr uint64_t kStream = 20;

void AddTo(std::vector<uint16_t>* sum, const std::vector<uint8_t>& pixels) {
  sum->resize(pixels.size());
  for (size_t i = 0; i < pixels.size(); ++i) (*sum)[i] = uint16_t((*sum)[i] + pixels[i]);
}

void Divide(std::vector<uint16_t>* sum, uint16_t count, std::vector<uint8_t>* pixels) {
  pixels->resize(sum->size());
  for (size_t i = 0; i < sum->size(); ++i) {
    (*pixels)[i] = uint8_t(((*sum)[i] + count / 2) / count);
    (*sum)[i] = 0;
  }
}

}  // namespace

Exposure::Exposure(double change, double time, uint64_t seed)
    : change_(change), noise_(seed, kStream), drift_(change, time) {}

void Exposure::Advance(double dt) {
  if (change_ > 0) stops_ = drift_.Advance(dt, &noise_);
}

void Exposure::Apply(StereoImages* images) const {
  if (change_ == 0) return;
  std::array<uint8_t, 256> brighter;
  for (size_t grey = 0; grey < brighter.size(); ++grey) {
    brighter[grey] = uint8_t(std::min(255l, std::lround(double(grey) * std::exp2(stops_))));
  }
  for (std::vector<uint8_t>* pixels : {&images->left, &images->right}) {
    for (uint8_t& value : *pixels) value = brighter[value];
  }
}

void Blur::Add(const StereoImages& images) {
  AddTo(&left_, images.left);
  AddTo(&right_, images.right);
  ++count_;
}

void Blur::Take(StereoImages* images) {
  Divide(&left_, count_, &images->left);
  Divide(&right_, count_, &images->right);
  count_ = 0;
}

}  // namespace tld_follower::sim
