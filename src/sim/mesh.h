// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/scene.h"

namespace tld_follower::sim {

struct Vertex {
  float position[3];
  float normal[3];
  float uv[2];        ///< Texture, in repeats; v grows downwards in the image file.
  float light_uv[2];  ///< Light map, 0..1.
};

/// Triangles, counter-clockwise seen from outside.
struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<uint32_t> indices;
  /// How many indices in a row lie close together; 0 if all of them do. What is not in view is
  /// left out by such pieces.
  size_t piece = 0;
};

/// A primitive with its texture repeating every `texture_size` metres. Each face of a box starts
/// its texture at its own lower left corner.
Mesh MakePrimitive(const Geometry& geometry, double texture_size);

/// The upper hemisphere and a rim below the horizon, seen from inside, with a panorama on it.
Mesh MakeSkyDome(double radius);

/// Reads an OBJ file: v, vt, vn and f with all three indices. Polygons become fans.
/// Throws std::runtime_error if it cannot be read or has another content.
Mesh LoadObj(const std::string& file, const btVector3& scale);

}  // namespace tld_follower::sim
