// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "sim/scene.h"

namespace tld_follower::sim {

/// A link of a robot and the joint that carries it. All poses are in the robot's root frame, with
/// every joint at zero.
struct RobotLink {
  std::string name;
  std::string joint;        ///< Name of the joint to the parent; empty for the root.
  bool moving = false;      ///< The joint turns; false for the root and for links fixed to another.
  btVector3 axis{0, 0, 1};  ///< Of a moving joint, a unit vector.
  btTransform pose = btTransform::getIdentity();
  double mass = 0;             ///< [kg]; 0 if the file gives none.
  btVector3 inertia{0, 0, 0};  ///< Principal moments about the centre of mass [kg m^2].
  btTransform centre_of_mass = btTransform::getIdentity();
  std::vector<Visual> visuals;
  std::vector<Collision> collisions;
};

/// A robot as read from a URDF file; parents come before children.
struct Robot {
  std::string name;
  std::vector<RobotLink> links;

  /// The link that joint `joint` moves. Throws std::runtime_error if there is none.
  const RobotLink& MovedBy(const std::string& joint) const;
};

/// Reads a plain URDF file with urdfdom. A visual's `<texture>` is kept; xacro is not expanded.
/// Throws std::runtime_error with one readable sentence if the file is unreadable or unsuitable.
Robot LoadRobot(const std::string& file);

}  // namespace tld_follower::sim
