# SPDX-License-Identifier: BSD-3-Clause
"""The points that carry the median flow: a regular grid, or the target's SIFT keypoints with it."""

from __future__ import annotations

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld.frame import Frame

GRID_MARGIN = 0.05
DESCRIPTOR = 128
# Side of the region about a target that is searched for its keypoints, its own being 1.
REACH = 1.4


def grid(box: Box, side: int) -> np.ndarray:
    """Return side x side points spread over a box less a margin of 5 %.

    Returns
    -------
    (side^2, 2) float32, x and y in pixels.
    """
    steps = np.linspace(GRID_MARGIN, 1.0 - GRID_MARGIN, side)
    x, y = np.meshgrid(box.x + steps * box.width, box.y + steps * box.height)
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float32)


class SiftKeypoints:
    """SIFT keypoints and descriptors of a part of a frame (Lowe 2004; thesis section 2.2).

    Parameters
    ----------
    limit : at most this many keypoints a call, the strongest first.
    side : a target is read from the first octave where its side (root of the area) is not larger [pixel].
    """

    def __init__(self, limit: int, side: float) -> None:
        self._sift = cv2.SIFT_create(nfeatures=limit)
        self._side = side

    def octave(self, target: Box) -> int:
        """Return the octave that a target of this size is read from."""
        return max(0, int(np.ceil(np.log2(max(np.sqrt(target.area), 1.0) / self._side))))

    def detect(self, frame: Frame, region: Box, octave: int) -> tuple[np.ndarray, np.ndarray]:
        """Find the keypoints of a region.

        Parameters
        ----------
        region : part of the frame [pixel].
        octave : the level to read, see `octave`.

        Returns
        -------
        points (N, 2) float32 [pixel] and descriptors (N, 128) float32.
        """
        gray = frame.level(octave).gray
        factor = round(frame.height / gray.shape[0])
        part = Box(*(v / factor for v in region.as_tuple())).clip(gray.shape[1], gray.shape[0])
        x0, y0 = int(part.x), int(part.y)
        crop = gray[y0 : int(np.ceil(part.bottom)), x0 : int(np.ceil(part.right))]
        if min(crop.shape) < 8:
            return np.zeros((0, 2), np.float32), np.zeros((0, DESCRIPTOR), np.float32)
        found, descriptors = self._sift.detectAndCompute(np.ascontiguousarray(crop), None)
        if not found:
            return np.zeros((0, 2), np.float32), np.zeros((0, DESCRIPTOR), np.float32)
        points = cv2.KeyPoint_convert(found) + np.array([x0 + 0.5, y0 + 0.5], np.float32)
        return (points * factor).astype(np.float32), descriptors

    def around(self, frame: Frame, target: Box) -> tuple[np.ndarray, np.ndarray]:
        """Find the keypoints of a target and of its near surroundings; see `detect`."""
        return self.detect(frame, target.scale(REACH), self.octave(target))


def flow_points(points: np.ndarray, box: Box, grid_side: int) -> np.ndarray:
    """Return the keypoints inside a box, at most half of grid_side^2, and the grid: (N, 2) float32.

    Blur takes the keypoints first: the grid must be able to carry the flow alone.

    Parameters
    ----------
    points : keypoints (N, 2) float32 [pixel].
    """
    inside = (
        (points[:, 0] > box.x)
        & (points[:, 0] < box.right)
        & (points[:, 1] > box.y)
        & (points[:, 1] < box.bottom)
    )
    return np.concatenate([points[inside][: grid_side * grid_side // 2], grid(box, grid_side)])
