# SPDX-License-Identifier: BSD-3-Clause
"""Tracking-Learning-Detection: tracker and detector fused into one state of the object (thesis section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld import keypoints, median_flow
from tld_follower.tld.detector import Cluster, Detections, Detector, overlaps
from tld_follower.tld.frame import Frame
from tld_follower.tld.learning import Learner
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.redetection import SiftMemory


@dataclass(frozen=True)
class Result:
    """The state of the object in one frame.

    Attributes
    ----------
    box : the target [pixel], None while lost.
    confidence : relative similarity to the object model, 0..1; 0 while lost.
    visible : True where there is a box.
    valid : True while the trajectory is confirmed by the model, and learnt from if learning is on.
    source : who found the box: "tracker", "detector" or "none".
    """

    box: Box | None
    confidence: float
    visible: bool
    valid: bool
    source: str


LOST = Result(None, 0.0, False, False, "none")


class Tracker:
    """Follows one target through the frames of a video.

    Parameters
    ----------
    parameters : see `Parameters`.
    seed : of all random choices; two trackers with one seed and the same input give the same results.
    """

    def __init__(self, parameters: Parameters | None = None, seed: int = 0) -> None:
        self._parameters = parameters or Parameters()
        self._seed = seed
        self._frame: Frame | None = None
        self._result = LOST
        self.learning = self._parameters.learning

    @property
    def initialised(self) -> bool:
        return self._frame is not None

    @property
    def templates(self) -> int:
        """Number of templates in the object model."""
        return len(self._detector.model) if self.initialised else 0

    def init(self, image: np.ndarray, box: Box) -> None:
        """Take a new target; what was known of another is forgotten.

        Parameters
        ----------
        image : uint8 (H, W) or (H, W, 3) BGR
        box : the target [pixel]; a part outside the image is cut off.

        Raises
        ------
        ValueError
            For an image of another kind, a box that is not finite, outside the image or under `min_side`.
            The state stays as it was.
        """
        parameters = self._parameters
        frame = Frame(image, parameters.blur)
        if not box.finite:
            raise ValueError(f"the box must be finite, got {box}")
        inside = box.clip(frame.width, frame.height)
        if inside.area <= 0.0:
            raise ValueError(f"{box} lies outside the image of {frame.width}x{frame.height}")
        if min(inside.width, inside.height) < parameters.min_side:
            raise ValueError(f"the sides of {inside} must be at least {parameters.min_side:g} pixels")
        cv2.setNumThreads(1)
        rng = np.random.default_rng(self._seed)
        self._detector = Detector(frame, inside, parameters, rng)
        self._learner = Learner(self._detector, parameters, rng)
        self._learner.initialise(frame, inside)
        if parameters.tracker == "tld_sift":
            self._sift = keypoints.SiftKeypoints(parameters.sift_keypoints, parameters.sift_side)
            self._memory = SiftMemory(self._sift, parameters.sift_views)
            self._memory.learn(frame, inside)
        self._frame = frame
        self._last_box = inside
        self._result = Result(inside, 1.0, True, True, "tracker")

    def update(self, image: np.ndarray) -> Result:
        """Find the target in the next frame.

        Raises
        ------
        RuntimeError
            Before `init`.
        ValueError
            For an image of another kind or size than the first; the state stays as it was.
        """
        if self._frame is None:
            raise RuntimeError("the tracker has no target: call init first")
        frame = Frame(image, self._parameters.blur)
        if (frame.width, frame.height) != (self._frame.width, self._frame.height):
            raise ValueError(
                f"the image is {frame.width}x{frame.height}, the target was chosen in "
                f"{self._frame.width}x{self._frame.height}"
            )
        tracked = self._track(frame)
        lost = self._result.box is None
        scales = self._parameters.scales if lost else self._parameters.tracking_scales
        detections = self._detector.detect(frame, self._last_box, scales)
        self._result = self._fuse(frame, tracked, detections)
        if self._result.box is not None:
            self._last_box = self._result.box
            if self._result.valid and self.learning:
                self._learn(frame, self._result.box, detections)
        self._frame = frame
        return self._result

    def _similarity(self, frame: Frame, box: Box) -> tuple[float, float]:
        """Relative and conservative similarity of a box."""
        similarity = self._detector.model.similarity(frame.patches(np.array([box.as_tuple()])))
        return float(similarity.relative[0]), float(similarity.conservative[0])

    def _track(self, frame: Frame) -> Box | None:
        box = self._result.box
        if box is None:
            return None
        side = self._parameters.grid_points
        if self._parameters.tracker == "tld_sift":
            points = self._sift.flow_points(self._frame, box, side)
        else:
            points = keypoints.grid(box, side)
        flow = median_flow.track(self._frame, frame, box, points, self._parameters)
        if flow is None or flow.box.inside_fraction(frame.width, frame.height) <= 0.0:
            return None
        return flow.box

    def _fuse(self, frame: Frame, tracked: Box | None, detections: Detections) -> Result:
        """Decide on the state of the object (thesis section 3.1.4; Kalal 2012)."""
        parameters = self._parameters
        clusters = self._detector.clusters(detections)
        if tracked is None:
            return self._redetect(frame, clusters)
        relative, conservative = self._similarity(frame, tracked)
        rivals = [
            c
            for c in clusters
            if c.box.overlap(tracked) < parameters.takeover_overlap and c.confidence > relative
        ]
        if len(rivals) == 1:
            return Result(rivals[0].box, rivals[0].confidence, True, False, "detector")
        valid = self._result.valid or conservative > parameters.valid_threshold
        box = self._refine(tracked, detections)
        return Result(box, relative, True, valid, "tracker")

    def _redetect(self, frame: Frame, clusters: list[Cluster]) -> Result:
        if len(clusters) == 1:
            return Result(clusters[0].box, clusters[0].confidence, True, False, "detector")
        if self._parameters.tracker == "tld_sift" and not clusters:
            proposal = self._memory.propose(frame, self._last_box)
            if proposal is not None:
                relative, _ = self._similarity(frame, proposal)
                if relative > self._detector.nn_threshold:
                    return Result(proposal, relative, True, False, "detector")
        return LOST

    def _refine(self, tracked: Box, detections: Detections) -> Box:
        """Average the tracked box, weighing `fusion_weight`, with the detections that agree with it."""
        near = overlaps(detections.boxes, np.array(tracked.as_tuple())) > self._parameters.fusion_overlap
        near &= detections.similarity.relative > self._detector.nn_threshold
        weight = self._parameters.fusion_weight
        total = weight * np.array(tracked.as_tuple()) + detections.boxes[near].sum(axis=0)
        return Box(*map(float, total / (weight + np.count_nonzero(near))))

    def _learn(self, frame: Frame, box: Box, detections: Detections) -> None:
        """Train on a valid frame, unless the view has changed too fast or shows too little."""
        if box.inside_fraction(frame.width, frame.height) < 0.9:
            return
        relative, _ = self._similarity(frame, box)
        if relative < self._parameters.negative_threshold:
            return
        if frame.variance(np.array(box.as_tuple())) < self._detector.min_variance:
            return
        self._learner.update(frame, box, detections)


def warm_up() -> None:
    """Compile every kernel on a small synthetic video, so that the first real frame is not late."""
    rng = np.random.default_rng(0)
    image = cv2.GaussianBlur(rng.integers(0, 256, (96, 128), np.uint8), (0, 0), 1.5)
    tracker = Tracker()
    tracker.init(image, Box(40.0, 30.0, 32.0, 28.0))
    for shift in range(1, 4):
        tracker.update(np.roll(image, shift, axis=1))
