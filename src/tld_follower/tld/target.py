# SPDX-License-Identifier: BSD-3-Clause
"""One target: flow, detector, fusion, trust and learning from frame to frame (thesis section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tld_follower.box import Box
from tld_follower.tld import keypoints
from tld_follower.tld.alignment import align, blend
from tld_follower.tld.depth import TargetDepth
from tld_follower.tld.detector import Cluster, Detections, Detector
from tld_follower.tld.frame import Frame
from tld_follower.tld.fusion import follow, most_alike, refine
from tld_follower.tld.learning import Learner
from tld_follower.tld.median_flow import Flow
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.redetection import SiftMemory, Witness
from tld_follower.tld.storage import Model
from tld_follower.tld.trust import Trust

# Clusters of detections whose keypoints are asked for in a frame, which takes a millisecond or two each.
MAX_ASKED = 3
# First step of the search that fits a detected box to the target [share of its sides].
DETECTED_STEP = 0.1
# How far the tracked box goes towards the target's outline in a frame; all the way where they overlap less.
OUTLINE_SHARE, OUTLINE_OVERLAP = 0.3, 0.8


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


class Target:
    """All that is known of one target, and where it is.

    Parameters
    ----------
    frame, box : its first view [pixel]; nothing is learnt of it before `teach`.
    depth : what depth says of it.
    seed : of all random choices.
    """

    def __init__(self, frame: Frame, box: Box, depth: TargetDepth, parameters: Parameters, seed: int) -> None:
        self._parameters = parameters
        self._rng = np.random.default_rng(seed)
        self._detector = Detector(frame, box, parameters, self._rng)
        self._learner = Learner(self._detector, parameters, self._rng)
        self._depth = depth
        self._memory: SiftMemory | None = None
        if parameters.tracker == "tld_sift":
            self._sift = keypoints.SiftKeypoints(parameters.sift_keypoints, parameters.sift_side)
            self._memory = SiftMemory(self._sift, parameters)
        self._frame = frame
        self._box: Box | None = box
        self._first_box = self._last_box = box
        # Of the frame seen last, about the box: (N, 2) and (N, 128).
        self._keypoints: tuple[np.ndarray, np.ndarray] | None = None
        self._trust = Trust(parameters)

    @classmethod
    def restored(cls, model: Model, parameters: Parameters, seed: int) -> Target:
        """Return a target that was learnt elsewhere; it is lost, and searched for in the whole image.

        Parameters
        ----------
        model : of a tracker with the same `storage.DECISIVE` parameters.
        """
        depth = TargetDepth(parameters)
        depth.restore(model.depth_size, model.depth_relief)
        width, height = model.image
        blank = Frame(np.zeros((height, width), np.uint8), parameters.blur)
        target = cls(blank, model.target, depth, parameters, seed)
        target._rng.bit_generator.state = model.random
        target._detector.restore(model)
        if target._memory:
            ends = np.cumsum(model.view_lengths)
            parts = (np.split(array, ends)[:-1] for array in (model.view_points, model.view_descriptors))
            target._memory.restore(model.sift_calls, model.sift_expected, list(zip(*parts, strict=True)))
        target._last_box = model.last
        target._drop()
        target._trust.missed = parameters.scales * parameters.widen_frames
        return target

    @property
    def frame(self) -> Frame:
        """The frame seen last."""
        return self._frame

    @property
    def tracking(self) -> bool:
        """True while a box is followed from frame to frame, also while it is too doubtful to be shown."""
        return self._box is not None

    @property
    def box(self) -> Box:
        """The box that is followed, else the last one [pixel]."""
        return self._box or self._last_box

    @property
    def templates(self) -> int:
        """Number of templates in the object model."""
        return len(self._detector.model)

    def teach(self) -> None:
        """Learn the first view, that the target was made with."""
        self._learner.initialise(self._frame, self._first_box)
        if self._memory:
            self._memory.learn(self._frame, self._first_box)

    def model(self) -> Model:
        """Everything that was learnt of the target."""
        calls, expected, views = self._memory.state if self._memory else (0, 0.0, [])
        points = [np.zeros((0, 2), np.float32), *(points for points, _ in views)]
        descriptors = [np.zeros((0, keypoints.DESCRIPTOR), np.float32), *(found for _, found in views)]
        detector = self._detector
        return Model(
            image=(self._frame.width, self._frame.height),
            target=self._first_box,
            last=self._last_box,
            min_variance=detector.min_variance,
            fern_threshold=detector.fern_threshold,
            nn_threshold=detector.nn_threshold,
            phase=detector.phase,
            random=self._rng.bit_generator.state,
            sift_calls=calls,
            sift_expected=expected,
            depth_size=self._depth.size,
            depth_relief=self._depth.relief,
            comparisons=detector.ferns.comparisons.copy(),
            counts=detector.ferns.counts,
            positives=detector.model.positives.patches.copy(),
            negatives=detector.model.negatives.patches.copy(),
            view_lengths=np.array([len(points) for points, _ in views], np.int32),
            view_points=np.concatenate(points),
            view_descriptors=np.concatenate(descriptors),
        )

    def step(self, frame: Frame, depth: np.ndarray | None, learning: bool) -> Result:
        """Find the target in the next frame; see `Tracker.update`.

        Parameters
        ----------
        learning : new appearances may be learnt.
        """
        self._depth.look(depth, frame.height, frame.width)
        flow = self._track(frame)
        self._keypoints = None
        reach = min(
            self._parameters.tracking_scales + self._trust.missed // self._parameters.widen_frames,
            self._parameters.scales,
        )
        outline = self._depth.hold(flow.box if flow else self._box) if self._box else None
        detections = self._detector.detect(frame, self._last_box, reach)
        if outline:
            result = self._hold(frame, flow, outline)
        elif flow:
            result = self._fuse(frame, flow, detections)
        else:
            result = self._redetect(frame, detections)
        if result.box is None:
            self._trust.missed += 1
        else:
            self._trust.missed = 0
            self._last_box = result.box
            trusted = self._trust.learnable and not self._depth.occluded(result.box)
            if trusted and learning:
                self._learn(frame, result.box, detections)
            self._depth.follow(result.box, trusted)
        self._frame = frame
        return result

    def change_view(self, frame: Frame, shift: float) -> None:
        """Go on in the images of another camera, parallel to the one so far.

        Parameters
        ----------
        frame : that camera's view of the frame seen last, of the same size.
        shift : by which the target lies further right there [pixel].
        """
        self._frame = frame
        self._keypoints = None
        self._depth.leave_view()
        moved = replace(self.box, x=self.box.x + shift)
        self._box = moved if self.tracking else None
        self._last_box = replace(self._last_box, x=self._last_box.x + shift)

    def _track(self, frame: Frame) -> Flow | None:
        """Follow the box by median flow."""
        box, previous, parameters = self._box, self._frame, self._parameters
        if box is None:
            return None
        if self._memory:
            if self._keypoints is None:
                self._keypoints = self._sift.around(previous, box)
            points = keypoints.flow_points(self._keypoints[0], box, parameters.grid_points)
        else:
            points = keypoints.grid(box, parameters.grid_points)
        flows = follow(previous, frame, box, self._depth.uncovered(points), parameters)
        flow = most_alike(frame, self._detector.model, flows, parameters.motion_margin)
        if flow is None or flow.box.inside_fraction(frame.width, frame.height) <= 0.0:
            return None
        return flow

    def _hold(self, frame: Frame, flow: Flow | None, outline: Box) -> Result:
        """Go on with the target that depth shows to be in its place, whatever it looks like."""
        near = flow is not None and flow.box.overlap(outline) > OUTLINE_OVERLAP
        self._box = blend(flow.box, outline, OUTLINE_SHARE) if near else outline
        self._trust.vouch()
        return Result(self._box, self._similarity(frame, self._box)[0], True, self._trust.valid, "tracker")

    def _fuse(self, frame: Frame, flow: Flow, detections: Detections) -> Result:
        """Decide on the state of the object while there is a tracked box (thesis section 3.1.4)."""
        parameters, trust = self._parameters, self._trust
        box = refine(frame, self._detector, flow, detections, parameters)
        relative, conservative = self._similarity(frame, box)
        sure = max(relative, self._detector.nn_threshold)
        rivals = [
            cluster
            for cluster in self._clusters(detections)
            if cluster.confidence > sure and cluster.box.overlap(flow.box) < parameters.takeover_overlap
        ]
        if len(rivals) == 1:
            return self._take(self._fit(frame, rivals[0].box), rivals[0].confidence)
        if not self._depth.agrees(box):
            self._drop()
            return LOST
        witness = Witness.SILENT
        if self._memory:
            self._keypoints = self._sift.around(frame, box)
            witness = self._memory.ask(*self._keypoints, box, trust.learnable)
        if box.inside_fraction(frame.width, frame.height) < parameters.doubt_inside:
            trust.doubt()
        weak = trust.provisional
        if trust.observe(flow.residual, relative, conservative, self._detector.nn_threshold, witness):
            self._box = box
            return Result(box, relative, True, trust.valid, "tracker")
        if weak or trust.missed >= parameters.grace_frames:
            self._drop()
        else:
            self._box = box
        return LOST

    def _clusters(self, detections: Detections) -> list[Cluster]:
        """Clusters of detections that depth does not speak against."""
        return [c for c in self._detector.clusters(detections) if self._depth.agrees(c.box)]

    def _redetect(self, frame: Frame, detections: Detections) -> Result:
        """Look for the target without a tracked box: exactly one cluster of detections takes over."""
        self._drop()
        clusters = self._clusters(detections)
        if self._memory:
            said = {c: self._ask(frame, c.box) for c in clusters[:MAX_ASKED]}
            sure = [c for c, witness in said.items() if witness is Witness.FOR]
            if len(sure) == 1:
                return self._take(self._fit(frame, sure[0].box), sure[0].confidence)
            if self._memory.mature:
                clusters = [c for c in clusters if said.get(c) is not Witness.AGAINST]
        if len(clusters) == 1:
            return self._go_to(frame, clusters[0])
        if not clusters and self._memory:
            proposal = self._memory.propose(frame, self._last_box, self._trust.missed)
            if proposal is not None and self._depth.agrees(proposal):
                box = self._fit(frame, proposal)
                relative, conservative = self._similarity(frame, box)
                if self._detector.accepts(relative) and conservative > self._parameters.min_conservative:
                    return self._take(box, relative)
        return LOST

    def _ask(self, frame: Frame, box: Box) -> Witness:
        """Return what the keypoints in a box say of it."""
        return self._memory.ask(*self._sift.around(frame, box), box, trusted=False)

    def _fit(self, frame: Frame, box: Box) -> Box:
        """Fit a detected box to the target: windows are a whole scale step apart."""
        return align(frame, self._detector.model, box, DETECTED_STEP)[0]

    def _go_to(self, frame: Frame, cluster: Cluster) -> Result:
        """Follow a cluster of detections from here: at once if it is sure.

        Else the next frame must agree; and it must be of about the target's size, where that can have got to.
        """
        if cluster.confidence > self._detector.nn_threshold:
            return self._take(self._fit(frame, cluster.box), cluster.confidence)
        parameters, last = self._parameters, self._last_box
        change = abs(np.log(cluster.box.width / last.width))
        distance = np.hypot(*np.subtract(cluster.box.center, last.center))
        reach = parameters.redetection_reach * np.sqrt(last.area) * (1 + self._trust.missed)
        if change < parameters.tracking_scales * np.log(parameters.scale_step) and distance < reach:
            self._box = self._fit(frame, cluster.box)
            self._trust.restart(provisional=True)
        return LOST

    def _take(self, box: Box, confidence: float) -> Result:
        """Go on from a box that the detector found."""
        self._box = box
        self._trust.restart(provisional=False)
        return Result(box, confidence, True, False, "detector")

    def _drop(self) -> None:
        self._box = None
        self._trust.drop()

    def _similarity(self, frame: Frame, box: Box) -> tuple[float, float]:
        """Relative and conservative similarity of a box."""
        similarity = self._detector.model.similarity(frame.patches(np.array([box.as_tuple()])))
        return float(similarity.relative[0]), float(similarity.conservative[0])

    def _learn(self, frame: Frame, box: Box, detections: Detections) -> None:
        """Train on a trusted frame, unless it shows too little of the target."""
        if box.inside_fraction(frame.width, frame.height) < self._parameters.learning_inside:
            return
        if frame.variance(np.array(box.as_tuple())) < self._detector.min_variance:
            return
        self._learner.update(frame, box, detections)
        if self._memory:
            self._memory.learn(frame, box)
