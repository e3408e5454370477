# SPDX-License-Identifier: BSD-3-Clause
"""Where the target goes by its legs, and where a drone that follows it well would be."""

import math
from dataclasses import dataclass

import numpy as np

from tld_follower.evaluation.plan import Obstacle, Pose, Waypoint

RATE = 50.0  # Hz, of a path's samples
# How fast the target reaches what it is commanded: config/husky.yaml [m/s^2, rad/s^2].
_ACCELERATION, _YAW_ACCELERATION = 3.0, 6.0
# Husky from above: its length and its width over the wheels [m].
HUSKY = (0.99, 0.69)
# The left camera is so far before the drone's middle [m], and at hover so far above Husky's deck that with
# 1 m between camera and target this much of it is horizontal [m].
CAMERA_AHEAD, REACH = 0.08, 0.926
# From the drone's middle to Husky's when the drone keeps 1 m behind it [m].
FOLLOWING_LENGTH = CAMERA_AHEAD + REACH + 0.5 * HUSKY[0]
_SCENERY = (  # texture, shape, size
    ("crate", "box", (1.0, 1.0, 1.0)),
    ("barrel", "cylinder", (0.6, 0.6, 0.9)),
    ("concrete", "box", (0.4, 2.4, 1.2)),
    ("container", "box", (6.1, 2.4, 2.6)),
    ("brick", "box", (4.0, 0.25, 2.2)),
)


@dataclass(frozen=True)
class Path:
    """Samples of a way at `RATE`: arrays (N,) of s, m, m, m above the start, rad."""

    t: np.ndarray
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    yaw: np.ndarray

    def at(self, t):
        """Return the `Pose` at time `t`, in s."""
        return Pose(*(float(np.interp(t, self.t, values)) for values in (self.x, self.y, self.yaw)))

    @property
    def places(self):
        """Array (N, 2) of x, y in m."""
        return np.column_stack([self.x, self.y])


def _approach(value, goal, step):
    return value + min(max(goal - value, -step), step)


def target_path(target, legs, start, end):
    """Drive the target by its legs within its acceleration; returns a `Path` from 0 s to `end`."""
    x, y, yaw = target
    z = speed = turn = climb = 0.0
    samples, step = [], 1.0 / RATE
    ends = start + np.cumsum([leg.duration for leg in legs])
    for t in np.arange(0.0, end + 0.5 * step, step):
        samples.append((t, x, y, z, yaw))
        i = int(np.searchsorted(ends, t, side="right"))
        forward, turns, climbs = legs[i][1:] if t >= start and i < len(legs) else (0.0, 0.0, 0.0)
        speed = _approach(speed, forward, _ACCELERATION * step)
        turn = _approach(turn, turns, _YAW_ACCELERATION * step)
        climb = _approach(climb, climbs, _ACCELERATION * step)
        yaw += turn * step
        x += speed * math.cos(yaw) * step
        y += speed * math.sin(yaw) * step
        z += climb * step
    return Path(*np.array(samples).T)


def following_path(path, drone):
    """Follow a `Path` from the `Pose` of the drone, always as far off as at the start and facing it.

    Such a way is the tractrix of the target's.
    """
    place = np.array([drone.x, drone.y])
    length = math.dist(place, (path.x[0], path.y[0]))
    places = []
    for goal in path.places:
        sight = goal - place
        place = goal - sight * (length / np.hypot(*sight))
        places.append(place)
    x, y = np.array(places).T
    yaw = np.unwrap(np.arctan2(path.y - y, path.x - x))
    return Path(path.t, x, y, np.zeros_like(x), yaw)


def stand_off(target, bearing, draw):
    """Place the drone 1 m from a Husky, facing it.

    Parameters
    ----------
    target : Pose
    bearing : float
        Direction from Husky to the drone, rad to the left of Husky's heading.
    draw : Draw
        Shifts it by up to 5 cm along and 15 cm across the line of sight, and turns it by up to 0.05 rad.

    Returns
    -------
    Pose
    """
    along, across = math.cos(bearing), math.sin(bearing)
    half = 0.5 * np.array(HUSKY)
    length = 0.0
    while np.hypot(*np.maximum(np.abs([length * along, length * across]) - half, 0.0)) < REACH:
        length += 0.001
    length += CAMERA_AHEAD + draw.between(-0.05, 0.05)
    aside = draw.between(-0.15, 0.15)
    direction = target.yaw + bearing
    cos, sin = math.cos(direction), math.sin(direction)
    x, y = target.x + length * cos - aside * sin, target.y + length * sin + aside * cos
    return Pose(x, y, math.remainder(direction + math.pi, math.tau) + draw.between(-0.05, 0.05))


def scenery(draw, *paths, count=8, room=2.2):
    """Scatter obstacles about, none nearer to any sample of the paths than `room` m; returns a tuple."""
    places = np.concatenate([path.places for path in paths])
    low, high = places.min(axis=0) - 8.0, places.max(axis=0) + 8.0
    found = []
    while len(found) < count:
        texture, shape, size = _SCENERY[len(found) % len(_SCENERY)]
        spot = Waypoint(0.0, *draw.random.uniform(low, high), draw.random.uniform(-math.pi, math.pi))
        thing = Obstacle(f"scenery_{len(found)}", size, (spot,), texture, shape)
        if thing.distance(places, 0.0).min() >= room:
            found.append(thing)
    return tuple(found)
