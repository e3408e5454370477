// SPDX-License-Identifier: BSD-3-Clause
#include "sim/cast.h"

#include <algorithm>
#include <stdexcept>

namespace tld_follower::sim {
namespace {

constexpr double kFootprint = 0.6;  // No part of a robot is farther from its middle [m].
constexpr double kMastFoot = 0.2;   // Inside the body, above base_link [m].

// Of the ground under a robot at this place: it starts above all of it.
double HighestGround(const World& world, double x, double y) {
  double highest = 0;
  for (const double dx : {-kFootprint, 0.0, kFootprint}) {
    for (const double dy : {-kFootprint, 0.0, kFootprint}) {
      highest = std::max(highest, world.GroundHeight(x + dx, y + dy));
    }
  }
  return highest;
}

CastMember Find(const World& world, const std::string& drone, const std::string& ground,
                const std::optional<Placement>& given) {
  const RobotPlacement& placement = world.Robot({drone, ground});
  CastMember member;
  member.name = placement.name;
  member.robot = LoadRobot(placement.file);
  member.start = placement.pose;
  member.flies = placement.name == drone;
  btVector3& place = member.start.getOrigin();
  if (given) {
    const double above = place.z() - HighestGround(world, place.x(), place.y());
    place.setValue(btScalar(given->x), btScalar(given->y),
                   btScalar(HighestGround(world, given->x, given->y) + above));
    member.start.setRotation(btQuaternion(btVector3(0, 0, 1), btScalar(given->yaw)));
  }
  member.ground = HighestGround(world, place.x(), place.y());
  return member;
}

// The pole and the camera's housing, fixed to the root; they weigh nothing.
RobotLink MakeMast(const Mast& mast) {
  if (!(mast.height > kMastFoot)) {
    throw std::runtime_error("ugv/camera_height must be more than " + std::to_string(kMastFoot));
  }
  RobotLink link;
  link.name = "mast";
  const double length = mast.height - kMastFoot;
  Visual pole, housing;
  pole.geometry.type = Geometry::Type::kCylinder;
  pole.geometry.size = {btScalar(0.015), btScalar(0.015), btScalar(length)};
  // All of it behind the lenses.
  pole.pose.setOrigin(
      {btScalar(mast.forward - 0.03), 0, btScalar(mast.height - length / 2 - 0.015)});
  pole.material.colour = {0.15f, 0.15f, 0.16f};
  housing.geometry.size = {btScalar(0.03), btScalar(0.12), btScalar(0.03)};
  housing.pose.setOrigin({btScalar(mast.forward - 0.03), 0, btScalar(mast.height)});
  housing.material.colour = {0.3f, 0.3f, 0.32f};
  for (const Visual& visual : {pole, housing}) {
    link.visuals.push_back(visual);
    link.collisions.push_back({visual.pose, visual.geometry});
  }
  return link;
}

}  // namespace

Cast::Cast(const World& world, const CastConfig& config)
    : config_(config),
      vehicle_(Find(world, "spiri", "ugv", config.vehicle_place)),
      target_(Find(world, "target", "husky", config.target_place)) {
  if (!vehicle_.flies) vehicle_.robot.links.push_back(MakeMast(config.mast));
}

StereoCamera Cast::Mounted(StereoCamera camera) const {
  if (vehicle_.flies) return camera;
  camera.position = {btScalar(config_.mast.forward), 0, btScalar(config_.mast.height)};
  camera.pitch = config_.mast.pitch;
  return camera;
}

std::unique_ptr<MobileRobot> Cast::MakeVehicle(Physics* physics) const {
  if (!vehicle_.flies) {
    return std::make_unique<Husky>(config_.husky, vehicle_.robot, vehicle_.start, physics);
  }
  SpiriParameters grounded = config_.spiri;
  grounded.take_off_altitude += vehicle_.ground;
  return std::make_unique<Spiri>(grounded, vehicle_.robot, vehicle_.start, physics);
}

std::unique_ptr<MobileRobot> Cast::MakeTarget(Physics* physics) const {
  if (!target_.flies) {
    return std::make_unique<Husky>(config_.husky, target_.robot, target_.start, physics);
  }
  SpiriParameters airborne = config_.spiri;
  airborne.take_off_altitude = target_.start.getOrigin().z();
  return std::make_unique<Spiri>(airborne, target_.robot, target_.start, physics);
}

}  // namespace tld_follower::sim
