# SPDX-License-Identifier: BSD-3-Clause
"""The points that carry the median flow: a regular grid, or the target's SIFT keypoints completed by it."""

from __future__ import annotations

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld.frame import Frame

GRID_MARGIN = 0.05
DESCRIPTOR = 128


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
    max_side : a region is read from the first octave where its longer side is not larger [pixel].
    """

    def __init__(self, limit: int, max_side: float) -> None:
        self._sift = cv2.SIFT_create(nfeatures=limit)
        self._max_side = max_side

    def detect(self, frame: Frame, region: Box) -> tuple[np.ndarray, np.ndarray]:
        """Find the keypoints of a region.

        Returns
        -------
        points (N, 2) float32 [pixel] and descriptors (N, 128) float32.
        """
        octave = max(0, int(np.ceil(np.log2(max(region.width, region.height, 1.0) / self._max_side))))
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

    def flow_points(self, frame: Frame, box: Box, grid_side: int) -> np.ndarray:
        """Return the keypoints inside a box, completed by grid points up to grid_side^2 (N, 2) float32."""
        points, _ = self.detect(frame, box.scale(1.2))
        inside = (
            (points[:, 0] > box.x)
            & (points[:, 0] < box.right)
            & (points[:, 1] > box.y)
            & (points[:, 1] < box.bottom)
        )
        points = points[inside][: grid_side * grid_side]
        missing = grid_side * grid_side - len(points)
        if missing <= 0:
            return points
        side = int(np.ceil(np.sqrt(missing)))
        return np.concatenate([points, grid(box, side)])
