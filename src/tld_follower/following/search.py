"""Recovery of a lost target: look where it was heading, fly after it, look around, climb."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from tld_follower.following.own_motion import level

_FACED = 0.15  # rad
_LOOK = 0.7  # s, to where the target should be, before it is looked for from elsewhere
_ELSEWHERE = 0.8  # m
_REPLAN = 0.5  # s
_ANGLES = np.linspace(0, 2 * math.pi, 24, endpoint=False)
_RADII = (1.2, 2.0)  # set distances, from where the target should be
_NEARNESS = 0.5  # m of difference to the view that was last for each m on the way
_RISES = (0.0, 0.5, 1.0)  # m
_THERE = 0.2  # m
_HIDING = 0.3  # m, farther than this from the sight line a cell hides nothing
_NEAR_TARGET = 0.25  # m, cells about the target's place do not hide it: they may be it


class Phase(Enum):
    """What a search is doing, in the words that are published."""

    GO = "facing where the target should be, flying to where that can be seen"
    SWEEP = "looking around"
    CLIMB = "climbing to see farther"


@dataclass(frozen=True)
class Wish:
    """What the search wants: velocity in m/s, odom frame, and yaw rate in rad/s."""

    phase: Phase
    velocity: np.ndarray
    yaw_rate: float


class Search:
    """The search for one lost target.

    Parameters
    ----------
    parameters : Parameters
    now : float
        When the target was lost, s.
    position, velocity : ndarray, shape (3,)
        Of the target then, m and m/s in the odom frame.
    sight : ndarray, shape (3,)
        From the camera to the target when it was seen last, odom frame.
    side : float
        The side to which it was heading, left positive: the sense of turning.
    """

    def __init__(self, parameters, now, position, velocity, sight, side):
        self._p = parameters
        self._lost_at = now
        self._position, self._velocity = position, velocity * np.array([1.0, 1.0, 0.0])
        self._sight = sight * (parameters.set_distance / max(float(np.linalg.norm(sight)), 1e-3))
        self._side = 1.0 if side >= 0 else -1.0
        self._looked_from = []  # places, odom frame
        self._plan = [Phase.GO, Phase.SWEEP, Phase.CLIMB, Phase.SWEEP]
        self._start(now)

    def _start(self, now):
        """Begin the next phase of the plan."""
        self._began, self._goal, self._planned = now, None, -math.inf
        self._turned, self._yaw, self._arrived = 0.0, None, None

    def place(self, now):
        """Where the target should be: it drives on for `coast_time`, ndarray (3,), metres."""
        coast = min(now - self._lost_at, self._p.coast_time)
        return self._position + coast * self._velocity

    def step(self, now, motion, camera, obstacles, safe):
        """Return the `Wish` of this moment, or None when the search has ended in vain.

        `obstacles` are places as ndarray (n, 3) in metres, odom frame; `safe` is the `SafeMotion`.
        """
        if now - self._lost_at > self._p.search_time:
            return None
        while self._plan:
            phase = self._plan[0]
            if now - self._began <= self._limit(phase):
                wish = self._wish(phase, now, motion, camera, obstacles, safe)
                if wish is not None:
                    return wish
            self._plan.pop(0)
            self._start(now)
        return None

    def _limit(self, phase):
        return {
            Phase.GO: self._p.go_limit,
            Phase.SWEEP: 2 * math.pi / self._p.sweep_rate + 1.0,
            Phase.CLIMB: self._p.search_climb / self._p.max_climb_rate + 1.0,
        }[phase]

    def _wish(self, phase, now, motion, camera, obstacles, safe):
        """Return what a phase wants, None once it is done."""
        bearing = self._bearing(self.place(now), motion, camera)
        face = min(max(self._p.yaw_gain * bearing, -self._p.sweep_rate), self._p.sweep_rate)
        still = np.zeros(3)
        if phase is Phase.SWEEP:
            if self._yaw is not None:
                self._turned += abs(math.remainder(motion.yaw - self._yaw, 2 * math.pi))
            self._yaw = motion.yaw
            return None if self._turned > 2 * math.pi else Wish(phase, still, self._side * self._p.sweep_rate)
        if phase is Phase.CLIMB:
            if self._p.vehicle == "ugv":
                return None
            if self._goal is None:
                self._goal = motion.position + np.array([0.0, 0.0, self._p.search_climb])
            rise = self._goal[2] - motion.position[2]
            return (
                None if rise < _THERE / 2 else Wish(phase, np.array([0.0, 0.0, self._p.max_climb_rate]), face)
            )
        if now - self._planned > _REPLAN:
            self._planned = now
            self._goal = self._viewpoint(self.place(now), motion.position, obstacles, safe)
        way = still if self._goal is None else self._goal - motion.position
        distance = float(np.linalg.norm(way))
        if distance >= _THERE:
            self._arrived = None
            return Wish(phase, way / distance * min(self._p.search_speed, 1.5 * distance), face)
        if self._goal is None and len(self._looked_from) > 0:
            return None
        if self._arrived is None or abs(bearing) > _FACED:
            self._arrived = now
        # A target that drives on is flown after; one that should stand there and is not seen is looked for
        # from elsewhere.
        if now - self._arrived > _LOOK and now - self._lost_at > self._p.coast_time / 2:
            self._looked_from.append(motion.position.copy())
            self._arrived, self._planned = None, -math.inf
        return Wish(phase, still, face)

    @staticmethod
    def _bearing(place, motion, camera):
        sight = level(motion.yaw).T @ (place - camera.centre(motion))
        return math.atan2(sight[1], sight[0])

    def _viewpoint(self, place, position, obstacles, safe):
        """Return the best spot in reach from which the target's place can be seen; None without one.

        Best is where it looks as it did when it was seen last, a little less so what is near: a tracker finds
        again what it has learnt.
        """
        ideal = place - self._sight
        around = [
            [place[0] + r * math.cos(a), place[1] + r * math.sin(a), ideal[2] + rise]
            for r in np.array(_RADII) * self._p.set_distance
            for a in _ANGLES
            for rise in _RISES
        ]
        spots = np.array([ideal, *around])
        cost = np.linalg.norm(spots - ideal, axis=1) + _NEARNESS * np.linalg.norm(spots - position, axis=1)
        for spot in spots[np.argsort(cost)]:
            if any(np.linalg.norm(spot - been) < _ELSEWHERE for been in self._looked_from):
                continue
            if safe.reaches(position, spot, obstacles) and _sees(spot, place, obstacles):
                return spot
        return None


def _sees(spot, place, obstacles):
    """Whether no obstacle is near the straight line between two places."""
    line = place - spot
    length = float(np.linalg.norm(line))
    along = (obstacles - spot) @ (line / length)
    off = np.linalg.norm(obstacles - spot - along[:, None] * (line / length), axis=1)
    return not ((along > 0) & (along < length - _NEAR_TARGET) & (off < _HIDING)).any()
