# SPDX-License-Identifier: BSD-3-Clause
"""The memory of the target's keypoints (the thesis' TLD_SIFT).

They bear witness for or against a box, and propose one after loss.
"""

from __future__ import annotations

import math
from enum import IntEnum

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld.frame import Frame
from tld_follower.tld.keypoints import SiftKeypoints
from tld_follower.tld.parameters import Parameters

# A proposal's change of size is within this ratio, and so much of it in the image.
MAX_SCALE, MIN_INSIDE = 5.0, 0.5


class Witness(IntEnum):
    """What the keypoints in a box say of it."""

    AGAINST = -1
    SILENT = 0
    FOR = 1


class SiftMemory:
    """A bounded memory of the target's keypoints, in coordinates of its box; the first view stays.

    Parameters
    ----------
    keypoints : the detector of keypoints.
    parameters : those named `sift_...` and `witness_...`.
    """

    def __init__(self, keypoints: SiftKeypoints, parameters: Parameters) -> None:
        self._keypoints = keypoints
        self._parameters = parameters
        self._calls = 0
        self._expected = 0.0
        self._views: list[tuple[np.ndarray, np.ndarray]] = []

    def learn(self, frame: Frame, box: Box) -> None:
        """Take in a trusted box; the oldest view but the first goes when the memory is full."""
        self._calls += 1
        if (self._calls - 1) % self._parameters.sift_interval:
            return
        points, descriptors = self._keypoints.detect(frame, box, self._keypoints.octave(box))
        if len(points) == 0:
            return
        if not self._views:
            self._expected = self._parameters.witness_first * len(points)
        relative = (points - np.array(box.center, np.float32)) / np.float32(np.sqrt(box.area))
        self._views.append((relative.astype(np.float32), descriptors))
        if len(self._views) > self._parameters.sift_views:
            del self._views[1]

    @property
    def state(self) -> tuple[int, float, list[tuple[np.ndarray, np.ndarray]]]:
        """Calls of `learn`, keypoints expected, and each view's points (N, 2) and descriptors (N, 128)."""
        return self._calls, self._expected, list(self._views)

    def restore(self, calls: int, expected: float, views: list[tuple[np.ndarray, np.ndarray]]) -> None:
        """Take over the `state` of another memory."""
        self._calls, self._expected, self._views = calls, expected, list(views)

    @property
    def mature(self) -> bool:
        """True once several looks are known: a single one says nothing of the target's other sides."""
        return len(self._views) >= self._parameters.witness_views

    def ask(self, points: np.ndarray, descriptors: np.ndarray, box: Box, trusted: bool) -> Witness:
        """Judge a box by the keypoints about it.

        Parameters
        ----------
        points, descriptors : (N, 2) and (N, 128) float32, see `SiftKeypoints.around`.
        trusted : the box is the target for certain: it says how many keypoints are to be expected.
        """
        parameters, expected = self._parameters, self._expected
        count = self._recognised(points, descriptors, box)
        if trusted:
            self._expected += parameters.witness_rate * (count - expected)
        if count >= max(parameters.witness_least, parameters.witness_enough * expected):
            return Witness.FOR
        missed = expected >= parameters.witness_expected and count <= parameters.witness_few * expected
        return Witness.AGAINST if missed else Witness.SILENT

    def _recognised(self, points: np.ndarray, descriptors: np.ndarray, box: Box) -> int:
        """Count the keypoints that are known and lie where the target in this box has them."""
        if not self._views or len(points) < 2:
            return 0
        known, pairs = self._matches(descriptors, self._parameters.witness_ratio)
        side = np.sqrt(box.area)
        places = known[pairs[:, 0]] * side + np.array(box.center)
        near = np.hypot(*(points[pairs[:, 1]] - places).T) < self._parameters.witness_error * side
        return len(set(pairs[near, 1].tolist()))

    def _matches(self, descriptors: np.ndarray, ratio: float) -> tuple[np.ndarray, np.ndarray]:
        """Match the memory with the keypoints of an image by Lowe's ratio test.

        Each known keypoint looks for its place in the image: the second best there is a real rival.

        Returns
        -------
        the known places (M, 2) in coordinates of the box, and pairs of indices (K, 2): known, in the image.
        """
        known = np.concatenate([view[0] for view in self._views])
        memory = np.concatenate([view[1] for view in self._views])
        matches = cv2.BFMatcher(cv2.NORM_L2).knnMatch(memory, descriptors, k=2)
        pairs = [(a.queryIdx, a.trainIdx) for a, b in matches if a.distance < ratio * b.distance]
        return known, np.array(pairs, np.int64).reshape(-1, 2)

    def propose(self, frame: Frame, last: Box, turn: int) -> Box | None:
        """Search the whole frame for the target, or its next tile where it is too large for one frame's time.

        Matches that pass Lowe's ratio test vote for a similarity transform, found robustly (RANSAC).

        Parameters
        ----------
        last : the target's last box; the search begins about it, and a proposal has its aspect ratio.
        turn : counts the calls since the target was lost.
        """
        if not self._views:
            return None
        parameters = self._parameters
        octave = self._keypoints.octave(last)
        tiles = search_tiles(frame.width, frame.height, last, parameters.sift_pixels * 4**octave)
        points, descriptors = self._keypoints.detect(frame, tiles[turn % len(tiles)], octave)
        if len(points) < 2:
            return None
        known, pairs = self._matches(descriptors, parameters.sift_ratio)
        if len(np.unique(pairs[:, 1])) < parameters.sift_matches:
            return None
        source, target = known[pairs[:, 0]], points[pairs[:, 1]]
        side = np.sqrt(last.area)
        error = parameters.sift_error * side + 1.0
        matrix, inliers = cv2.estimateAffinePartial2D(
            source * side, target, method=cv2.RANSAC, ransacReprojThreshold=error
        )
        if matrix is None:
            return None
        distinct = np.unique(pairs[inliers[:, 0] > 0, 1])
        scale = float(np.hypot(matrix[0, 0], matrix[1, 0]))
        if len(distinct) < parameters.sift_matches or not 1.0 / MAX_SCALE < scale < MAX_SCALE:
            return None
        center = float(matrix[0, 2]), float(matrix[1, 2])
        box = Box.from_center(*center, last.width * scale, last.height * scale)
        return box if box.inside_fraction(frame.width, frame.height) > MIN_INSIDE else None


def search_tiles(width: int, height: int, target: Box, budget: float) -> list[Box]:
    """Cover an image with equal tiles that overlap by the target's sides, nearest to the target first.

    Parameters
    ----------
    width, height : of the image [pixel].
    budget : area of a tile [pixel]; it is exceeded only where a tile would not hold the target twice over.
    """
    if width * height <= budget:
        return [Box(0.0, 0.0, width, height)]
    side = np.sqrt(budget)
    tile_width = min(width, max(side, 2.0 * target.width))
    tile_height = min(height, max(budget / tile_width, 2.0 * target.height))
    xs = _starts(width, tile_width, target.width)
    ys = _starts(height, tile_height, target.height)
    tiles = [Box(x, y, tile_width, tile_height) for y in ys for x in xs]
    return sorted(tiles, key=lambda tile: math.dist(tile.center, target.center))


def _starts(length: float, tile: float, overlap: float) -> list[float]:
    count = 1 + math.ceil((length - tile) / (tile - overlap)) if length > tile else 1
    return np.linspace(0.0, length - tile, count).tolist()
