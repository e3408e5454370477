// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <LinearMath/btTransform.h>

#include <array>

#include "sim/gl.h"

namespace tld_follower::sim {

/// What the sun reaches: a depth image from its direction, of the surroundings of the camera.
class SunMap {
 public:
  /// `direction` is a unit vector along the sun's rays.
  explicit SunMap(const btVector3& direction);
  ~SunMap();
  SunMap(const SunMap&) = delete;
  SunMap& operator=(const SunMap&) = delete;

  /// Makes the map the target of drawing, empty, of the surroundings of `focus` (world frame).
  void Begin(const btVector3& focus);
  /// Ends what Begin() began.
  void End() const;
  /// Lets shaders read the map from a texture unit.
  void Bind(int unit) const;

  /// World coordinates to the map's clip space, column major; set by Begin().
  const std::array<float, 16>& view() const { return view_; }
  /// Whether part of a sphere (world frame) may be in the map.
  bool Sees(const btVector3& centre, double radius) const;

 private:
  const btMatrix3x3 to_map_;  // Its z looks along the rays.
  btVector3 middle_{0, 0, 0};
  std::array<float, 16> view_{};
  GLuint framebuffer_ = 0, depth_ = 0;
};

}  // namespace tld_follower::sim
