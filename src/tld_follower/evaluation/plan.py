# SPDX-License-Identifier: BSD-3-Clause
"""What happens in one flight, as data: where all starts, how the target moves, what stands or moves about."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

BOX_AT = 4.0  # s; Spiri has risen and hovers


class Pose(NamedTuple):
    """Place in m and heading in rad, world axes."""

    x: float
    y: float
    yaw: float


class Leg(NamedTuple):
    """A stretch of the target's way: for so long it is commanded these velocities of its own yaw frame."""

    duration: float  # s
    forward: float = 0.0  # m/s
    turn: float = 0.0  # rad/s, to the left
    climb: float = 0.0  # m/s, for a target that flies


class Waypoint(NamedTuple):
    """Where the middle of an obstacle is at a time of the simulation [s, m, m, rad]."""

    t: float
    x: float
    y: float
    yaw: float = 0.0


@dataclass(frozen=True)
class Obstacle:
    """A box or an upright cylinder that stands on the ground; with several waypoints it moves along them."""

    name: str
    size: tuple[float, float, float]  # m, along its own x and y, and upwards; of a cylinder x = y
    track: tuple[Waypoint, ...]
    texture: str = "brick"  # a picture of worlds/media
    shape: str = "box"  # or cylinder
    model: str = ""  # an SDF model of worlds/ that is shown in place of the shape

    def pose(self, t):
        """Return its `Pose` at time `t` of the simulation, in s: straight on from waypoint to waypoint."""
        times, *columns = zip(*self.track, strict=True)
        return Pose(*(float(np.interp(t, times, column)) for column in columns))

    def distance(self, points, t):
        """Return the distance in m of points (N, 2) of the ground from what it covers there at time `t`."""
        x, y, yaw = self.pose(t)
        offset = np.atleast_2d(points) - (x, y)
        if self.shape == "cylinder":
            return np.maximum(np.hypot(*offset.T) - 0.5 * self.size[0], 0.0)
        cos, sin = math.cos(yaw), math.sin(yaw)
        local = np.abs(offset @ np.array([[cos, -sin], [sin, cos]]))
        return np.hypot(*np.maximum(local - 0.5 * np.array(self.size[:2]), 0.0).T)


@dataclass(frozen=True)
class Light:
    """How the light differs from the world's own: the sun is turned about, raised or dimmed."""

    azimuth: float = 0.0  # rad, to the left
    elevation: float | None = None  # rad above the horizon; None: the world's
    sun: float = 1.0  # share of its brightness
    ambient: float = 1.0


@dataclass(frozen=True)
class Plan:
    """A flight: the target rests, is boxed at `box_at`, moves by its legs from `start` on, rests again.

    All times are seconds of simulated time since the start of the simulation.
    """

    scenario: str
    drone: Pose
    target: Pose
    legs: tuple[Leg, ...]
    figures: frozenset[str]  # those that make sense here; the others are null
    box_at: float = BOX_AT
    start: float = 5.0
    rest: float = 4.0  # s, how long is watched after the halt
    world: str = "empty.world"
    obstacles: tuple[Obstacle, ...] = ()
    light: Light = Light()
    vehicle: str = "uav"  # what follows: uav or ugv
    target_robot: str = "husky"  # as the world calls it

    scripted = False  # the follower flies the drone, not a script

    @property
    def drive_s(self):
        """How long the target moves, s."""
        return sum(leg.duration for leg in self.legs)

    @property
    def halt(self):
        """When the target halts, s."""
        return self.start + self.drive_s

    @property
    def end(self):
        """When the flight ends, s."""
        return self.halt + self.rest

    def target_command(self, t):
        """Speed forward, left and up in m/s and turn rate in rad/s that the target is commanded at `t`."""
        t -= self.start
        for leg in self.legs:
            if 0.0 <= t < leg.duration:
                return leg.forward, 0.0, leg.climb, leg.turn
            t -= leg.duration
        return 0.0, 0.0, 0.0, 0.0


class Draw:
    """Draws what a seed decides. Seed 0 is the plain one: the middle of every range, the first of a choice.

    `random` is the generator behind it, for what is scattered about in the plain one as well.
    """

    def __init__(self, scenario, seed):
        self.plain = seed == 0
        self.random = np.random.default_rng([*scenario.encode(), seed])

    def between(self, low, high):
        """Return a number from `low` to `high`."""
        return 0.5 * (low + high) if self.plain else float(self.random.uniform(low, high))

    def choice(self, options):
        """Return one of the options."""
        return options[0 if self.plain else int(self.random.integers(len(options)))]

    def side(self):
        """Return 1 (left) or -1 (right)."""
        return self.choice((1.0, -1.0))

    def light(self):
        """Return a `Light`; the plain one is the world's own."""
        if self.plain:
            return Light()
        return Light(
            azimuth=self.between(-math.pi, math.pi),
            elevation=self.between(0.45, 1.25),
            sun=self.between(0.6, 1.1),
            ambient=self.between(0.8, 1.1),
        )
