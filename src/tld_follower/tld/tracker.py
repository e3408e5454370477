# SPDX-License-Identifier: BSD-3-Clause
"""Tracking-Learning-Detection: the state of one object (thesis section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld import keypoints, median_flow
from tld_follower.tld.alignment import align, blend
from tld_follower.tld.depth import TargetDepth
from tld_follower.tld.detector import Cluster, Detections, Detector, overlaps
from tld_follower.tld.frame import Frame
from tld_follower.tld.learning import Learner
from tld_follower.tld.median_flow import Flow
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.redetection import SiftMemory, Witness
from tld_follower.tld.storage import Model
from tld_follower.tld.trust import Trust


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


# Shares of the box inside the image: under the first it is not learnt from, under the second its steady
# points prove little.
LEARNING_INSIDE, SHOWN_INSIDE = 0.9, 0.3
# Clusters of detections whose keypoints are asked for in a frame, which takes a millisecond or two each.
MAX_ASKED = 3
# First step of the search that fits a detected box to the target [share of its sides].
DETECTED_STEP = 0.1
# A second motion must lead to a view that is more alike by this.
FIRST_MARGIN = 0.035
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
        self.learning = self._parameters.learning

    @property
    def initialised(self) -> bool:
        """True once a target was given."""
        return self._frame is not None

    @property
    def tracking(self) -> bool:
        """True while a box is followed from frame to frame, also while it is too doubtful to be shown."""
        return self.initialised and self._box is not None

    @property
    def box(self) -> Box:
        """The box that is followed, else the last one [pixel]."""
        return self._box or self._last_box

    @property
    def templates(self) -> int:
        """Number of templates in the object model."""
        return len(self._detector.model) if self.initialised else 0

    def init(self, image: np.ndarray, box: Box, depth: np.ndarray | None = None) -> None:
        """Take a new target; what was known of another is forgotten.

        Parameters
        ----------
        image : uint8 or uint16, (H, W) or (H, W, 3) BGR; see `frame.to_gray`.
        box : the target [pixel]; a part outside the image is cut off.
        depth : float (H, W), the depth of each pixel [m], NaN where unknown; see `TargetDepth.look`.

        Raises
        ------
        ValueError
            For an image or a depth map of another kind, a box that is not finite, outside the image or under
            `min_side`. The state stays as it was.
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
        target_depth = TargetDepth(parameters)
        target_depth.look(depth, frame.height, frame.width)
        target_depth.follow(inside, trusted=True)
        self._begin(frame, inside, target_depth)
        self._learner.initialise(frame, inside)
        if self._memory:
            self._memory.learn(frame, inside)

    def _begin(self, frame: Frame, box: Box, depth: TargetDepth) -> None:
        """Set up everything for a target of which nothing is learnt yet."""
        parameters = self._parameters
        cv2.setNumThreads(1)
        self._rng = np.random.default_rng(self._seed)
        self._detector = Detector(frame, box, parameters, self._rng)
        self._learner = Learner(self._detector, parameters, self._rng)
        self._depth = depth
        self._memory: SiftMemory | None = None
        if parameters.tracker == "tld_sift":
            self._sift = keypoints.SiftKeypoints(parameters.sift_keypoints, parameters.sift_side)
            self._memory = SiftMemory(
                self._sift, parameters.sift_views, parameters.sift_interval, parameters.sift_pixels
            )
        self._frame = frame
        self._box: Box | None = box
        self._first_box = self._last_box = box
        # Of the frame seen last, about the box: (N, 2) and (N, 128).
        self._keypoints: tuple[np.ndarray, np.ndarray] | None = None
        self._trust = Trust(parameters)

    def model(self) -> Model:
        """Everything that was learnt of the target.

        Raises
        ------
        RuntimeError
            Before `init`.
        """
        if self._frame is None:
            raise RuntimeError("the tracker has no target: call init first")
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

    def restore(self, model: Model) -> None:
        """Take over a target that another tracker learnt; it is lost, and searched for in the whole image.

        Parameters
        ----------
        model : of a tracker with the same `storage.DECISIVE` parameters.
        """
        depth = TargetDepth(self._parameters)
        depth.restore(model.depth_size, model.depth_relief)
        width, height = model.image
        blank = Frame(np.zeros((height, width), np.uint8), self._parameters.blur)
        self._begin(blank, model.target, depth)
        self._rng.bit_generator.state = model.random
        self._detector.restore(model)
        if self._memory:
            ends = np.cumsum(model.view_lengths)
            parts = (np.split(array, ends)[:-1] for array in (model.view_points, model.view_descriptors))
            self._memory.restore(model.sift_calls, model.sift_expected, list(zip(*parts, strict=True)))
        self._last_box = model.last
        self._drop()
        self._trust.missed = self._parameters.scales * self._parameters.widen_frames

    def update(self, image: np.ndarray, depth: np.ndarray | None = None) -> Result:
        """Find the target in the next frame.

        Parameters
        ----------
        image : of the first one's size; it and `depth` as for `init`.

        Raises
        ------
        RuntimeError
            Before `init`.
        ValueError
            For an image or a depth map of another kind or size than the first; the state stays as it was.
        """
        if self._frame is None:
            raise RuntimeError("the tracker has no target: call init first")
        frame = Frame(image, self._parameters.blur)
        if (frame.width, frame.height) != (self._frame.width, self._frame.height):
            raise ValueError(
                f"the image is {frame.width}x{frame.height}, the target was chosen in "
                f"{self._frame.width}x{self._frame.height}"
            )
        self._depth.look(depth, frame.height, frame.width)
        flow = self._track(frame)
        self._keypoints = None
        reach = min(
            self._parameters.tracking_scales + self._trust.missed // self._parameters.widen_frames,
            self._parameters.scales,
        )
        detections = self._detector.detect(frame, self._last_box, reach)
        result = self._redetect(frame, detections) if flow is None else self._fuse(frame, flow, detections)
        if result.box is None:
            self._trust.missed += 1
        else:
            self._trust.missed = 0
            self._last_box = result.box
            trusted = self.learning and self._trust.learnable and not self._depth.occluded(result.box)
            if trusted:
                self._learn(frame, result.box, detections)
            self._depth.follow(result.box, trusted)
        self._frame = frame
        return result

    def change_view(self, image: np.ndarray, shift: float) -> None:
        """Go on in the images of another camera, parallel to the one so far.

        Parameters
        ----------
        image : that camera's view of the frame seen last, of the same size.
        shift : by which the target lies further right there [pixel].
        """
        self._frame = Frame(image, self._parameters.blur)
        self._keypoints = None
        self._depth.leave_view()
        moved = replace(self.box, x=self.box.x + shift)
        self._box = moved if self.tracking else None
        self._last_box = replace(self._last_box, x=self._last_box.x + shift)

    def _track(self, frame: Frame) -> Flow | None:
        """Follow the box by median flow; where that fails, once more from where it is seen again."""
        box, previous = self._box, self._frame
        if box is None:
            return None
        side = self._parameters.grid_points
        if self._memory:
            if self._keypoints is None:
                self._keypoints = self._sift.around(previous, box)
            points = keypoints.flow_points(self._keypoints[0], box, side)
        else:
            points = keypoints.grid(box, side)
        points = self._depth.uncovered(points)
        flows = median_flow.track(previous, frame, box, points, self._parameters)
        if not flows or flows[0].residual > self._parameters.max_residual:
            guess = median_flow.search(previous, frame, box)
            again = median_flow.track(previous, frame, box, points, self._parameters, guess)
            if again and (not flows or again[0].residual < flows[0].residual):
                flows = again
        flow = self._most_alike(frame, flows)
        if flow is None or flow.box.inside_fraction(frame.width, frame.height) <= 0.0:
            return None
        return flow

    def _most_alike(self, frame: Frame, flows: list[Flow]) -> Flow | None:
        """Choose between motions by the look of where they lead; the first one has the benefit of doubt."""
        if len(flows) < 2:
            return flows[0] if flows else None
        boxes = np.array([flow.box.as_tuple() for flow in flows])
        similarity = self._detector.model.positive_similarity(frame.patches(boxes))
        similarity[0] += FIRST_MARGIN
        return flows[int(np.argmax(similarity))]

    def _fuse(self, frame: Frame, flow: Flow, detections: Detections) -> Result:
        """Decide on the state of the object while there is a tracked box (thesis section 3.1.4)."""
        parameters, trust = self._parameters, self._trust
        box = self._refine(frame, flow, detections)
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
        if box.inside_fraction(frame.width, frame.height) < SHOWN_INSIDE:
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
                if (
                    relative > self._detector.nn_threshold - self._parameters.redetection_margin
                    and conservative > self._parameters.min_conservative
                ):
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

    def _refine(self, frame: Frame, flow: Flow, detections: Detections) -> Box:
        """Correct the tracked box by the detections that agree with it, then by the model itself.

        The box's centre weighs `fusion_weight`, that of each detection 1 (Kalal 2012). Its size stays: the
        windows' sizes are a whole scale step apart and would pull it down step by step. The model corrects it
        the less the better the flow held together: then the tracker is the more precise of the two.
        """
        parameters = self._parameters
        tracked = np.array(flow.box.as_tuple())
        near = overlaps(detections.boxes, tracked) > parameters.fusion_overlap
        near &= detections.similarity.relative > self._detector.nn_threshold
        centers = detections.boxes[near, :2] + 0.5 * detections.boxes[near, 2:]
        total = parameters.fusion_weight * np.array(flow.box.center) + centers.sum(axis=0)
        center = total / (parameters.fusion_weight + np.count_nonzero(near))
        box = Box.from_center(*map(float, center), flow.box.width, flow.box.height)
        aligned, similarity = align(frame, self._detector.model, box, parameters.align_step)
        if similarity < parameters.align_similarity:
            return box
        return blend(box, aligned, parameters.align_gain * min(1.0, flow.residual / parameters.max_residual))

    def _learn(self, frame: Frame, box: Box, detections: Detections) -> None:
        """Train on a trusted frame, unless it shows too little of the target."""
        if box.inside_fraction(frame.width, frame.height) < LEARNING_INSIDE:
            return
        if frame.variance(np.array(box.as_tuple())) < self._detector.min_variance:
            return
        self._learner.update(frame, box, detections)
        if self._memory:
            self._memory.learn(frame, box)


def warm_up() -> None:
    """Compile every kernel on a small synthetic video, so that the first real frame is not late."""
    rng = np.random.default_rng(0)
    image = cv2.GaussianBlur(rng.integers(0, 256, (96, 128), np.uint8), (0, 0), 1.5)
    tracker = Tracker()
    tracker.init(image, Box(40.0, 30.0, 32.0, 28.0))
    for shift in range(1, 4):
        tracker.update(np.roll(image, shift, axis=1))
