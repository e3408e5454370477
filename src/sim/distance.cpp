// SPDX-License-Identifier: BSD-3-Clause
#include "sim/distance.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include <algorithm>
#include <limits>

namespace tld_follower::sim {
namespace {

constexpr btScalar kReach = 5;  // Terrain farther than this counts as infinitely far [m].

double ConvexToConvex(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
                      const btTransform& pose_b) {
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver penetration;
  btGjkPairDetector detector(&a, &b, &simplex, &penetration);
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA = pose_a;
  input.m_transformB = pose_b;
  btPointCollector result;
  detector.getClosestPoints(input, result, nullptr);
  return result.m_hasResult ? result.m_distance : std::numeric_limits<double>::infinity();
}

double PlaneToConvex(const btStaticPlaneShape& plane, const btTransform& plane_pose,
                     const btConvexShape& shape, const btTransform& pose) {
  const btTransform in_plane = plane_pose.inverse() * pose;
  const btVector3& normal = plane.getPlaneNormal();
  const btVector3 lowest =
      in_plane * shape.localGetSupportingVertex(-(normal * in_plane.getBasis()));
  return normal.dot(lowest) - plane.getPlaneConstant();
}

double TrianglesToConvex(const btConcaveShape& triangles, const btTransform& triangles_pose,
                         const btConvexShape& shape, const btTransform& pose) {
  struct Nearest : btTriangleCallback {
    Nearest(const btConvexShape& shape, const btTransform& pose) : shape(shape), pose(pose) {}
    void processTriangle(btVector3* corners, int, int) override {
      btTriangleShape triangle(corners[0], corners[1], corners[2]);
      triangle.setMargin(0);
      distance =
          std::min(distance, ConvexToConvex(triangle, btTransform::getIdentity(), shape, pose));
    }
    const btConvexShape& shape;
    const btTransform pose;
    double distance = std::numeric_limits<double>::infinity();
  };
  Nearest nearest(shape, triangles_pose.inverse() * pose);
  btVector3 low, high;
  shape.getAabb(nearest.pose, low, high);
  const btVector3 reach(kReach, kReach, kReach);
  triangles.processAllTriangles(&nearest, low - reach, high + reach);
  return nearest.distance;
}

}  // namespace

double Distance(const btCollisionShape& a, const btTransform& pose_a, const btCollisionShape& b,
                const btTransform& pose_b) {
  if (b.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(b);
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      nearest = std::min(nearest, Distance(a, pose_a, *compound.getChildShape(i),
                                           pose_b * compound.getChildTransform(i)));
    }
    return nearest;
  }
  if (a.isCompound() || b.isConcave()) {
    return Distance(b, pose_b, a, pose_a);
  }
  const auto& convex = static_cast<const btConvexShape&>(b);
  if (a.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    return PlaneToConvex(static_cast<const btStaticPlaneShape&>(a), pose_a, convex, pose_b);
  }
  if (a.isConcave()) {
    return TrianglesToConvex(static_cast<const btConcaveShape&>(a), pose_a, convex, pose_b);
  }
  return ConvexToConvex(static_cast<const btConvexShape&>(a), pose_a, convex, pose_b);
}

double Distance(const btVector3& point, const btCollisionObject& object) {
  btSphereShape dot(0);  // A sphere's radius is its margin, so this is a point.
  return Distance(dot, btTransform(btQuaternion::getIdentity(), point), *object.getCollisionShape(),
                  object.getWorldTransform());
}

}  // namespace tld_follower::sim
