// SPDX-License-Identifier: BSD-3-Clause
#include "sim/physics.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <LinearMath/btTransformUtil.h>

#include <stdexcept>

namespace tld_follower::sim {
namespace {

// Bullet's default margin of 4 cm rounds edges that are compared with distances of centimetres.
constexpr btScalar kMargin = btScalar(0.002);

}  // namespace

btTransform Body::PoseBefore(double seconds) const {
  btTransform before;
  btTransformUtil::integrateTransform(rigid->getWorldTransform(), rigid->getLinearVelocity(),
                                      rigid->getAngularVelocity(), btScalar(-seconds), before);
  return before * centre_of_mass.inverse();
}

btVector3 Body::Velocity() const {
  const btVector3 to_origin =
      rigid->getWorldTransform().getBasis() * (centre_of_mass.inverse() * btVector3(0, 0, 0));
  return rigid->getVelocityInLocalPoint(to_origin);
}

Physics::Physics(const World& world) : dispatcher_(&configuration_) {
  world_ = std::make_unique<btDiscreteDynamicsWorld>(&dispatcher_, &broadphase_, &solver_,
                                                     &configuration_);
  world_->setGravity(world.gravity);
  for (const Model& model : world.models) {
    for (const Collision& collision : model.collisions) {
      btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, MakeShape(collision.geometry));
      info.m_startWorldTransform = model.PoseAt(0) * collision.pose;
      info.m_friction = btScalar(collision.friction);
      bodies_.push_back(std::make_unique<btRigidBody>(info));
      if (!model.script.empty()) {
        btRigidBody* const body = bodies_.back().get();
        body->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
        body->setActivationState(DISABLE_DEACTIVATION);
        moving_.push_back({&model, collision.pose, body});
      }
      world_->addRigidBody(bodies_.back().get());
    }
  }
}

Physics::~Physics() {
  for (auto& constraint : constraints_) world_->removeConstraint(constraint.get());
  for (auto& body : bodies_) world_->removeRigidBody(body.get());
}

btCompoundShape* Physics::MakeCompound() {
  auto compound = std::make_unique<btCompoundShape>();
  compound->setMargin(kMargin);
  btCompoundShape* const result = compound.get();
  shapes_.push_back(std::move(compound));
  return result;
}

btCollisionShape* Physics::MakeShape(const Geometry& geometry) {
  const btVector3& size = geometry.size;
  std::unique_ptr<btCollisionShape> shape;
  switch (geometry.type) {
    case Geometry::Type::kBox:
      shape = std::make_unique<btBoxShape>(size / 2);
      break;
    case Geometry::Type::kCylinder:
      shape = std::make_unique<btCylinderShapeZ>(btVector3(size.x(), size.y(), size.z() / 2));
      break;
    case Geometry::Type::kSphere:
      shape = std::make_unique<btSphereShape>(size.x());
      break;
    case Geometry::Type::kPlane:
      shape = std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0));
      break;
    case Geometry::Type::kTerrain: {
      const Terrain& terrain = *geometry.terrain;
      // Bounds that are symmetric keep z = 0 of the heights at z = 0 of the shape.
      shape = std::make_unique<btHeightfieldTerrainShape>(
          terrain.columns, terrain.rows, terrain.heights.data(), -size.z(), size.z(), /*upAxis=*/2,
          /*flipQuadEdges=*/false);
      shape->setLocalScaling(
          {size.x() / btScalar(terrain.columns - 1), size.y() / btScalar(terrain.rows - 1), 1});
      break;
    }
    case Geometry::Type::kMesh:
      throw std::runtime_error("meshes are not used for collisions");
  }
  // A sphere's margin is its radius.
  if (geometry.type != Geometry::Type::kSphere) shape->setMargin(kMargin);
  shapes_.push_back(std::move(shape));
  return shapes_.back().get();
}

Body Physics::AddBody(const std::vector<const RobotLink*>& links, const btTransform& root_pose) {
  double mass = 0;
  btVector3 centre(0, 0, 0);
  for (const RobotLink* link : links) {
    mass += link->mass;
    centre += btScalar(link->mass) * link->centre_of_mass.getOrigin();
  }
  if (!(mass > 0)) throw std::runtime_error("link '" + links.front()->name + "' has no mass");
  centre /= btScalar(mass);

  btVector3 inertia(0, 0, 0);
  for (const RobotLink* link : links) {
    const btVector3 d = link->centre_of_mass.getOrigin() - centre;
    const btVector3 offset(d.y() * d.y() + d.z() * d.z(), d.x() * d.x() + d.z() * d.z(),
                           d.x() * d.x() + d.y() * d.y());
    inertia += link->inertia + btScalar(link->mass) * offset;
  }

  const btTransform body_in_root(links.front()->pose.getBasis(), centre);
  btCompoundShape* const compound = MakeCompound();
  double friction = 1.0;
  for (const RobotLink* link : links) {
    for (const Collision& collision : link->collisions) {
      compound->addChildShape(body_in_root.inverse() * collision.pose,
                              MakeShape(collision.geometry));
      friction = collision.friction;
    }
  }
  if (compound->getNumChildShapes() == 0) {
    throw std::runtime_error("link '" + links.front()->name + "' has no collision shape");
  }

  btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, compound, inertia);
  info.m_startWorldTransform = root_pose * body_in_root;
  info.m_friction = btScalar(friction);
  bodies_.push_back(std::make_unique<btRigidBody>(info));
  btRigidBody* const rigid = bodies_.back().get();
  rigid->setActivationState(DISABLE_DEACTIVATION);
  world_->addRigidBody(rigid);
  return {rigid, links.front()->pose.inverse() * body_in_root};
}

btHingeConstraint* Physics::AddHinge(const Body& parent, const Body& child, const btVector3& pivot,
                                     const btVector3& axis) {
  const btTransform a = parent.rigid->getWorldTransform().inverse();
  const btTransform b = child.rigid->getWorldTransform().inverse();
  auto hinge = std::make_unique<btHingeConstraint>(
      *parent.rigid, *child.rigid, a * pivot, b * pivot, a.getBasis() * axis, b.getBasis() * axis);
  btHingeConstraint* const result = hinge.get();
  constraints_.push_back(std::move(hinge));
  world_->addConstraint(result, /*disableCollisionsBetweenLinkedBodies=*/true);
  return result;
}

void Physics::Step(double time) {
  for (const Moving& part : moving_) {
    part.body->setWorldTransform(part.model->PoseAt(time) * part.pose);
  }
  world_->stepSimulation(btScalar(kStep), 0, btScalar(kStep));
}

double Physics::CastRay(const btVector3& from, const btVector3& direction, double range,
                        const btCollisionObject* ignored) const {
  struct Callback : btCollisionWorld::ClosestRayResultCallback {
    using ClosestRayResultCallback::ClosestRayResultCallback;
    const btCollisionObject* ignored = nullptr;
    bool needsCollision(btBroadphaseProxy* proxy) const override {
      return proxy->m_clientObject != ignored && ClosestRayResultCallback::needsCollision(proxy);
    }
  };
  const btVector3 to = from + btScalar(range) * direction;
  Callback callback(from, to);
  callback.ignored = ignored;
  world_->rayTest(from, to, callback);
  return callback.hasHit() ? range * callback.m_closestHitFraction : range;
}

}  // namespace tld_follower::sim
