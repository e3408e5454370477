// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <btBulletCollisionCommon.h>

namespace tld_follower::sim {

/// Distance between two shapes [m] by Gilbert-Johnson-Keerthi; 0 or less where they overlap.
/// Understood: convex primitives, compounds of them, and a plane or terrain as one of
/// the two; terrain farther than 5 m in each axis is infinitely far.
double Distance(const btCollisionShape& a, const btTransform& pose_a, const btCollisionShape& b,
                const btTransform& pose_b);

/// Distance from a point in the world to an object [m]; 0 or less inside it.
double Distance(const btVector3& point, const btCollisionObject& object);

}  // namespace tld_follower::sim
