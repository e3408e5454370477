"""How far the target is: from the stereo points inside its box, or from the area of the box alone."""

import math

import numpy as np

_WINDOW = 0.4  # m, about the expected distance
_BIN = 0.02  # m
_LAYER = 5  # bins


def box_pixels(box, height, width):
    """Rows and columns of the pixels inside a box, clipped to an image: two slices."""
    left, top = max(0, math.floor(box.x)), max(0, math.floor(box.y))
    right, bottom = min(width, math.ceil(box.x + box.width)), min(height, math.ceil(box.y + box.height))
    return slice(top, max(top, bottom)), slice(left, max(left, right))


def ranges(points):
    """Distance of every finite point from the camera's centre.

    Parameters
    ----------
    points : ndarray, shape (..., 3)
        Points in metres in the camera's optical frame; NaN where there is no depth.

    Returns
    -------
    ndarray, shape (n,)
        Euclidean distances in metres, of the finite points only.
    """
    squares = np.einsum("...i,...i->...", points, points)
    return np.sqrt(squares[np.isfinite(squares)])


class StereoDistance:
    """Distance to the near surface of the target, from the cloud's points inside the box.

    The near surface is the nearest layer that holds a share of the points, and of it a low percentile: wrong
    matches are nearer than the target, but scattered, and an occluder at the box's edge is another layer.
    """

    def __init__(self, parameters):
        self._percentile = parameters.near_percentile
        self._min_points = parameters.min_points
        self._share = parameters.near_share

    def measure(self, box, cloud, expected=math.nan):
        """Return the distance in metres, or NaN where the box holds too few points.

        Parameters
        ----------
        box : Box
            The target in pixels of the left image.
        cloud : ndarray of shape (height, width, 3), or None
            Points in metres, one for each pixel of the left image.
        expected : float
            Where the target should be, metres: a layer within `_WINDOW` of it is preferred. NaN: unknown.
        """
        if cloud is None:
            return math.nan
        seen = ranges(cloud[box_pixels(box, *cloud.shape[:2])])
        if seen.size < self._min_points:
            return math.nan
        near = seen[np.abs(seen - expected) < _WINDOW] if math.isfinite(expected) else seen
        if near.size < max(self._min_points, self._share * seen.size):
            near = seen
        return self._near_surface(near, max(self._min_points / 2, self._share * seen.size))

    def _near_surface(self, seen, least):
        counts = np.bincount((seen / _BIN).astype(np.intp))
        layers = np.convolve(counts, np.ones(_LAYER, np.intp))  # the layer that ends with each bin
        dense = np.flatnonzero(layers >= least)
        if not dense.size:
            return math.nan
        begin = (dense[0] - _LAYER + 1) * _BIN
        layer = seen[(seen >= begin) & (seen < begin + _LAYER * _BIN)]
        return float(np.percentile(layer, self._percentile))


class BoxDistance:
    """Distance from the area of the box alone, for drones with one camera (thesis sections 3.3 and 4.2).

    Areas shrink with the square of the distance: d = d_set sqrt(A_first / A). The first box of a target is
    taken to be drawn at the set distance, as in the thesis' experiment.
    """

    def __init__(self, parameters):
        self._set_distance = parameters.set_distance
        self._area = None

    def measure(self, box, cloud, expected=math.nan):
        """Return the distance in metres; the arguments are those of `StereoDistance.measure`."""
        if self._area is None:
            self._area = box.area
        return self._set_distance * math.sqrt(self._area / box.area)


def make_distance(parameters):
    """Make the measurement that the parameters ask for; it belongs to one target."""
    return (StereoDistance if parameters.distance == "stereo" else BoxDistance)(parameters)
