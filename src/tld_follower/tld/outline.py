# SPDX-License-Identifier: BSD-3-Clause
"""The target's outline in depth: the thing that stands out from the ground where the target must be.

A plane in space is one in image and inverse depth as well: 1/z = a u + b v + c, whatever the focal length. So
ground and walls are found, and things before them told from them, without knowing the camera.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from tld_follower.box import Box

# The image's grid on which the plane is sought: columns, rows; and how many known points it wants.
PLANE_GRID = (40, 30)
PLANE_POINTS = 20
# Triples of points tried for it each frame, beside the plane of the frame before; least squares after that.
TRIPLES = 40
# Least area of a triple [half of the image].
LEAST_TRIANGLE = 1e-3
ROUNDS = 2
# Least share of the known points that lie on the plane.
PLANE_SHARE = 0.3
# The window searched for the outline [sides of the box], and about the most points along its longer side.
WINDOW = 1.6
GRID = 96
# Share of a box's sides, about its centre, with which the thing must be connected.
MIDDLE = 0.6
# Fewest points of a thing.
LEAST = 20
# Which way is inwards from a left, top, right and bottom side.
INWARDS = np.array([1, 1, -1, -1])
# Most of the image's columns and rows at a border in which a stereo matcher knows nothing.
BLIND = (0.25, 0.06)
# About a box, what is left out of the plane [sides of the box].
AROUND = 1.1
# The first trusted boxes say how the outline lies in them, if in so many of them it overlaps them by so much.
FIRST, FIRST_MATCHES, FIRST_OVERLAP = 10, 6, 0.5


class Plane:
    """The plane behind everything near, followed from frame to frame.

    Parameters
    ----------
    tolerance : by which the inverse depth of a point may be off it [1/m].

    Attributes
    ----------
    coefficients : a, b, c of 1/z = a u + b v + c; None without a plane.
    clear : False if there is something else than the target and it lies on no plane.
    """

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self._rng = np.random.default_rng(0)
        self.coefficients: np.ndarray | None = None
        self.clear = False

    def fit(self, depth: np.ndarray, target: Box | None, far: float) -> None:
        """Find the plane of a frame; none where there are few points, or they lie on none.

        It is fitted to what is near and about the target. Nothing lies behind it: points there, the target's
        and far ones as well, count against a plane as those on it count for it.

        Parameters
        ----------
        depth : float (H, W) [m]; what is not positive and finite is unknown.
        target : box whose points are not fitted [pixel]; None for none.
        far : greatest depth of the points that are [m].
        """
        before, self.coefficients = self.coefficients, None
        height, width = depth.shape
        columns = ((np.arange(PLANE_GRID[0]) + 0.5) * width / PLANE_GRID[0]).astype(int)
        rows = ((np.arange(PLANE_GRID[1]) + 0.5) * height / PLANE_GRID[1]).astype(int)
        sampled = depth[rows[:, None], columns].ravel()
        u, v = (axis.ravel() for axis in np.meshgrid(columns, rows))
        outside = np.ones(len(sampled), bool)
        if target:
            outside = (u < target.x) | (u > target.right) | (v < target.y) | (v > target.bottom)
        known = (sampled > 0.0) & (sampled < np.inf)
        fitted = (outside & (sampled < far))[known]
        number = np.count_nonzero(fitted)
        self.clear = number < PLANE_POINTS and np.count_nonzero(outside) > PLANE_SHARE * len(outside)
        if number < PLANE_POINTS:
            return
        points = np.stack([u[known], v[known], np.ones(len(fitted))], axis=1)
        inverse = 1.0 / sampled[known].astype(np.float64)
        chosen = self._rng.choice(np.flatnonzero(fitted), (TRIPLES, 3))
        fair = np.abs(np.linalg.det(points[chosen])) > LEAST_TRIANGLE * width * height
        planes = np.linalg.solve(points[chosen[fair]], inverse[chosen[fair]][..., None])[..., 0]
        if before is not None:
            planes = np.concatenate([before[None], planes])
        if not len(planes):
            return
        off = inverse - planes @ points.T
        behind = np.count_nonzero(off < -2.0 * self._tolerance, axis=1)
        score = np.count_nonzero(np.abs(off[:, fitted]) < self._tolerance, axis=1) - behind
        best = int(np.argmax(score))
        if score[best] < PLANE_SHARE * number:
            return
        plane = planes[best]
        for _ in range(ROUNDS):
            on = fitted & (np.abs(inverse - points @ plane) < self._tolerance)
            plane = np.linalg.lstsq(points[on], inverse[on], rcond=None)[0]
        self.coefficients, self.clear = plane, True

    def inverse_at(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray | float:
        """Inverse depth [1/m] of the plane on a grid (rows, columns); minus infinity without a plane."""
        if self.coefficients is None:
            return -np.inf
        a, b, c = self.coefficients
        return a * columns + b * rows[:, None] + c


@dataclass(frozen=True)
class Found:
    """What stands out.

    Attributes
    ----------
    box : about it [pixel].
    depth : median of its points [m].
    open : bool (4,), which of the box's left, top, right and bottom may lie farther out: where depth ends, at
        the image's border or where the matcher has no room.
    """

    box: Box
    depth: float
    open: np.ndarray


class Outline:
    """How the box of one target lies about what stands out there, and where it is by that.

    Stereo widens things by its matching windows, what is low over the ground is lost, and users draw boxes as
    they like. So the sides' margins [pixel m] are learnt from the first boxes. Where those do not fit what
    stands out, as with a part of a thing or with one that is flat, the target has no outline.

    Parameters
    ----------
    tolerance : of inverse depth [1/m].
    """

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self._plane = Plane(tolerance)
        self._area = np.zeros(4)
        self._tries = 0
        self._samples: list[np.ndarray] = []
        self._margins: np.ndarray | None = None

    @property
    def known(self) -> bool:
        """True if the target has an outline, and its margins are known."""
        return self._margins is not None

    def look(self, depth: np.ndarray | None, target: Box | None, far: float) -> None:
        """Find the plane behind everything in the next frame.

        Parameters
        ----------
        depth : float (H, W) [m], see `Plane.fit`; None if there is none.
        target : where the target was [pixel]; None before it was seen.
        far : greatest depth of the ground about it that matters [m].
        """
        if depth is None or (self._tries >= FIRST and not self.known):
            self._plane = Plane(self._tolerance)
        else:
            self._plane.fit(depth, target and target.scale(AROUND), far)
            self._area = _known_area(depth)

    def outstanding(self, depth: np.ndarray, columns: slice, rows: slice) -> np.ndarray:
        """Which points of a part of the image stand out from the plane, bool (rows, columns).

        Parameters
        ----------
        depth : of the part, float (rows, columns) [m].
        columns, rows : where it is in the image, with start, stop and step.
        """
        behind = self._plane.inverse_at(
            np.arange(columns.start, columns.stop, columns.step), np.arange(rows.start, rows.stop, rows.step)
        )
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return 1.0 / depth - behind > self._tolerance

    def learn(self, depth: np.ndarray, box: Box, limits: tuple[float, float], distance: float) -> None:
        """Take a trusted box as it should be.

        Parameters
        ----------
        depth, box, limits : see `find`.
        distance : depth of the target [m].
        """
        if self._tries >= FIRST or box.inside_fraction(*depth.shape[::-1]) < 1.0:
            return
        self._tries += 1
        found = self._search(depth, box, limits)
        if found and not found.open.any() and found.box.overlap(box) > FIRST_OVERLAP:
            self._samples.append((_sides(box) - _sides(found.box)) * distance)
        if self._tries == FIRST and len(self._samples) >= FIRST_MATCHES:
            self._margins = np.median(self._samples, axis=0)

    def find(self, depth: np.ndarray, box: Box, limits: tuple[float, float]) -> Found | None:
        """Find the target about a box; None if nothing stands out there or it goes on beyond the window.

        Parameters
        ----------
        depth : float (H, W) [m].
        box : about where the target is [pixel].
        limits : least and greatest depth of any part of it [m].
        """
        found = self._search(depth, box, limits)
        if found is None:
            return None
        sides = _sides(found.box) + self._margins / found.depth
        outer = np.concatenate([np.minimum(sides, _sides(box))[:2], np.maximum(sides, _sides(box))[2:]])
        left, top, right, bottom = map(float, np.where(found.open, outer, sides))
        if right <= left or bottom <= top:
            return None
        return replace(found, box=Box(left, top, right - left, bottom - top))

    def _search(self, depth: np.ndarray, box: Box, limits: tuple[float, float]) -> Found | None:
        """Find the thing in the middle of a box: connected, within the limits, before the plane."""
        height, width = depth.shape
        window = box.scale(WINDOW).clip(width, height)
        step = 1 + int(max(window.width, window.height) / GRID)
        columns, rows = (
            slice(int(start), int(np.ceil(end)), step)
            for start, end in ((window.x, window.right), (window.y, window.bottom))
        )
        part = depth[rows, columns]
        if not self._plane.clear or min(part.shape) < 3:
            return None
        things = (part >= limits[0]) & (part <= limits[1]) & self.outstanding(part, columns, rows)
        mask = things.astype(np.uint8)
        for operation in (cv2.MORPH_CLOSE, cv2.MORPH_OPEN):
            mask = cv2.morphologyEx(mask, operation, np.ones((3, 3), np.uint8))
        _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
        middle = box.scale(MIDDLE).clip(width, height)
        x0, x1 = (int((x - columns.start) / step) for x in (middle.x, middle.right))
        y0, y1 = (int((y - rows.start) / step) for y in (middle.y, middle.bottom))
        counts = np.bincount(labels[y0 : y1 + 1, x0 : x1 + 1].ravel(), minlength=len(stats))
        counts[0] = 0
        best = int(np.argmax(counts))
        if counts[best] < LEAST:
            return None
        x, y, across, down, _ = (int(value) for value in stats[best])
        ends = np.array([x, y, x + across, y + down])
        whole = np.array([0, 0, part.shape[1], part.shape[0]])
        sides = np.array([columns.start, rows.start] * 2) + ends * step
        open_sides = (sides - self._area) * INWARDS < 2 * step
        if np.count_nonzero((ends == whole) & ~open_sides) > 1:
            return None
        left, top, right, bottom = map(float, sides)
        return Found(
            Box(left, top, min(right, width) - left, min(bottom, height) - top),
            float(np.median(part[(labels == best) & things])),
            open_sides,
        )


def _known_area(depth: np.ndarray) -> np.ndarray:
    """Left, top, right and bottom of the part of an image (H, W) in which depth can be known [pixel].

    A stereo matcher knows none in a strip at the left, as wide as its greatest disparity, and at the borders.
    A broader strip is no such one, but has nothing to match: the sky.
    """
    grid = (depth > 0.0) & (depth < np.inf)
    ends = [
        _known_span(grid[:: 1 + len(grid) // PLANE_GRID[1]].any(axis=0), BLIND[0]),
        _known_span(grid[:, :: 1 + grid.shape[1] // PLANE_GRID[0]].any(axis=1), BLIND[1]),
    ]
    return np.array(ends).T.ravel()


def _known_span(known: np.ndarray, blind: float) -> tuple[int, int]:
    """First and last end of what is known of a line, bool (N,); its own where more than a share is not."""
    number = len(known)
    first, last = int(np.argmax(known)), number - int(np.argmax(known[::-1]))
    return first if first <= blind * number else 0, last if number - last <= blind * number else number


def _sides(box: Box) -> np.ndarray:
    return np.array([box.x, box.y, box.right, box.bottom])
