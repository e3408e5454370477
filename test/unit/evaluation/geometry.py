# SPDX-License-Identifier: BSD-3-Clause
"""What a camera on the drone would see of the target between a plan's obstacles, by rays."""

import math

import numpy as np

from tld_follower.evaluation.paths import CAMERA_AHEAD, HUSKY

CAMERA_HEIGHT = 0.63  # m, at hover
_PITCH, _HALF_WIDTH, _HALF_HEIGHT = 0.34, math.tan(math.radians(32.5)), 0.75 * math.tan(math.radians(32.5))
# Points all about Husky's body [m].
_BODY = np.array([(x, y, z) for x in (-0.45, 0.0, 0.45) for y in (-0.28, 0.28) for z in (0.15, 0.36)])
# Points all over Husky from above [m].
_FOOTPRINT = np.array(
    [(x, y) for x in np.linspace(-0.5, 0.5, 21) * HUSKY[0] for y in np.linspace(-0.5, 0.5, 15) * HUSKY[1]]
)


def husky_footprint(pose):
    """Return points (N, 2) all over what a Husky at a pose covers, seen from above, in m."""
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    return _FOOTPRINT @ np.array([[cos, sin], [-sin, cos]]) + (pose.x, pose.y)


def _blocked(obstacle, t, eye, points):
    """Return which segments from the eye to points (N, 3) an obstacle cuts; a cylinder counts as its box."""
    x, y, yaw = obstacle.pose(t)
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    origin = (eye - (x, y, 0.5 * obstacle.size[2])) @ turn
    ray = (points - eye) @ turn
    ray = np.where(np.abs(ray) < 1e-9, 1e-9, ray)
    half = 0.5 * np.array(obstacle.size)
    ends = np.stack([(-half - origin) / ray, (half - origin) / ray])
    return np.maximum(ends.min(axis=0).max(axis=1), 0.0) < np.minimum(ends.max(axis=0).min(axis=1), 1.0)


def shown(plan, drone, points, t, obstacles=None):
    """Return the share of points (N, 3) that a drone at hover sees between the plan's obstacles."""
    cos, sin = math.cos(drone.yaw), math.sin(drone.yaw)
    eye = np.array([drone.x + CAMERA_AHEAD * cos, drone.y + CAMERA_AHEAD * sin, CAMERA_HEIGHT])
    x, y, z = (points - eye).T
    forward, left = cos * x + sin * y, cos * y - sin * x
    along = forward * math.cos(_PITCH) - z * math.sin(_PITCH)
    up = forward * math.sin(_PITCH) + z * math.cos(_PITCH)
    seen = (along > 0) & (np.abs(left) < _HALF_WIDTH * along) & (np.abs(up) < _HALF_HEIGHT * along)
    for obstacle in plan.obstacles if obstacles is None else obstacles:
        seen &= ~_blocked(obstacle, t, eye, points)
    return float(seen.mean())


def target_shown(plan, drone, target, t):
    """Return the share of Husky's body, at the pose `target`, that a drone at hover sees."""
    cos, sin = math.cos(target.yaw), math.sin(target.yaw)
    points = _BODY @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) + (
        target.x,
        target.y,
        0.0,
    )
    return shown(plan, drone, points, t)
