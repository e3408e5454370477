# SPDX-License-Identifier: BSD-3-Clause
"""The wider view: a second, parallel camera takes over while it shows more of the target than the first.

Both images are rectified: a point at depth z is d = f B / z pixels further left in the right image, in the
same row. So the right camera sees what has just left the left image at its right side, a strip of d pixels;
the further the cameras are apart, and the nearer the target, the wider it is.

One tracker, with one model, works in one of the two images at a time.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from enum import IntEnum

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld.frame import to_gray
from tld_follower.tld.target import Result
from tld_follower.tld.tracker import Tracker

# Share of the target's area that the right image must show beyond the left one's to take over.
MARGIN = 0.02
# The part of a box, about its centre, that is compared between both images, and how much of it must be seen.
CENTER = 0.8
LEAST_SEEN = 0.7
# That part is compared on an octave where its side (root of the area) is smaller than this [pixel].
MATCH_SIDE = 64.0
# Largest disparity searched for, in sides of the target: one of half the baseline's size.
MAX_RATIO = 2.0
# Once it is known it is searched for within this share of it and so many pixels of the octave to either side.
SEARCH, SLACK = 0.2, 3.0
# Least NCC of the same target in both images.
MIN_SIMILARITY = 0.7
# Measurements whose median is taken, and how many are enough.
MEMORY, ENOUGH = 15, 3


class View(IntEnum):
    """The camera in whose image the target is looked for."""

    LEFT = 0
    RIGHT = 1


class Parallax:
    """The disparity of one target, measured while both cameras see it.

    It goes with 1 / z as the target's size in the image does: their ratio, baseline over size, is a constant
    of the target that survives any change of distance.
    """

    def __init__(self) -> None:
        self._ratios: deque[float] = deque(maxlen=MEMORY)
        self._missed = 0

    @property
    def known(self) -> bool:
        """True once the disparity was measured often enough."""
        return len(self._ratios) >= ENOUGH

    def of(self, box: Box) -> float:
        """Disparity of a target in a box [pixel]; 0 while nothing is known."""
        return float(np.median(self._ratios)) * float(np.sqrt(box.area)) if self.known else 0.0

    def measure(self, view: View, images: tuple[np.ndarray, np.ndarray], box: Box) -> None:
        """Find the target of one image in the other.

        Parameters
        ----------
        view : the image that the box belongs to.
        images : left and right, uint8 (H, W).
        box : the target [pixel].
        """
        side = float(np.sqrt(box.area))
        low, high = 0.0, MAX_RATIO * side
        if self.known:
            disparity = self.of(box)
            low, high = (1.0 - SEARCH) * disparity, (1.0 + SEARCH) * disparity
        # From the left image to the right one a target moves to the left.
        sign = -1.0 if view is View.LEFT else 1.0
        found = row_match(
            images[view], images[1 - view], box.scale(CENTER), sorted((sign * low, sign * high))
        )
        if found is not None and 0.0 <= sign * found <= MAX_RATIO * side:
            self._ratios.append(sign * found / side)
            self._missed = 0
        elif self._in_both(images, box, sign):
            self._missed += 1
            if self._missed > MEMORY:  # what is known must be wrong
                self._ratios.clear()

    def _in_both(self, images: tuple[np.ndarray, np.ndarray], box: Box, sign: float) -> bool:
        """Whether the whole target is seen by both cameras, if what is known of it is right."""
        height, width = images[View.LEFT].shape
        other = _shifted(box, sign * self.of(box))
        return min(box.inside_fraction(width, height), other.inside_fraction(width, height)) == 1.0


def row_match(image: np.ndarray, other: np.ndarray, box: Box, limits: list[float]) -> float | None:
    """Find what a box shows in the same rows of another image, by NCC, to a fraction of a pixel.

    Parameters
    ----------
    image, other : uint8 (H, W)
    box : in `image` [pixel]; only its part inside counts.
    limits : least and greatest shift along x [pixel].

    Returns
    -------
    The shift [pixel]; None where too little of the box is seen in `image`, or nothing in `other` is like it.
    """
    height, width = image.shape
    part = box.clip(width, height)
    if part.area < LEAST_SEEN * box.area:
        return None
    factor = 1 << max(0, int(np.ceil(np.log2(np.sqrt(part.area) / MATCH_SIDE))))
    reach = SLACK * factor
    x0, y0 = int(np.ceil(part.x)), int(np.ceil(part.y))
    columns = int(part.right - x0) // factor
    rows = int(part.bottom - y0) // factor
    first = max(0, int(np.floor(x0 + limits[0] - reach)))
    last = min(width, int(np.ceil(x0 + columns * factor + limits[1] + reach)))
    if min(columns, rows) < 4 or last - first < columns * factor:
        return None
    # One row of the octave above and below: no rectification is perfect.
    top, bottom = max(0, y0 - factor), min(height, y0 + (rows + 1) * factor)
    template = _shrunk(image[y0 : y0 + rows * factor, x0 : x0 + columns * factor], factor)
    strip = _shrunk(other[top:bottom, first:last], factor)
    if template.std() < 1.0 or strip.shape[0] < rows:
        return None
    scores = cv2.matchTemplate(strip, template, cv2.TM_CCOEFF_NORMED).max(axis=0)
    best = int(np.argmax(scores))
    # A maximum at the end of the search is none.
    if not (MIN_SIMILARITY <= scores[best] <= 1.01) or best in (0, len(scores) - 1):
        return None
    before, middle, after = map(float, scores[best - 1 : best + 2])
    curvature = before - 2.0 * middle + after
    offset = 0.5 * (before - after) / curvature if curvature < 0.0 else 0.0
    return first + (best + offset) * factor - x0


def _shrunk(image: np.ndarray, factor: int) -> np.ndarray:
    """Return means of factor x factor pixels; what does not fill one is left out."""
    rows, columns = image.shape[0] // factor, image.shape[1] // factor
    whole = image[: rows * factor, : columns * factor]
    return cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)


class StereoTracker:
    """Follows one target through the frames of two rectified cameras; boxes are in the left image's pixels.

    A box may lie partly or wholly to the right of the left image, where only the right camera sees it.
    Without right images it does what `tracker` alone does.

    Parameters
    ----------
    tracker : finds the target in one image; used by nobody else meanwhile.
    """

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self.forget()

    @property
    def view(self) -> View:
        """The camera in whose image the target was looked for last."""
        return self._view

    def forget(self) -> None:
        """Forget images and disparity, as the tracker has another target now."""
        self._view = View.LEFT
        self._parallax = Parallax()
        self._images: tuple[np.ndarray | None, np.ndarray | None] = (None, None)

    def init(
        self, left: np.ndarray, box: Box, depth: np.ndarray | None = None, right: np.ndarray | None = None
    ) -> None:
        """Take a new target, in the left image.

        Parameters
        ----------
        left, box, depth : see `Tracker.init`.
        right : of the same moment and size; None if there is none.

        Raises
        ------
        ValueError
            See `Tracker.init`; also for a right image of another size. The state stays as it was.
        """
        images = _grays(left, right)
        self._tracker.init(left, box, depth)
        self.forget()
        self._images = images
        self._measure(box)

    def update(
        self, left: np.ndarray, depth: np.ndarray | None = None, right: np.ndarray | None = None
    ) -> Result:
        """Find the target in the next pair of images.

        Parameters
        ----------
        left, depth : see `Tracker.update`.
        right : of the same moment and size; None if there is none.

        Raises
        ------
        RuntimeError, ValueError
            See `Tracker.update`; ValueError also for a right image of another size.
        """
        images = _grays(left, right)
        view = self._next_view(images)
        if view is not self._view:
            shift = self._parallax.of(self._tracker.box)
            self._tracker.change_view(self._images[view], -shift if view is View.RIGHT else shift)
            self._view = view
        result = self._tracker.update(images[view], depth if view is View.LEFT else None)
        self._images = images
        if result.box is None:
            return result
        if result.valid:
            self._measure(result.box)
        return result if view is View.LEFT else replace(result, box=self._in_left(result.box))

    def _next_view(self, images: tuple[np.ndarray, np.ndarray | None]) -> View:
        """Return the camera that shows more of the target; while it is lost the cameras take turns."""
        if images[View.RIGHT] is None or self._images[View.RIGHT] is None or not self._parallax.known:
            return View.LEFT
        if not self._tracker.tracking:
            return View(1 - self._view)
        height, width = images[View.LEFT].shape
        in_left = self._in_left(self._tracker.box)
        in_right = _shifted(in_left, -self._parallax.of(in_left))
        left, right = (box.inside_fraction(width, height) for box in (in_left, in_right))
        if self._view is View.LEFT:
            return View.RIGHT if right > left + MARGIN else View.LEFT
        return View.LEFT if left >= right else View.RIGHT

    def _in_left(self, box: Box) -> Box:
        """Return a box of the present view in the left image's pixels."""
        return box if self._view is View.LEFT else _shifted(box, self._parallax.of(box))

    def _measure(self, box: Box) -> None:
        if self._images[View.RIGHT] is not None:
            self._parallax.measure(self._view, self._images, box)


def _shifted(box: Box, shift: float) -> Box:
    return replace(box, x=box.x + shift)


def _grays(left: np.ndarray, right: np.ndarray | None) -> tuple[np.ndarray, np.ndarray | None]:
    """Return grey copies of both images; ValueError if their sizes differ."""
    if right is None:
        return to_gray(left), None
    images = to_gray(left), to_gray(right)
    sizes = [f"{image.shape[1]}x{image.shape[0]}" for image in images]
    if sizes[0] != sizes[1]:
        raise ValueError(f"the left image is {sizes[0]}, the right one {sizes[1]}")
    return images
