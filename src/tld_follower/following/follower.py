"""The follower: one command for every box, and hover wherever it can't know better."""

import math
from dataclasses import replace

from tld_follower.following.controller import HOVER
from tld_follower.following.limits import Limits
from tld_follower.following.own_motion import OwnMotion
from tld_follower.following.predictive_pilot import PredictivePilot
from tld_follower.following.state import Mode, Scene, State
from tld_follower.following.thesis_pilot import ThesisPilot

_PILOTS = {"thesis": ThesisPilot, "predictive": PredictivePilot}


class Follower:
    """Turns each box and its cloud into one command.

    A pilot decides; the follower sees to it that it decides on fresh measurements only, and that what it
    commands stays within the limits. A box older than `max_age`, no target yet, or NaN: hover.
    """

    def __init__(self, parameters):
        self._p = parameters
        self._own = OwnMotion(parameters)
        self._limits = Limits(parameters)
        self._pilot = _PILOTS[parameters.control](parameters, self._own)
        self._target = 0
        self._seen = False
        self._last = HOVER

    def add_odometry(self, stamp, position, quaternion, velocity):
        """Take the drone's own motion; see `OwnMotion.add`."""
        self._own.add(stamp, position, quaternion, velocity)

    def update(self, box, target, stamp, now, cloud, cloud_stamp):
        """Decide what to do about one box.

        Parameters
        ----------
        box : Box or None
            The target in pixels of the left image; None while it is not visible.
        target : int
            Which target the box belongs to; another number is another target.
        stamp, now : float
            When the box's image was taken, and the present, s.
        cloud : ndarray of shape (image_height, image_width, 3), or None
            Points in metres in the left camera's optical frame, NaN where there is no depth.
        cloud_stamp : float
            When the cloud's images were taken, s.

        Returns
        -------
        State
        """
        if target != self._target:
            self._target, self._seen = target, False
            self._pilot.take_target()
        self._own.reckon(now, self._last)
        state = self._decide(box, stamp, now, cloud, cloud_stamp)
        self._last = self._limits.apply(state.command, now)
        return replace(state, command=self._last)

    def _decide(self, box, stamp, now, cloud, cloud_stamp):
        if not self._fresh(now - stamp):
            return State(Mode.LOST if self._seen else Mode.WAITING, "the newest box is too old")
        if box is None and not self._seen:
            return State(Mode.WAITING, "no target was shown yet")
        self._seen = True
        if not self._fresh(now - cloud_stamp):
            cloud, cloud_stamp = None, stamp
        then, cloud_then, present = (self._own.at(t) for t in (stamp, cloud_stamp, now))
        scene = Scene(box, stamp, now, cloud, cloud_stamp, then, cloud_then, present)
        return self._pilot.decide(scene)

    def _fresh(self, age):
        return math.isfinite(age) and -self._p.max_age <= age <= self._p.max_age
