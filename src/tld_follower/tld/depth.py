# SPDX-License-Identifier: BSD-3-Clause
"""Depth as a feature: the target's physical size and distance, and what contradicts them.

A box with sides of a pixels (root of the area) at depth z shows something of a z / f metres. The focal length
f is constant, so a z tells sizes apart. Stereo measures disparity, d = f B / z: its error is constant in 1/z,
and grows with z^2 in z.
"""

from __future__ import annotations

import numpy as np

from tld_follower.box import Box
from tld_follower.tld.outline import Found, Outline
from tld_follower.tld.parameters import Parameters

# Share of a box's sides, about its centre, that is taken for the target rather than for what surrounds it.
CENTER = 0.6
# The target's front: so small a share of its pixels is nearer, those of wrong matches.
FRONT = 0.1
# A box is measured on a grid of at most about so many pixels along each side; fewer in all tell nothing.
GRID = 48
MIN_PIXELS = 20
# Sizes whose median is the first estimate; a later value moves an estimate by at most this share, which makes
# it a running median.
FIRST_SIZES = 10
STEP = 0.01
# Half the depth that the target may fill, in sides of it: for a camera whose image is as wide as far, which
# is about so for most.
RADIUS = 2.0
# How much farther than that the ground is looked at.
BEYOND = 1.5
# Least overlap of the outline with a trusted box, and for how many such frames in succession until the
# outline alone says where the target is.
HOLD_OVERLAP = 0.5
HOLD_FRAMES = 3


class TargetDepth:
    """What depth says about one target. Where there is no depth it says nothing against any box.

    Parameters
    ----------
    parameters : those named `depth_...`.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._depth: np.ndarray | None = None
        self._before: np.ndarray | None = None
        self._sizes: list[float] = []
        self._size: float | None = None
        self._distance: float | None = None
        self._relief: float | None = None
        self._age = 0
        self._outline = Outline(parameters.depth_error)
        self._box: Box | None = None
        self._held = 0

    @property
    def size(self) -> float | None:
        """Side of the target times its depth [pixel m]; None until it was seen often enough."""
        return self._size

    @property
    def relief(self) -> float | None:
        """Depth of the target's front over its own; None until it was seen."""
        return self._relief

    def restore(self, size: float | None, relief: float | None) -> None:
        """Take over the `size` and `relief` that were learnt elsewhere."""
        self._size, self._relief = size, relief

    @property
    def distance(self) -> float | None:
        """Depth of the target when it was last measured [m]; None before."""
        return self._distance

    def look(self, depth: np.ndarray | None, height: int, width: int) -> None:
        """Take the depth map of the next frame.

        Parameters
        ----------
        depth : float (height, width), the depth z of each pixel of the image [m]; what is not positive and
            finite is unknown. None: nothing is known of this frame.

        Raises
        ------
        ValueError
            For a map of another kind or size than the image's; the state stays as it was.
        """
        if depth is not None and (depth.shape != (height, width) or depth.dtype.kind != "f"):
            shape = "x".join(map(str, depth.shape[::-1]))
            raise ValueError(f"the depth map is {shape} of {depth.dtype}, the image {width}x{height}")
        self._before, self._depth = self._depth, depth
        self._age += 1
        far = BEYOND * self._fill(self._box, width)[1] if self._distance else np.inf
        self._outline.look(depth, self._box, far)

    def leave_view(self) -> None:
        """Forget the last depth map: the next image is another camera's."""
        self._depth = None

    def agrees(self, box: Box) -> bool:
        """Whether a box may be the target: False if hardly any of its middle lies where the target must be.

        The target must be at the distance that fits the box's size and its own, and where it was last seen or
        as far from there as it may have moved since. One with an outline must stand out from the ground.
        """
        fitting = self._fitting(box)
        return fitting is None or bool(fitting[1].mean() >= self._parameters.depth_support)

    def occluded(self, box: Box) -> bool:
        """Whether something stands before the target: many pixels of the box are nearer than its front."""
        sample = self._sample(box)
        return sample is not None and bool(np.mean(sample[0] < self._nearest) > self._parameters.depth_front)

    def hold(self, box: Box) -> Box | None:
        """Find the target by its place alone, where that was sure in the frames before.

        Parameters
        ----------
        box : about where it is [pixel].

        Returns
        -------
        The box of its outline; None where there is none that goes on from the frame before: at the depth and
        of the size that the target can have, with nothing before it.
        """
        if self._held < HOLD_FRAMES:
            return None
        found = self._fit(box)
        if found is None or found.box.overlap(box) < HOLD_OVERLAP:
            self._held = 0
            return None
        self._distance = found.depth
        self._age = 0
        return found.box

    def uncovered(self, points: np.ndarray) -> np.ndarray:
        """Return the points (N, 2) [pixel] that nothing stood before in the frame before this one."""
        if self._before is None:
            return points
        height, width = self._before.shape
        columns = np.clip(points[:, 0].astype(int), 0, width - 1)
        rows = np.clip(points[:, 1].astype(int), 0, height - 1)
        depths = self._before[rows, columns]
        return points[~((depths > 0.0) & (depths < self._nearest))]

    def follow(self, box: Box, trusted: bool) -> None:
        """Take in where the target is.

        Parameters
        ----------
        box : the target [pixel].
        trusted : the box is sure enough to learn the target's size from it, and the target not occluded.
        """
        self._box = box
        if not trusted:
            self._held = 0
        whole, fitting = self._sample(box), self._fitting(box)
        if whole is None or fitting is None or not fitting[1].any():
            self._held = 0
            return
        if self._age:  # the outline did not tell
            self._distance = float(np.median(fitting[0][fitting[1]]))
            self._age = 0
        if trusted:
            relief = float(np.quantile(whole[0], FRONT)) / self._distance
            self._relief = relief if self._relief is None else _stepped(self._relief, relief)
            self._learn_size(np.sqrt(box.area) * self._distance)
            self._follow_outline(box)

    def _follow_outline(self, box: Box) -> None:
        """Learn how the outline lies in a trusted box; then count the frames in which they agree."""
        if not self._outline.known:
            self._outline.learn(self._depth, box, self._fill(box, self._depth.shape[1]), self._distance)
        elif self._held < HOLD_FRAMES:
            found = self._fit(box)
            self._held = self._held + 1 if found and found.box.overlap(box) > HOLD_OVERLAP else 0

    def _fit(self, box: Box) -> Found | None:
        """Return the target's outline about a box."""
        if self._depth is None or not self._outline.known or self._size is None or self._distance is None:
            return None
        found = self._outline.find(self._depth, box, self._fill(box, self._depth.shape[1]))
        if found is None:
            return None
        change = np.sqrt(found.box.area) * found.depth / self._size
        if not 1.0 / self._parameters.depth_size <= change <= self._parameters.depth_size:
            return None
        return None if self.occluded(found.box) or self.occluded(box) else found

    def _fill(self, box: Box, width: int) -> tuple[float, float]:
        """Least and greatest depth [m] of any part of the target in a box in an image of a width."""
        size = self._size or np.sqrt(box.area) * self._distance
        radius = RADIUS * size / width + self._moved
        near = max(self._nearest, self._nearer(self._distance - radius))
        return near, self._farther(self._distance + radius)

    def _fitting(self, box: Box) -> tuple[np.ndarray, np.ndarray] | None:
        """Known depths (N,) [m] in the middle of a box, and which of them may be the target's."""
        sample = self._sample(box.scale(CENTER))
        if sample is None:
            return None
        depths, outstanding = sample
        low, high = self._limits(box)
        fitting = (depths >= low) & (depths <= high)
        return depths, fitting & outstanding if self._outline.known else fitting

    def _learn_size(self, size: float) -> None:
        if self._size is None:
            self._sizes.append(size)
            if len(self._sizes) == FIRST_SIZES:
                self._size = float(np.median(self._sizes))
        else:
            self._size = _stepped(self._size, size)

    def _sample(self, box: Box) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the known depths (N,) [m] on a grid over a box, and which stand out from the ground.

        None where too few pixels have one.
        """
        if self._depth is None:
            return None
        inside = box.clip(self._depth.shape[1], self._depth.shape[0])
        columns, rows = (
            slice(int(start), int(np.ceil(end)), 1 + int((end - start) / GRID))
            for start, end in ((inside.x, inside.right), (inside.y, inside.bottom))
        )
        depths = self._depth[rows, columns]
        known = (depths > 0.0) & (depths < np.inf)
        if np.count_nonzero(known) < max(MIN_PIXELS, self._parameters.depth_valid * depths.size):
            return None
        return depths[known], self._outline.outstanding(depths, columns, rows)[known]

    def _limits(self, box: Box) -> tuple[float, float]:
        """Least and greatest depth [m] that the target may have if it is in a box."""
        low, high = 0.0, np.inf
        if self._distance is not None:
            low, high = self._distance - self._moved, self._distance + self._moved
        if self._size is not None:
            fitting = self._size / np.sqrt(box.area)
            low = max(low, fitting / self._parameters.depth_size)
            high = min(high, fitting * self._parameters.depth_size)
        return self._nearer(low), self._farther(high)

    @property
    def _moved(self) -> float:
        """Most that the target's distance can have changed since it was last measured [m]."""
        return self._age * self._parameters.depth_motion

    @property
    def _nearest(self) -> float:
        """What is nearer than this is not the target but stands before it [m]."""
        if self._relief is None or self._distance is None:
            return 0.0
        return self._nearer(self._relief * self._distance - self._moved)

    def _nearer(self, depth: float) -> float:
        """Return what stereo may measure at least where the depth is so much [m]."""
        return 1.0 / (1.0 / depth + self._parameters.depth_error) if depth > 0.0 else 0.0

    def _farther(self, depth: float) -> float:
        """Return what stereo may measure at most where the depth is so much [m]."""
        inverse = 1.0 / depth - self._parameters.depth_error
        return 1.0 / inverse if inverse > 0.0 else np.inf


def _stepped(estimate: float, value: float) -> float:
    """Return an estimate moved towards a value by at most STEP of itself."""
    return estimate * float(np.clip(value / estimate, 1.0 / (1.0 + STEP), 1.0 + STEP))
