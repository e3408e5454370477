# SPDX-License-Identifier: BSD-3-Clause
"""Scenario `fastboard`: the target is gone five frames after it was shown, and comes and goes from then on.

After the thesis' own sequence of that name (265 frames, the target in view in 140), which is not
published. Drone and target move on a script, so that every tracker is shown the same film.
"""

import math
from dataclasses import dataclass

import numpy as np

from tld_follower.evaluation.plan import Leg, Plan, Pose

RATE = 30.0  # frames a second
FRAMES = 265
# The target is in view up to this frame; frames count from 0, the one in which it is boxed.
LAST_SHOWN = 5
# A bearing is the angle from the camera's axis to the target, positive on the side where it leaves first
# [rad]. The view ends here: half the field of view, a little less for the camera's pitch.
_EDGE = 0.56
# A bearing at which the target has just left the view, and the largest one.
_GONE, _AWAY = 0.68, 0.86
# How fast the bearing changes [rad/s]. At the first exit drone and target move against each other, too; by
# turning alone, at most at 0.95 rad/s, the drone would not be so fast.
_EXIT, _PAN = 1.0, 0.72
# By this much the bearing is ahead of the script at the first exit: the drone gets under way late [rad].
_AHEAD = 0.03
# When all begins to move, and when the target is boxed [s].
_START, _SHOWN_AT = 3.0, 4.2
# The pan is smoothed over this time [s].
_SMOOTH = 0.4
# How the yaw rate r answers its command c: r' = P (c - r) - D r |r|, P from config/spiri.yaml, D the drag
# there over the drone's moment of inertia [1/s, 1/rad].
_YAW_P, _YAW_DRAG = 5.0, 5.8
# Lag of the drone's velocity behind its command [s].
_LAG = 0.25
# The target circles about this place; the drone hovers at -x of it, in the middle of the lane [m].
_CENTRE = np.array([1.0, 0.0])
_DISTANCE = 4.2
_TARGET_SIZE = (0.99, 0.69)  # m
# The visits after the first: the frame in which the target comes into view; frames and bearings between which
# the pan goes evenly; the side on which it leaves, 1 or -1 (0: it stays).
_VISITS = (
    (27, ((48.0, 0.15), (50.0, 0.15)), 1),
    (98, ((120.0, 0.15), (130.0, 0.0)), -1),
    (221, ((243.0, -0.15), (270.0, 0.0)), 0),
)


class Script:
    """The motions of one seed, as functions of the time since the boxing in s."""

    def __init__(self, seed):
        random = np.random.default_rng(seed)
        # 1: at first the target leaves to the left.
        self.side = random.choice((-1.0, 1.0))
        # The target comes nearer as it turns; at first one of its sides is seen.
        self.turn_rate = self.side * random.uniform(0.4, 0.5)
        self.speed = random.uniform(0.5, 0.6)
        self._heading = self.side * 0.5 * math.pi + random.uniform(-0.5, 0.5)
        self._start = _CENTRE - (_DISTANCE, 0.0) + random.uniform(-0.2, 0.2, 2)
        self._sway_rate = random.uniform(0.8, 1.1, 2)
        self._sway = np.array([random.uniform(-0.4, 0.4), -self.side * 0.8 / self._sway_rate[1]])
        frames, bearings = zip(*self._pan(random), strict=True)
        self._pan_times, self._pan_bearings = np.array(frames) / RATE, np.array(bearings)

    def _pan(self, random):
        """Yield frames and bearings between which the bearing changes evenly."""
        gone = LAST_SHOWN + 0.5
        exit_ = _EDGE + self._half_width(gone / RATE) - _AHEAD
        yield gone - (exit_ + 0.3) / _EXIT * RATE, -0.3
        yield gone + (_AWAY - exit_) / _EXIT * RATE, _AWAY
        side = 1
        for enters, turns, side_out in _VISITS:
            shift = random.uniform(-2.0, 2.0)
            yield enters + shift - (_AWAY - _GONE) / _PAN * RATE, side * _AWAY
            for frame, bearing in turns:
                yield frame + shift, bearing
            side = side_out
            if side:
                yield frame + shift + abs(side * _AWAY - bearing) / _PAN * RATE, side * _AWAY

    def target_pose(self, t):
        """Place x, y in m and heading in rad of the target."""
        heading = self._heading + self.turn_rate * t
        radius = self.speed / self.turn_rate
        return *(_CENTRE + radius * np.array([math.sin(heading), -math.cos(heading)])), heading

    def drone_place(self, t):
        """Place x, y in m of the drone."""
        return self._start + self._sway * np.sin(self._sway_rate * t)

    def drone_velocity(self, t):
        """Velocity of the drone in m/s, world axes."""
        return self._sway * self._sway_rate * np.cos(self._sway_rate * t)

    def drone_yaw(self, t):
        """Heading of the drone in rad."""
        x, y, _ = self.target_pose(t)
        along, across = (x, y) - self.drone_place(t)
        around = np.linspace(t - 0.5 * _SMOOTH, t + 0.5 * _SMOOTH, 13)
        bearing = np.interp(around, self._pan_times, self._pan_bearings).mean()
        return math.atan2(across, along) - self.side * float(bearing)

    def _half_width(self, t):
        """Half the angle in rad under which the drone sees the target from end to end."""
        x, y, heading = self.target_pose(t)
        forward = np.array([math.cos(heading), math.sin(heading)])
        sight = (x, y) - self.drone_place(t)
        distance = math.hypot(*sight)
        length, width = _TARGET_SIZE
        along = abs(forward @ sight) / distance
        return 0.5 * (length * math.sqrt(1.0 - along**2) + width * along) / distance


@dataclass(frozen=True)
class ScriptedPlan(Plan):
    """A plan in which the drone is flown by a script, too; times count as in `Plan`."""

    script: Script | None = None

    scripted = True

    def drone_command(self, t):
        """Velocity forward, left and up in m/s and yaw rate in rad/s that the drone is commanded at `t`."""
        if t < self.start:
            return 0.0, 0.0, 0.0, 0.0
        script, t = self.script, t - _SHOWN_AT
        before, yaw, after = (script.drone_yaw(t + i / RATE) for i in range(3))
        rate, acceleration = (after - before) * 0.5 * RATE, (after - 2.0 * yaw + before) * RATE**2
        turn = rate + (acceleration + _YAW_DRAG * rate * abs(rate)) / _YAW_P
        cos, sin = math.cos(yaw), math.sin(yaw)
        x, y = script.drone_velocity(t + _LAG)
        return cos * x + sin * y, cos * y - sin * x, 0.0, turn


def fastboard(seed):
    """Move target and drone on a script, after the thesis' sequence: the target drives a circle."""
    script, begins = Script(seed), _START - _SHOWN_AT
    return ScriptedPlan(
        "fastboard",
        Pose(*script.drone_place(begins), script.drone_yaw(begins)),
        Pose(*script.target_pose(begins)),
        (Leg(_SHOWN_AT - _START + (FRAMES - 1) / RATE, script.speed, script.turn_rate),),
        frozenset(),
        box_at=_SHOWN_AT,
        start=_START,
        rest=0.0,
        world="testing_grounds.world",
        script=script,
    )
