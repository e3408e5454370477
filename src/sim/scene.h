// SPDX-License-Identifier: BSD-3-Clause
// What world files and robot files describe: shapes, their looks and their places.
#pragma once

#include <LinearMath/btTransform.h>

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sim/terrain.h"

namespace tld_follower::sim {

/// Receives one line of text about something that was worked around (a missing texture, ...).
using WarningSink = std::function<void(const std::string&)>;

/// A shape in its own frame. Lengths in metres.
struct Geometry {
  enum class Type { kBox, kCylinder, kSphere, kPlane, kMesh, kTerrain };
  Type type = Type::kBox;
  /// Box: edges. Cylinder: (radius, radius, length along z). Sphere: (radius, radius, radius).
  /// Plane: (edge x, edge y, 0), normal +z. Mesh: scale. Terrain: extent in x and y, height.
  btVector3 size{1, 1, 1};
  std::string mesh;                        ///< Resource URI: a mesh's OBJ file, a terrain's image.
  std::shared_ptr<const Terrain> terrain;  ///< Terrains only.
};

/// Looks of a visual. Textures are resource URIs; empty means none.
struct Material {
  std::array<float, 3> colour{1.f, 1.f, 1.f};  ///< Linear multiplier of the texture, 0..1.
  std::string texture;
  std::string
      light_map;  ///< Second texture, stretched once over a plane or terrain; 0.5 grey is neutral.
  double texture_size = 1;  ///< Edge of one repeat of the texture on boxes, cylinders, planes [m].
};

struct Visual {
  btTransform pose = btTransform::getIdentity();
  Geometry geometry;
  Material material;
};

struct Collision {
  btTransform pose = btTransform::getIdentity();
  Geometry geometry;
  double friction = 1.0;  ///< Coulomb coefficient; a contact uses the product of both.
};

}  // namespace tld_follower::sim
