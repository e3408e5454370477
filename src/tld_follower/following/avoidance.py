"""Collision avoidance of thesis section 3.3: back off while anything in view is too near."""

import math

import numpy as np

from tld_follower.following.distance import ranges
from tld_follower.following.mapping import to_velocity

# Every second row and column: an obstacle at the minimum distance covers thousands of pixels.
_STRIDE = 2


class Avoidance:
    """Watch the overall minimum of the depth, whatever it belongs to."""

    def __init__(self, parameters):
        self._minimum = parameters.minimum_distance
        self._hysteresis = parameters.clearance_hysteresis
        self._fraction = parameters.obstacle_fraction
        self._max_speed = parameters.max_speed
        self._active = False

    def nearest(self, cloud):
        """Distance in metres of the nearest thing in view; NaN without any depth.

        `cloud` is an ndarray (height, width, 3) in metres, or None. The nearest points, as many as
        `obstacle_fraction` of all pixels, are passed over: wrong matches come in small patches.
        """
        if cloud is None:
            return math.nan
        sample = cloud[::_STRIDE, ::_STRIDE]
        distances = ranges(sample)
        passed_over = int(self._fraction * sample.shape[0] * sample.shape[1])
        if distances.size <= passed_over:
            return math.nan
        return float(np.partition(distances, passed_over)[passed_over])

    def retreat(self, nearest):
        """Backward speed in m/s (zero or negative) that clears the minimum distance.

        Once it has begun it lasts until the minimum plus the hysteresis is clear, and it is never slower than
        the hysteresis over the minimum maps to, so that it does end.
        """
        limit = self._minimum + (self._hysteresis if self._active else 0.0)
        self._active = nearest < limit
        if not self._active:
            return 0.0
        return -to_velocity(max(limit - nearest, self._hysteresis), self._minimum, self._max_speed)
