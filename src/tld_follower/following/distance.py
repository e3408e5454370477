"""How far the target is: from the stereo points inside its box, or from the area of the box alone."""

import math

import numpy as np


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

    A low percentile rather than the minimum: block matching gives some per cent of wrong, too near points.
    """

    def __init__(self, parameters):
        self._percentile = parameters.near_percentile
        self._min_points = parameters.min_points

    def measure(self, box, cloud):
        """Return the distance in metres, or NaN where the box holds too few points.

        Parameters
        ----------
        box : Box
            The target in pixels of the left image.
        cloud : ndarray of shape (height, width, 3), or None
            Points in metres, one for each pixel of the left image.
        """
        if cloud is None:
            return math.nan
        near = ranges(cloud[box_pixels(box, *cloud.shape[:2])])
        if near.size < self._min_points:
            return math.nan
        return float(np.percentile(near, self._percentile))


class BoxDistance:
    """Distance from the area of the box alone, for drones with one camera (thesis sections 3.3 and 4.2).

    Areas shrink with the square of the distance: d = d_set sqrt(A_first / A). The first box of a target is
    taken to be drawn at the set distance, as in the thesis' experiment.
    """

    def __init__(self, parameters):
        self._set_distance = parameters.set_distance
        self._area = None

    def measure(self, box, cloud):
        """Return the distance in metres; the arguments are those of `StereoDistance.measure`."""
        if self._area is None:
            self._area = box.area
        return self._set_distance * math.sqrt(self._area / box.area)
