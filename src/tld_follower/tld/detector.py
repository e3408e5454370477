# SPDX-License-Identifier: BSD-3-Clause
"""The detector: windows through variance gate, ferns and nearest neighbour (thesis section 3.1.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tld_follower.box import Box
from tld_follower.tld.ferns import Ferns
from tld_follower.tld.frame import Frame, Level
from tld_follower.tld.object_model import ObjectModel, Similarity
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.scanning import deinterleave, scan_windows
from tld_follower.tld.storage import Model
from tld_follower.tld.windows import WindowSize, window_sizes

CLUSTER_OVERLAP = 0.5


@dataclass(frozen=True)
class Candidates:
    """Windows that passed the ferns, the most confident first.

    Attributes
    ----------
    boxes : (N, 4) float64 [pixel].
    codes : (N, ferns) int32
    confidences : (N,) float32, mean posteriors.
    """

    boxes: np.ndarray
    codes: np.ndarray
    confidences: np.ndarray


@dataclass(frozen=True)
class Detections(Candidates):
    """Candidates with their patches (N, 225) and similarity to the object model."""

    patches: np.ndarray
    similarity: Similarity


@dataclass(frozen=True)
class Cluster:
    """Detections of one place.

    Attributes
    ----------
    box : their mean, weighted by relative similarity [pixel].
    confidence, conservative : the best relative and the best conservative similarity among them.
    """

    box: Box
    confidence: float
    conservative: float


class Detector:
    """The cascade and its thresholds, made for one target.

    Parameters
    ----------
    frame, box : the target's first view; it sets the window sizes and the variance gate.
    """

    def __init__(self, frame: Frame, box: Box, parameters: Parameters, rng: np.random.Generator) -> None:
        self._parameters = parameters
        self.ferns = Ferns(parameters.ferns, parameters.comparisons, rng)
        self.model = ObjectModel(parameters.max_positives, parameters.max_negatives)
        self.sizes = window_sizes(box, self.ferns.comparisons, parameters)
        self.min_variance = parameters.variance_ratio * frame.variance(np.array(box.as_tuple()))
        self.fern_threshold = parameters.fern_threshold
        self.nn_threshold = parameters.nn_threshold
        self.phase = 0
        self._corners = np.empty((parameters.max_windows, 2), np.int32)
        self._confidences = np.empty(parameters.max_windows, np.float32)
        self._codes = np.empty((parameters.max_windows, parameters.ferns), np.int32)

    def restore(self, model: Model) -> None:
        """Take over what another detector learnt."""
        self.ferns.restore(model.comparisons, model.counts)
        self.sizes = window_sizes(model.target, model.comparisons, self._parameters)
        self.min_variance = model.min_variance
        self.fern_threshold, self.nn_threshold = model.fern_threshold, model.nn_threshold
        self.phase = model.phase
        for patch in model.positives:
            self.model.positives.add(patch)
        for patch in model.negatives:
            self.model.negatives.add(patch)

    def scan(self, frame: Frame, around: Box, scales: int, threshold: float) -> Candidates:
        """Return every window that passes the variance gate and has a mean posterior above a threshold.

        If the frame has more windows than `max_windows`, each call looks at an even share of them, and at all
        of those about `around`; the shares take turns.

        Parameters
        ----------
        around : the last box of the target; windows within `scales` size steps of it are scanned.
        """
        ratio = np.log(self._parameters.scale_step)
        reach = (scales + 0.5) * ratio
        active = [s for s in self.sizes if abs(np.log(s.width / around.width)) <= reach]
        total = sum(size.count(frame.width, frame.height) for size in active)
        stride = max(1, -(-total // self._parameters.max_windows))
        self.phase = (self.phase + 1) % stride
        filled, boxes = 0, []
        # Blurred levels with their columns sorted, by octave and step: sizes share them.
        sorted_levels: dict[tuple[int, int], np.ndarray] = {}
        for size in active:
            start = filled
            level = frame.level(size.octave)
            key = size.octave, int(size.grid[2]) * stride
            if key not in sorted_levels:
                sorted_levels[key] = deinterleave(level.blurred, key[1])
            sparse = (stride, self.phase)
            filled = self._scan_size(level, sorted_levels[key], size, around, threshold, sparse, start)
            boxes.append(size.boxes(self._corners[start:filled]))
        order = np.argsort(-self._confidences[:filled], kind="stable")
        return Candidates(
            np.concatenate([np.empty((0, 4)), *boxes])[order],
            self._codes[:filled][order],
            self._confidences[:filled][order],
        )

    def _scan_size(
        self,
        level: Level,
        pixels: np.ndarray,
        size: WindowSize,
        around: Box,
        threshold: float,
        sparse: tuple[int, int],
        filled: int,
    ) -> int:
        """Scan the windows of one size; returns the number of rows filled so far, see `scan_windows`."""
        if level.gray.shape[0] < size.grid[1] or level.gray.shape[1] < size.grid[0]:
            return filled
        integral, squares = level.integrals
        near = (
            (around.x - around.width) / size.factor,
            (around.y - around.height) / size.factor,
            (around.x + around.width) / size.factor,
            (around.y + around.height) / size.factor,
        )
        return scan_windows(
            pixels,
            integral,
            squares,
            size.grid,
            size.offsets,
            self.ferns.posteriors,
            self.min_variance,
            threshold,
            sparse,
            near,
            self._corners,
            self._confidences,
            self._codes,
            filled,
        )

    def detect(self, frame: Frame, around: Box, scales: int) -> Detections:
        """Run the whole cascade; see `scan`. At most `max_candidates` windows reach the nearest neighbour."""
        found = self.scan(frame, around, scales, self.fern_threshold)
        kept = slice(self._parameters.max_candidates)
        patches = frame.patches(found.boxes[kept])
        return Detections(
            found.boxes[kept],
            found.codes[kept],
            found.confidences[kept],
            patches,
            self.model.similarity(patches),
        )

    def accepts(self, relative: np.ndarray | float) -> np.ndarray | bool:
        """Whether relative similarities are at most `redetection_margin` under the threshold."""
        return relative > self.nn_threshold - self._parameters.redetection_margin

    def clusters(self, detections: Detections) -> list[Cluster]:
        """Group the detections that may be the target by overlap, the most confident first.

        Their relative similarity is at most `redetection_margin` under the threshold; clusters that the early
        templates do not support (`min_conservative`) are left out.
        """
        parameters = self._parameters
        similarity = detections.similarity
        accepted = np.flatnonzero(self.accepts(similarity.relative))
        boxes, weights = detections.boxes[accepted], similarity.relative[accepted]
        labels = label_clusters(boxes, CLUSTER_OVERLAP)
        clusters = []
        for label in range(labels.max(initial=-1) + 1):
            members = labels == label
            mean = np.average(boxes[members], axis=0, weights=weights[members])
            conservative = float(similarity.conservative[accepted][members].max())
            if conservative > parameters.min_conservative:
                clusters.append(Cluster(Box(*map(float, mean)), float(weights[members].max()), conservative))
        return sorted(clusters, key=lambda c: -c.confidence)


@njit(cache=True)
def overlaps(boxes, box):
    """Intersection over union of boxes (N, 4) with one box (4,), x, y, width, height; (N,) float64."""
    result = np.zeros(boxes.shape[0])
    for n in range(boxes.shape[0]):
        width = min(boxes[n, 0] + boxes[n, 2], box[0] + box[2]) - max(boxes[n, 0], box[0])
        height = min(boxes[n, 1] + boxes[n, 3], box[1] + box[3]) - max(boxes[n, 1], box[1])
        if width > 0.0 and height > 0.0:
            shared = width * height
            result[n] = shared / (boxes[n, 2] * boxes[n, 3] + box[2] * box[3] - shared)
    return result


@njit(cache=True)
def label_clusters(boxes, min_overlap):
    """Label the connected groups of boxes (N, 4) whose neighbours overlap by more than `min_overlap`.

    Returns
    -------
    (N,) int64, 0 for the first box's group and on in order of appearance.
    """
    count = boxes.shape[0]
    labels = np.full(count, -1, np.int64)
    stack = np.empty(count, np.int64)
    label = 0
    for seed in range(count):
        if labels[seed] >= 0:
            continue
        labels[seed] = label
        stack[0] = seed
        depth = 1
        while depth > 0:
            depth -= 1
            shared = overlaps(boxes, boxes[stack[depth]])
            for n in range(count):
                if labels[n] < 0 and shared[n] > min_overlap:
                    labels[n] = label
                    stack[depth] = n
                    depth += 1
        label += 1
    return labels
