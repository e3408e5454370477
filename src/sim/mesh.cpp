// SPDX-License-Identifier: BSD-3-Clause
#include "sim/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

namespace tld_follower::sim {
namespace {

constexpr int kSides = 24;
constexpr int kTerrainPiece = 8;  // Cells along the edge of a piece of terrain.

uint32_t Add(const btVector3& p, const btVector3& n, double u, double v, Mesh* mesh) {
  mesh->vertices.push_back({{float(p.x()), float(p.y()), float(p.z())},
                            {float(n.x()), float(n.y()), float(n.z())},
                            {float(u), float(v)},
                            {0.f, 0.f}});
  return uint32_t(mesh->vertices.size() - 1);
}

void AddTriangle(uint32_t a, uint32_t b, uint32_t c, Mesh* mesh) {
  mesh->indices.insert(mesh->indices.end(), {a, b, c});
}

// A rectangle about `centre` with half edges `right` and `up`; its normal is right x up.
void AddRectangle(const btVector3& centre, const btVector3& right, const btVector3& up, double tile,
                  Mesh* mesh) {
  const btVector3 normal = right.cross(up).normalized();
  const double width = 2 * right.length() / tile;
  const double height = 2 * up.length() / tile;
  const uint32_t a = Add(centre - right - up, normal, 0, height, mesh);
  const uint32_t b = Add(centre + right - up, normal, width, height, mesh);
  const uint32_t c = Add(centre + right + up, normal, width, 0, mesh);
  const uint32_t d = Add(centre - right + up, normal, 0, 0, mesh);
  AddTriangle(a, b, c, mesh);
  AddTriangle(a, c, d, mesh);
}

Mesh MakeBox(const btVector3& size, double tile) {
  Mesh mesh;
  const btVector3 x(size.x() / 2, 0, 0), y(0, size.y() / 2, 0), z(0, 0, size.z() / 2);
  AddRectangle(x, y, z, tile, &mesh);
  AddRectangle(-x, -y, z, tile, &mesh);
  AddRectangle(y, -x, z, tile, &mesh);
  AddRectangle(-y, x, z, tile, &mesh);
  AddRectangle(z, x, y, tile, &mesh);
  AddRectangle(-z, -x, y, tile, &mesh);
  return mesh;
}

Mesh MakePlane(const btVector3& size, double tile) {
  Mesh mesh;
  AddRectangle({0, 0, 0}, {size.x() / 2, 0, 0}, {0, size.y() / 2, 0}, tile, &mesh);
  const float corners[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  for (int i = 0; i < 4; ++i) {
    mesh.vertices[i].light_uv[0] = corners[i][0];
    mesh.vertices[i].light_uv[1] = corners[i][1];
  }
  return mesh;
}

Mesh MakeCylinder(double radius, double length, double tile) {
  Mesh mesh;
  // A whole number of repeats closes the texture around the side.
  const double around = std::max(1.0, std::round(2 * M_PI * radius / tile));
  const auto rim = [radius](int i) {
    const double angle = 2 * M_PI * i / kSides;
    return btVector3(btScalar(radius * std::cos(angle)), btScalar(radius * std::sin(angle)), 0);
  };
  const btVector3 up(0, 0, btScalar(length / 2));
  for (int i = 0; i <= kSides; ++i) {
    const btVector3 p = rim(i);
    Add(p - up, p / btScalar(radius), around * i / kSides, length / tile, &mesh);
    Add(p + up, p / btScalar(radius), around * i / kSides, 0, &mesh);
  }
  for (uint32_t i = 0; i < kSides; ++i) {
    AddTriangle(2 * i, 2 * i + 2, 2 * i + 3, &mesh);
    AddTriangle(2 * i, 2 * i + 3, 2 * i + 1, &mesh);
  }
  for (const int side : {1, -1}) {
    const btVector3 normal(0, 0, btScalar(side));
    const uint32_t first = uint32_t(mesh.vertices.size());
    for (int i = 0; i < kSides; ++i) {
      const btVector3 p = rim(side * i);
      Add(p + btScalar(side) * up, normal, p.x() / tile, p.y() / tile, &mesh);
    }
    for (uint32_t i = 1; i + 1 < kSides; ++i) AddTriangle(first, first + i, first + i + 1, &mesh);
  }
  return mesh;
}

// Part of a sphere between two elevations [rad], `inside` out or not, wrapped in one panorama.
Mesh MakeSphere(double radius, double lowest, double highest, int rings, bool inside) {
  Mesh mesh;
  for (int r = 0; r <= rings; ++r) {
    const double elevation = lowest + (highest - lowest) * r / rings;
    for (int i = 0; i <= kSides; ++i) {
      const double azimuth = 2 * M_PI * i / kSides;
      const btVector3 n(btScalar(std::cos(elevation) * std::cos(azimuth)),
                        btScalar(std::cos(elevation) * std::sin(azimuth)),
                        btScalar(std::sin(elevation)));
      Add(btScalar(radius) * n, n, double(i) / kSides, 1 - double(r) / rings, &mesh);
    }
  }
  const uint32_t row = kSides + 1;
  for (uint32_t r = 0; r < uint32_t(rings); ++r) {
    for (uint32_t i = 0; i < kSides; ++i) {
      const uint32_t a = r * row + i, b = a + 1, c = b + row, d = a + row;
      AddTriangle(a, inside ? c : b, inside ? b : c, &mesh);
      AddTriangle(a, inside ? d : c, inside ? c : d, &mesh);
    }
  }
  return mesh;
}

Mesh MakeTerrain(const Terrain& terrain, double tile) {
  Mesh mesh;
  for (int row = 0; row < terrain.rows; ++row) {
    for (int column = 0; column < terrain.columns; ++column) {
      const int west = std::max(column - 1, 0), east = std::min(column + 1, terrain.columns - 1);
      const int south = std::max(row - 1, 0), north = std::min(row + 1, terrain.rows - 1);
      const btVector3 along_x = terrain.Point(east, row) - terrain.Point(west, row);
      const btVector3 along_y = terrain.Point(column, north) - terrain.Point(column, south);
      const btVector3 p = terrain.Point(column, row);
      Add(p, along_x.cross(along_y).normalized(), p.x() / tile, -p.y() / tile, &mesh);
      mesh.vertices.back().light_uv[0] = float(column) / float(terrain.columns - 1);
      mesh.vertices.back().light_uv[1] = 1.f - float(row) / float(terrain.rows - 1);
    }
  }
  const int stride = terrain.columns;
  const auto add_cell = [&mesh, stride](int row, int column) {
    const uint32_t a = uint32_t(row * stride + column), b = a + 1;
    const uint32_t c = b + uint32_t(stride), d = a + uint32_t(stride);
    AddTriangle(a, b, d, &mesh);
    AddTriangle(b, c, d, &mesh);
  };
  // Square by square, so that few pieces are in view.
  for (int south = 0; south < terrain.rows - 1; south += kTerrainPiece) {
    for (int west = 0; west < terrain.columns - 1; west += kTerrainPiece) {
      for (int row = south; row < std::min(south + kTerrainPiece, terrain.rows - 1); ++row) {
        for (int column = west; column < std::min(west + kTerrainPiece, stride - 1); ++column) {
          add_cell(row, column);
        }
      }
    }
  }
  mesh.piece = 6 * kTerrainPiece * kTerrainPiece;
  return mesh;
}

}  // namespace

Mesh MakePrimitive(const Geometry& geometry, double texture_size) {
  switch (geometry.type) {
    case Geometry::Type::kBox:
      return MakeBox(geometry.size, texture_size);
    case Geometry::Type::kCylinder:
      return MakeCylinder(geometry.size.x(), geometry.size.z(), texture_size);
    case Geometry::Type::kSphere:
      return MakeSphere(geometry.size.x(), -M_PI / 2, M_PI / 2, kSides / 2, false);
    case Geometry::Type::kTerrain:
      return MakeTerrain(*geometry.terrain, texture_size);
    case Geometry::Type::kPlane:
      return MakePlane(geometry.size, texture_size);
    case Geometry::Type::kMesh:
      break;
  }
  throw std::invalid_argument("a mesh is not a primitive");
}

Mesh MakeSkyDome(double radius) { return MakeSphere(radius, -0.1, M_PI / 2, 10, true); }

Mesh LoadObj(const std::string& file, const btVector3& scale) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error("cannot read the mesh '" + file + "'");
  std::vector<btVector3> positions, uvs, normals;
  std::map<std::array<int, 3>, uint32_t> known;
  Mesh mesh;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const auto fail = [&](const std::string& why) {
      throw std::runtime_error(file + ":" + std::to_string(number) + ": " + why);
    };
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "v" || key == "vn" || key == "vt") {
      double x = 0, y = 0, z = 0;
      if (!(words >> x >> y) || (key != "vt" && !(words >> z))) fail("numbers expected");
      auto& list = key == "v" ? positions : key == "vn" ? normals : uvs;
      list.emplace_back(btScalar(x), btScalar(y), btScalar(z));
    } else if (key == "f") {
      std::vector<uint32_t> corners;
      std::string corner;
      while (words >> corner) {
        std::array<int, 3> index{};
        if (std::sscanf(corner.c_str(), "%d/%d/%d", &index[0], &index[1], &index[2]) != 3 ||
            index[0] < 1 || index[0] > int(positions.size()) || index[1] < 1 ||
            index[1] > int(uvs.size()) || index[2] < 1 || index[2] > int(normals.size())) {
          fail("a corner must be position/texture/normal");
        }
        const auto [place, is_new] = known.try_emplace(index, uint32_t(mesh.vertices.size()));
        if (is_new) {
          Add(positions[index[0] - 1] * scale, normals[index[2] - 1], uvs[index[1] - 1].x(),
              1 - uvs[index[1] - 1].y(), &mesh);
        }
        corners.push_back(place->second);
      }
      if (corners.size() < 3) fail("a face needs three corners");
      for (size_t i = 1; i + 1 < corners.size(); ++i) {
        AddTriangle(corners[0], corners[i], corners[i + 1], &mesh);
      }
    }
  }
  if (mesh.indices.empty()) throw std::runtime_error("the mesh '" + file + "' has no faces");
  return mesh;
}

}  // namespace tld_follower::sim
