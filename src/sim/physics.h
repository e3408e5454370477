// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

#include "sim/robot.h"
#include "sim/world.h"

namespace tld_follower::sim {

/// A rigid body whose own frame need not lie in its centre of mass.
struct Body {
  btRigidBody* rigid = nullptr;
  btTransform centre_of_mass = btTransform::getIdentity();  ///< In the body's own frame.

  /// Pose of the body's own frame in the world.
  btTransform Pose() const { return rigid->getWorldTransform() * centre_of_mass.inverse(); }
  /// The same so many seconds ago, had its velocities been those of now.
  btTransform PoseBefore(double seconds) const;
  /// Velocity of the origin of the body's own frame, world axes [m/s].
  btVector3 Velocity() const;
  /// World axes [rad/s].
  btVector3 AngularVelocity() const { return rigid->getAngularVelocity(); }
};

/// Bullet's rigid body dynamics with every object's lifetime in one place.
///
/// Two instances that are built and stepped alike stay bit-identical; a used instance cannot be
/// rewound to that, so a reset builds a new one.
class Physics {
 public:
  /// Time step [s].
  static constexpr double kStep = 0.002;

  /// `world` must outlive this object.
  explicit Physics(const World& world);
  ~Physics();
  Physics(const Physics&) = delete;
  Physics& operator=(const Physics&) = delete;

  /// Adds one body made of `links`, which are given in the robot's root frame with the root at
  /// `root_pose`. Masses are summed, inertias moved by the parallel axis theorem; the principal
  /// axes are taken parallel to the root's. The body's own frame is that of the first link. Throws
  /// std::runtime_error if the links have no mass or no collision shape.
  Body AddBody(const std::vector<const RobotLink*>& links, const btTransform& root_pose);

  /// Adds a joint that turns freely about `axis` (a unit vector in the world) through `pivot` (in
  /// the world). The two bodies do not collide with each other.
  btHingeConstraint* AddHinge(const Body& parent, const Body& child, const btVector3& pivot,
                              const btVector3& axis);

  /// Velocity of the air, world axes [m/s]; calm at first.
  void SetWind(const btVector3& wind) { wind_ = wind; }
  const btVector3& wind() const { return wind_; }

  /// Advances by kStep. Forces that were applied to the bodies act during this step. Models with a
  /// script move to where they are at `time` [s], the end of the step; nothing stops them.
  void Step(double time);

  /// Everything that can be touched, in the order in which it was added.
  const btCollisionObjectArray& objects() const { return world_->getCollisionObjectArray(); }

  /// Calls `visit(other)` for each object that touches `object` after the last step.
  template <typename Visitor>
  void ForEachContact(const btCollisionObject* object, Visitor visit) const {
    for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
      const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(i);
      if (manifold->getBody0() != object && manifold->getBody1() != object) continue;
      for (int p = 0; p < manifold->getNumContacts(); ++p) {
        if (manifold->getContactPoint(p).getDistance() > 0) continue;
        visit(manifold->getBody0() == object ? manifold->getBody1() : manifold->getBody0());
        break;
      }
    }
  }

  /// Distance from `from` along the unit vector `direction` to the first object but `ignored` [m];
  /// `range` if there is none within `range`.
  double CastRay(const btVector3& from, const btVector3& direction, double range,
                 const btCollisionObject* ignored) const;

 private:
  struct Moving {
    const Model* model;
    btTransform pose;  // Of the body in the model's moving frame.
    btRigidBody* body;
  };

  btCollisionShape* MakeShape(const Geometry& geometry);
  btCompoundShape* MakeCompound();

  btDefaultCollisionConfiguration configuration_;
  mutable btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<Moving> moving_;
  std::vector<std::unique_ptr<btTypedConstraint>> constraints_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  btVector3 wind_{0, 0, 0};
};

}  // namespace tld_follower::sim
