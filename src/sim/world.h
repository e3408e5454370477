// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/resources.h"
#include "sim/scene.h"

namespace tld_follower::sim {

/// Where a moving model is at a time.
struct Waypoint {
  double time = 0;  ///< Of the simulation [s].
  btTransform pose = btTransform::getIdentity();
};

/// A model of the world: ground, obstacle, building. It stands still, its poses in the world frame;
/// or it has a script that moves it, and its poses are in the moving frame.
struct Model {
  std::string name;
  std::vector<Visual> visuals;
  std::vector<Collision> collisions;
  std::vector<Waypoint> script;  ///< In order of time; empty if it stands still.

  /// The moving frame at a time [s]: straight and evenly from waypoint to waypoint, at rest before
  /// the first and after the last. The identity without a script.
  btTransform PoseAt(double time) const;
};

/// A robot that a world places: `<include>` of a URDF file.
struct RobotPlacement {
  std::string name;
  std::string file;  ///< Path of the URDF file.
  btTransform pose = btTransform::getIdentity();
};

/// A world as read from an SDF file. World frame: z up.
struct World {
  std::string file;
  std::string name;
  btVector3 gravity{0, 0, btScalar(-9.81)};           ///< [m/s^2]
  btVector3 sun_direction{0, 0, -1};                  ///< Unit vector along the light's rays.
  std::array<float, 3> sun_colour{0.8f, 0.8f, 0.8f};  ///< Linear, 0..1.
  std::array<float, 3> ambient{0.4f, 0.4f, 0.4f};     ///< Linear, 0..1.
  std::string sky_texture;                            ///< Resource URI; empty for a plain sky.
  std::vector<Model> models;
  std::vector<RobotPlacement> robots;

  /// Height of the terrain at a place [m]; 0 where there is none.
  double GroundHeight(double x, double y) const;

  /// The one robot that has one of these names. Throws std::runtime_error if the world places none
  /// of them or more than one.
  const RobotPlacement& Robot(const std::vector<std::string>& names) const;
};

/// Reads an SDF 1.6 world with libsdformat.
///
/// Own elements, in a namespace as SDF wants it: `<tld:texture_size>` in a `<material>` is the edge
/// of one texture repeat [m]; `<tld:sky>` in the `<world>` names the texture of the sky dome.
/// `<tld:waypoint>` in a `<model>`, "t x y z roll pitch yaw" [s, m, rad], moves it on a script.
/// `<pbr><metal><light_map>` is stretched once over a plane or a heightmap and breaks up the
/// repeats.
///
/// Throws std::runtime_error with one readable sentence that names the file if it cannot be read,
/// is no world, or has a number that cannot be meant: not finite, or a size that is not positive.
World LoadWorld(const std::string& file, const Resources& resources, const WarningSink& warn);

}  // namespace tld_follower::sim
