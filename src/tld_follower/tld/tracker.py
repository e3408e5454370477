# SPDX-License-Identifier: BSD-3-Clause
"""Tracking-Learning-Detection of one object in a video (thesis section 3.1)."""

from __future__ import annotations

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld.depth import TargetDepth
from tld_follower.tld.frame import Frame
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.storage import Model
from tld_follower.tld.target import Result, Target


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
        self._target: Target | None = None
        self.learning = self._parameters.learning

    @property
    def initialised(self) -> bool:
        """True once a target was given."""
        return self._target is not None

    @property
    def tracking(self) -> bool:
        """True while a box is followed from frame to frame, also while it is too doubtful to be shown."""
        return self._target is not None and self._target.tracking

    @property
    def box(self) -> Box:
        """The box that is followed, else the last one [pixel].

        Raises
        ------
        RuntimeError
            Before `init`.
        """
        return self._known.box

    @property
    def templates(self) -> int:
        """Number of templates in the object model."""
        return self._target.templates if self._target else 0

    @property
    def _known(self) -> Target:
        if self._target is None:
            raise RuntimeError("the tracker has no target: call init first")
        return self._target

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
        cv2.setNumThreads(1)
        target = Target(frame, inside, target_depth, parameters, self._seed)
        target.teach()
        self._target = target

    def model(self) -> Model:
        """Everything that was learnt of the target.

        Raises
        ------
        RuntimeError
            Before `init`.
        """
        return self._known.model()

    def restore(self, model: Model) -> None:
        """Take over a target that another tracker learnt; it is lost, and searched for in the whole image.

        Parameters
        ----------
        model : of a tracker with the same `storage.DECISIVE` parameters.
        """
        cv2.setNumThreads(1)
        self._target = Target.restored(model, self._parameters, self._seed)

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
        target = self._known
        frame = Frame(image, self._parameters.blur)
        first = target.frame
        if (frame.width, frame.height) != (first.width, first.height):
            raise ValueError(
                f"the image is {frame.width}x{frame.height}, the target was chosen in "
                f"{first.width}x{first.height}"
            )
        return target.step(frame, depth, self.learning)

    def change_view(self, image: np.ndarray, shift: float) -> None:
        """Go on in the images of another camera, parallel to the one so far.

        Parameters
        ----------
        image : that camera's view of the frame seen last, of the same size.
        shift : by which the target lies further right there [pixel].
        """
        self._known.change_view(Frame(image, self._parameters.blur), shift)


def warm_up() -> None:
    """Compile every kernel on a small synthetic video, so that the first real frame is not late."""
    rng = np.random.default_rng(0)
    image = cv2.GaussianBlur(rng.integers(0, 256, (96, 128), np.uint8), (0, 0), 1.5)
    tracker = Tracker()
    tracker.init(image, Box(40.0, 30.0, 32.0, 28.0))
    for shift in range(1, 4):
        tracker.update(np.roll(image, shift, axis=1))
