# SPDX-License-Identifier: BSD-3-Clause
"""SIFT re-detection: the target's keypoints propose a box after loss (the thesis' TLD_SIFT)."""

from __future__ import annotations

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld.frame import Frame
from tld_follower.tld.keypoints import SiftKeypoints

RATIO = 0.75
MIN_MATCHES = 5
MAX_ERROR = 0.08


class SiftMemory:
    """A bounded memory of the target's keypoints, in coordinates of its box; the first view stays.

    Parameters
    ----------
    keypoints : the detector of keypoints.
    views : most views kept.
    interval : calls of `learn` for each view taken.
    """

    def __init__(self, keypoints: SiftKeypoints, views: int, interval: int) -> None:
        self._keypoints = keypoints
        self._interval = interval
        self._calls = 0
        self._views: list[tuple[np.ndarray, np.ndarray]] = []
        self._capacity = views

    def learn(self, frame: Frame, box: Box) -> None:
        """Take in a trusted box; the oldest view but the first goes when the memory is full."""
        self._calls += 1
        if (self._calls - 1) % self._interval:
            return
        points, descriptors = self._keypoints.detect(frame, box)
        if len(points) == 0:
            return
        relative = (points - np.array(box.center, np.float32)) / np.float32(np.sqrt(box.area))
        self._views.append((relative.astype(np.float32), descriptors))
        if len(self._views) > self._capacity:
            del self._views[1]

    @property
    def state(self) -> tuple[int, list[tuple[np.ndarray, np.ndarray]]]:
        """Calls of `learn`, and of each view the keypoints (N, 2) and descriptors (N, 128), float32."""
        return self._calls, list(self._views)

    def restore(self, calls: int, views: list[tuple[np.ndarray, np.ndarray]]) -> None:
        """Take over the `state` of another memory."""
        self._calls, self._views = calls, list(views)

    def propose(self, frame: Frame, shape: Box) -> Box | None:
        """Search the whole frame for the target.

        Matches that pass Lowe's ratio test vote for a similarity transform, found robustly (RANSAC).

        Parameters
        ----------
        shape : a box with the target's aspect ratio.
        """
        if not self._views:
            return None
        points, descriptors = self._keypoints.detect(frame, Box(0.0, 0.0, frame.width, frame.height))
        known = np.concatenate([view[0] for view in self._views])
        memory = np.concatenate([view[1] for view in self._views])
        if len(points) < 2:
            return None
        # Each known keypoint looks for its place in the image: the second best there is a real rival.
        matches = cv2.BFMatcher(cv2.NORM_L2).knnMatch(memory, descriptors, k=2)
        pairs = [(a.queryIdx, a.trainIdx) for a, b in matches if a.distance < RATIO * b.distance]
        if len({train for _, train in pairs}) < MIN_MATCHES:
            return None
        source = known[[query for query, _ in pairs]]
        target = points[[train for _, train in pairs]]
        side = np.sqrt(shape.area)
        matrix, inliers = cv2.estimateAffinePartial2D(
            source * side, target, method=cv2.RANSAC, ransacReprojThreshold=MAX_ERROR * side + 1.0
        )
        if matrix is None:
            return None
        distinct = {pairs[i][1] for i in np.flatnonzero(inliers)}
        scale = float(np.hypot(matrix[0, 0], matrix[1, 0]))
        if len(distinct) < MIN_MATCHES or not 0.2 < scale < 5.0:
            return None
        center = float(matrix[0, 2]), float(matrix[1, 2])
        box = Box.from_center(*center, shape.width * scale, shape.height * scale)
        return box if box.inside_fraction(frame.width, frame.height) > 0.5 else None
