"""Collision avoidance of thesis section 3.3: back off while anything in view is too near."""

import math
from dataclasses import dataclass

import numpy as np

from tld_follower.following.controller import HOVER, Command
from tld_follower.following.mapping import to_velocity

# Every second row and column: an obstacle at the minimum distance covers thousands of pixels.
_STRIDE = 2
# A trend is of so many images without a gap [s] or a jump [m]: of one thing.
_IMAGES, _GAP, _JUMP = 4, 0.15, 0.15


@dataclass(frozen=True)
class Nearest:
    """The nearest thing in view: distance [m], angle below the horizon [rad] (NaN if unknown), and place.

    The place is a point of the optical frame, metres; None if unknown.
    """

    distance: float = math.nan
    below: float = math.nan
    point: np.ndarray | None = None


class Trend:
    """How near the nearest thing will be: its distance over the last images, carried on."""

    def __init__(self, ahead):
        self._ahead = ahead
        self._seen = []  # (s, m)

    def ahead(self, stamp, distance):
        """Return the distance to expect, metres, given this image's; never more than that."""
        last = self._seen[-1] if self._seen else None
        if last is None or not 0 < stamp - last[0] < _GAP or not abs(distance - last[1]) < _JUMP:
            self._seen = []
        self._seen = [*self._seen[1 - _IMAGES :], (stamp, distance)]
        if len(self._seen) < _IMAGES:
            return distance
        times, distances = np.array(self._seen).T
        rate = float(np.polyfit(times - stamp, distances, 1)[0])
        return distance + min(0.0, rate) * self._ahead


class Avoidance:
    """Watch the overall minimum of the depth, whatever it belongs to."""

    def __init__(self, parameters):
        self._p = parameters
        self._active = False

    def nearest(self, cloud):
        """Return the `Nearest` of a cloud: ndarray (height, width, 3) in metres, optical frame, or None.

        The nearest points, as many as `obstacle_fraction` of all pixels, are passed over: wrong matches come
        in small patches.
        """
        if cloud is None:
            return Nearest()
        points = cloud[::_STRIDE, ::_STRIDE].reshape(-1, 3)
        passed_over = int(self._p.obstacle_fraction * len(points))
        squares = np.einsum("ij,ij->i", points, points)
        seen = np.isfinite(squares)
        squares, points = squares[seen], points[seen]
        if squares.size <= passed_over:
            return Nearest()
        order = np.argpartition(squares, passed_over)
        point = points[order[: passed_over + 1]].mean(axis=0)
        x, y, z = point
        below = self._p.camera_pitch + math.atan2(y, math.hypot(x, z))
        return Nearest(math.sqrt(squares[order[passed_over]]), below, point)

    def retreat(self, nearest):
        """Return the `Command` that leads away from what is nearer than the minimum, or None.

        Backwards, as in the thesis, and upwards as far as the thing lies below: backing off alone never
        clears the ground. Once it has begun it lasts until the minimum plus the hysteresis is clear. While
        nothing is measured, as nearer than the cameras can match, it hovers.
        """
        if math.isnan(nearest.distance):
            return HOVER if self._active else None
        limit = self._p.minimum_distance + (self._p.clearance_hysteresis if self._active else 0.0)
        self._active = nearest.distance < limit
        if not self._active:
            return None
        gap = max(limit - nearest.distance, self._p.clearance_hysteresis)
        speed = to_velocity(gap, self._p.minimum_distance, self._p.max_speed)
        below = min(max(nearest.below, 0.0), math.pi / 2)
        return Command(x=-speed * math.cos(below), z=min(speed * math.sin(below), self._p.max_climb_rate))
