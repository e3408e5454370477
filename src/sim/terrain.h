// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <LinearMath/btVector3.h>

#include <string>
#include <vector>

namespace tld_follower::sim {

/// Heights on a regular grid about the origin. Each cell is two triangles whose common edge runs
/// from its corner (+x, -y) to (-x, +y), as in Bullet's height field.
struct Terrain {
  int columns = 0, rows = 0;   ///< Samples along x and y.
  btVector3 size{0, 0, 0};     ///< Extent in x and y, height of white [m].
  std::vector<float> heights;  ///< [m], row by row with growing y, in a row with growing x.

  /// A corner of the grid.
  btVector3 Point(int column, int row) const {
    return {size.x() * (btScalar(column) / btScalar(columns - 1) - btScalar(0.5)),
            size.y() * (btScalar(row) / btScalar(rows - 1) - btScalar(0.5)),
            heights[size_t(row) * size_t(columns) + size_t(column)]};
  }

  /// Height at a place [m]; 0 outside.
  double Height(double x, double y) const;
};

/// Reads a grey image of 8 or 16 bits: black is 0, white `size`.z; its top is the largest y. Throws
/// std::runtime_error if it cannot be read or has fewer than 2 or more than 1025 rows or columns.
Terrain LoadTerrain(const std::string& file, const btVector3& size);

}  // namespace tld_follower::sim
