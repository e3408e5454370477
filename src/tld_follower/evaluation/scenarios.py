"""What the target does in each scenario, and where everything starts. Pure functions of time and seed."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Scenario:
    """A flight: the target rests, is boxed at `box_at`, drives from `start` to `halt`; ends at `end`.

    All times are seconds of simulated time since the start of the simulation.
    """

    name: str
    box_at: float
    start: float
    halt: float
    end: float
    drive: tuple[tuple[float, float, float], ...]  # from start to halt: s, m/s forward, rad/s to the left
    world: str = "testing_grounds.world"

    scripted = False  # the follower flies the drone, not a script

    def target_command(self, t, _seed):
        """Speed in m/s and turn rate in rad/s that Husky is commanded at time `t`."""
        t -= self.start
        for duration, speed, turn_rate in self.drive:
            if 0.0 <= t < duration:
                return speed, turn_rate
            t -= duration
        return 0.0, 0.0

    def spiri_pose(self, seed):
        """Start pose x, y in m and yaw in rad; a seed moves it a little sideways and along.

        Seed 0 starts right behind Husky, 1 m from it.
        """
        x, y, yaw = SPIRI_START
        if seed:
            x, y, yaw = (x, y, yaw) + np.random.default_rng(seed).uniform(-1, 1, 3) * (0.05, 0.15, 0.05)
        return float(x), float(y), float(yaw)

    def husky_pose(self, _seed):
        """Start pose x, y in m and yaw in rad; empty for the world's."""
        return ()


# 1 m from the left camera to Husky's rear at hover height, with Husky at the origin facing +x.
SPIRI_START = (-1.5, 0.0, 0.0)

# Thesis sections 4.2 and 4.3: rest, 12 s straight at 1 m/s, halt.
STRAIGHT = Scenario("straight", box_at=4.0, start=6.0, halt=18.0, end=24.0, drive=((12.0, 1.0, 0.0),))

# A slab passes between the drone and the target, twice; a model of half the target's size stands by the lane.
OCCLUSION = Scenario(
    "occlusion",
    box_at=4.0,
    start=6.0,
    halt=26.0,
    end=30.0,
    drive=((20.0, 1.0, 0.0),),
    world="occlusion.world",
)
