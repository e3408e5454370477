// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "sim/camera.h"
#include "sim/husky.h"
#include "sim/mobile_robot.h"
#include "sim/spiri.h"
#include "sim/world.h"

namespace tld_follower::sim {

/// A place that replaces the world's, as high above the ground there [m, rad].
struct Placement {
  double x = 0, y = 0, yaw = 0;
};

/// Where the stereo pair stands on a ground vehicle; config/ugv.yaml.
struct Mast {
  double forward = 0.30;  ///< Of base_link [m].
  double height = 0.50;   ///< Above base_link [m].
  double pitch = 0.34;    ///< Of the pair, downwards [rad].
};

/// What becomes of the robots that a world places.
struct CastConfig {
  SpiriParameters spiri;  ///< Of every drone.
  HuskyParameters husky;  ///< Of every ground robot.
  Mast mast;
  std::optional<Placement> vehicle_place, target_place;
};

/// One of the robots that play in a world: its name there, its file's content, its start.
struct CastMember {
  std::string name;
  Robot robot;
  btTransform start = btTransform::getIdentity();
  double ground = 0;  ///< Height of the ground at its start [m].
  bool flies = false;
};

/// Who carries the cameras and who is followed. The name that a world gives to a robot says which
/// it is: the vehicle is "spiri", a drone, or "ugv", a ground robot; the target is "husky", a
/// ground robot, or "target", a drone that hovers where it starts.
class Cast {
 public:
  /// Throws std::runtime_error if the world lacks one of them or its file is unsuitable.
  Cast(const World& world, const CastConfig& config);

  const CastMember& vehicle() const { return vehicle_; }
  const CastMember& target() const { return target_; }

  /// The stereo pair where the vehicle carries it.
  StereoCamera Mounted(StereoCamera camera) const;

  /// New robots at their starts. This object must outlive them.
  std::unique_ptr<MobileRobot> MakeVehicle(Physics* physics) const;
  std::unique_ptr<MobileRobot> MakeTarget(Physics* physics) const;

 private:
  CastConfig config_;
  CastMember vehicle_, target_;
};

}  // namespace tld_follower::sim
