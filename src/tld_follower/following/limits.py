"""The caps that every command obeys, whoever made it."""

import math
from dataclasses import astuple

import numpy as np

from tld_follower.following.controller import HOVER, Command


class Limits:
    """Keeps commands within speed caps and, between commands, within `max_slew` of each other.

    A ground vehicle is commanded in x and yaw alone. Hover is always allowed at once, and a command that
    is not finite becomes it.
    """

    def __init__(self, parameters):
        self._p = parameters
        self._last, self._at = HOVER, None

    def apply(self, command, now):
        """Return the `Command` that is flown at time `now`, s."""
        command = self._capped(command)
        if command != HOVER and self._at is not None:
            command = self._slewed(command, min(max(now - self._at, 0.0), self._p.max_age))
        self._last, self._at = command, now
        return command

    def _capped(self, command):
        p = self._p
        if not all(map(math.isfinite, astuple(command))):
            return HOVER
        if p.vehicle == "ugv":
            command = Command(x=command.x, yaw=command.yaw)
        speed = math.hypot(command.x, command.y)
        scale = min(1.0, p.max_speed / speed) if speed else 1.0
        climb = min(max(command.z, -p.max_climb_rate), p.max_climb_rate)
        yaw = min(max(command.yaw, -p.max_yaw_rate), p.max_yaw_rate)
        return Command(command.x * scale, command.y * scale, climb, yaw)

    def _slewed(self, command, seconds):
        last, wanted = np.array(astuple(self._last)), np.array(astuple(command))
        change = wanted - last
        most = self._p.max_slew * seconds
        for part in (slice(0, 3), slice(3, 4)):
            size = float(np.linalg.norm(change[part]))
            if size > most:
                change[part] *= most / size
        return Command(*map(float, last + change))
