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
from tld_follower.tld.object_model import best_products as _bp
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
        self._last_box = self._box = inside
        self._coherent = 9
        self._doubt = False
        self._missed = 0
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
        detections = self._detector.detect(frame, self._last_box, self._reach())
        self._result = self._fuse(frame, tracked, detections)
        box = self._result.box
        if box is None:
            self._missed += 1
        else:
            self._missed = 0
            self._last_box = self._box = box
            if self._result.valid and self.learning:
                self._learn(frame, self._result, detections)
        self._frame = frame
        return self._result

    def _reach(self) -> int:
        """Size steps about the last box to search: few while it is tracked, more the longer it is lost."""
        import os
        parameters = self._parameters
        wider = self._missed // int(os.environ.get("WIDEN", 8))
        return min(parameters.tracking_scales + wider, parameters.scales)

    def _similarity(self, frame: Frame, box: Box) -> tuple[float, float]:
        """Relative and conservative similarity of a box."""
        similarity = self._detector.model.similarity(frame.patches(np.array([box.as_tuple()])))
        return float(similarity.relative[0]), float(similarity.conservative[0])

    def _track(self, frame: Frame) -> Box | None:
        box = self._box
        self._residual = 9.0
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
        self._residual = flow.residual
        return flow.box

    def _fuse(self, frame: Frame, tracked: Box | None, detections: Detections) -> Result:
        """Decide on the state of the object (thesis section 3.1.4; Kalal 2012)."""
        import os
        CON = float(os.environ.get("CON", 0.45)); GRACE = int(os.environ.get("GRACE", 10)); LOSTT = float(os.environ.get("LOSTT", 0.5))
        LOSTC = float(os.environ.get("LOSTC", 0.0))
        parameters = self._parameters
        clusters = [c for c in self._detector.clusters(detections) if c.conservative > CON]
        if tracked is None:
            self._box = None
            return self._redetect(frame, clusters)
        box = self._refine(tracked, detections)
        box = self._align(frame, box, detections)
        relative, conservative = self._similarity(frame, box)
        rivals = [
            c
            for c in clusters
            if c.box.overlap(tracked) < parameters.takeover_overlap and c.confidence > relative
        ]
        if len(rivals) == 1:
            self._doubt=True; self._coherent=0
            return Result(rivals[0].box, rivals[0].confidence, True, False, "detector")
        MCONF = int(os.environ.get("MCONF", 3)); LOSTU=float(os.environ.get("LOSTU", 0.4))
        if self._residual > float(os.environ.get("RESID", 0.05)): self._doubt = True
        if relative < (LOSTT if self._doubt else LOSTU) or conservative < LOSTC:
            self._box = box if self._missed < GRACE else None
            return Result(None, 0.0, False, self._result.valid and self._missed < GRACE, "none")
        if self._residual < float(os.environ.get("RESID", 0.05)) and relative >= LOSTT: self._coherent += 1
        else: self._coherent = 0
        if self._coherent > MCONF and relative >= 0.5: self._doubt = False
        valid = self._result.valid or conservative > parameters.valid_threshold
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

    def _align(self, frame: Frame, box: Box, detections: Detections) -> Box:
        import os
        step = float(os.environ.get("ASTEP", 0.06)); gain = float(os.environ.get("AGAIN", 0.3)); mode = os.environ.get("AMODE", "conservative")
        rounds = int(os.environ.get("AROUNDS", 2)); minsim = float(os.environ.get("AMIN", 0.8))
        if gain <= 0: return box
        center = np.array(box.as_tuple())
        best = center
        offs = np.array([(x, y, s) for s in (-1, 0, 1) for y in (-1, 0, 1) for x in (-1, 0, 1)], float)
        for r in range(rounds):
            h = step * 0.5**r
            c = best[:2] + best[2:] / 2
            wh = best[2:] * (1 + h) ** offs[:, 2:3]
            cc = c + offs[:, :2] * h * best[2:]
            boxes = np.concatenate([cc - wh / 2, wh], axis=1)
            m = self._detector.model
            if mode == "first":
                v = 0.5 + 0.5 * _bp(frame.patches(boxes), m.positives.patches[: (len(m.positives) + 1) // 2])
            else:
                v = m.similarity(frame.patches(boxes)).positive
            k = int(np.argmax(v))
            if v[k] > v[13] + 1e-6:
                best = boxes[k]
        if v[k] < minsim: return box
        out = center + gain * (best - center)
        return Box(*map(float, out))

    def _learn(self, frame: Frame, result: Result, detections: Detections) -> None:
        """Train on a valid frame, unless the view has changed too fast or shows too little."""
        import os
        LEARN = float(os.environ.get("LEARN", 0.5))
        box = result.box
        if self._coherent < int(os.environ.get("MCOH", 1)): return
        if box.inside_fraction(frame.width, frame.height) < 0.9 or result.confidence < LEARN:
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
