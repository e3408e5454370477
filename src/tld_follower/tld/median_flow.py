# SPDX-License-Identifier: BSD-3-Clause
"""Frame-to-frame tracking: median flow with forward-backward and NCC errors (thesis section 3.1.1)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit

from tld_follower.box import Box
from tld_follower.tld.frame import Frame
from tld_follower.tld.parameters import Parameters

LK_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.03)
# Dark targets have small gradients; the forward-backward error judges the points, not their contrast.
LK_MIN_EIGENVALUE = 1e-6
MIN_POINTS = 4
# The background's motion is known from at least so many points that came back to within a pixel.
MIN_BACKGROUND = 8
MAX_BACKGROUND_ERROR = 1.0
# Where the flow fails the target is searched for on an octave where its side is this up to twice it [pixel],
# and within so many sides.
SEARCH_SIDE, SEARCH_REACH = 16.0, 2.0
# Motion apart from it differs by this share of the target's side, for between these shares of the points.
MIN_APART = 0.02
MIN_SHARE, MAX_SHARE = 0.15, 0.9


@dataclass(frozen=True)
class Flow:
    """What median flow found.

    Attributes
    ----------
    box : the moved and scaled box [pixel].
    error : median forward-backward error over the side of the box (sqrt of its area).
    residual : median distance of the points from the motion found, over the same side; large at occlusion.
    """

    box: Box
    error: float
    residual: float


@dataclass(frozen=True)
class Points:
    """Points followed forward and back, (N, 2) float32 each [pixel of the crops]."""

    start: np.ndarray
    end: np.ndarray
    back: np.ndarray

    def __len__(self) -> int:
        return len(self.start)

    def __getitem__(self, chosen: np.ndarray) -> Points:
        return Points(self.start[chosen], self.end[chosen], self.back[chosen])

    @property
    def error(self) -> np.ndarray:
        """Forward-backward error of each (eq. 3.2) [pixel]."""
        return np.hypot(*(self.start - self.back).T)

    @property
    def motion(self) -> np.ndarray:
        """Displacement of each [pixel]."""
        return self.end - self.start


def track(
    previous: Frame,
    current: Frame,
    box: Box,
    points: np.ndarray,
    parameters: Parameters,
    guess: tuple[float, float] = (0.0, 0.0),
) -> list[Flow]:
    """Move a box from one frame to the next.

    Points go forward and back by pyramidal Lucas-Kanade; those with a forward-backward error (eq. 3.2) above
    the median or an NCC (eq. 3.3) under the median are dropped. The box moves by the median displacement and
    scales by the median ratio of the distances between pairs of points.

    A box also holds some of what is behind the target. Where a part of its points moves otherwise than the
    surroundings of the box, the motion of these alone is a second answer.

    Parameters
    ----------
    box : the target in `previous` [pixel].
    points : (N, 2) float32 in `previous` [pixel].
    guess : displacement to start the search from [pixel].

    Returns
    -------
    The motion of all points, then that of those which leave the background behind; each is missing where too
    few points were found or their median error exceeds `max_fb_error`.
    """
    if len(points) < MIN_POINTS:
        return []
    side = np.sqrt(box.area)
    # A large target is tracked on a smaller octave: the same points, a wider reach, bounded cost.
    octave = max(0, int(np.floor(np.log2(side / parameters.flow_side))))
    before, after, factor, origin = _crops(previous, current, box, octave, parameters, guess)
    both = np.concatenate([np.asarray(points, np.float32), surroundings(box)])
    start = both / factor - origin - np.float32(0.5)
    inner = np.arange(len(start)) < len(points)
    found, good = _follow(before, after, start, np.array(guess, np.float32) / factor, parameters)
    own, around = found[good & inner], found[good & ~inner]

    def solve(chosen: Points) -> Flow | None:
        return _motion(before, after, chosen, box, factor, parameters)

    apart = _apart(own, around[around.error < MAX_BACKGROUND_ERROR], MIN_APART * side / factor)
    answers = [solve(own), solve(own[apart]) if apart.any() else None]
    return [flow for flow in answers if flow is not None]


def search(previous: Frame, current: Frame, box: Box) -> tuple[float, float]:
    """Find about where the target went by the NCC of its picture, further than the flow can reach.

    Returns
    -------
    displacement [pixel], a multiple of the pixel of the octave searched; 0 where there is nothing to compare.
    """
    octave = max(0, int(np.floor(np.log2(np.sqrt(box.area) / SEARCH_SIDE))))
    before, after = previous.level(octave).gray, current.level(octave).gray
    factor = round(previous.height / before.shape[0])
    height, width = before.shape
    inside = Box(*(v / factor for v in box.as_tuple())).clip(width, height)
    x0, y0, x1, y1 = (round(v) for v in (inside.x, inside.y, inside.right, inside.bottom))
    template = before[y0:y1, x0:x1]
    if min(template.shape) < 4 or template.std() < 1.0:
        return 0.0, 0.0
    reach = round(SEARCH_REACH * np.sqrt(box.area) / factor)
    left, top = max(0, x0 - reach), max(0, y0 - reach)
    area = after[top : y1 + reach, left : x1 + reach]
    scores = cv2.matchTemplate(area, template, cv2.TM_CCOEFF_NORMED)
    y, x = np.unravel_index(int(np.argmax(scores)), scores.shape)
    return float(left + x - x0) * factor, float(top + y - y0) * factor


def surroundings(box: Box) -> np.ndarray:
    """Return points on a grid over twice the sides of a box, those on it and near it left out (N, 2) float32.

    [pixel]
    """
    steps = np.linspace(-0.4, 1.4, 9)
    x, y = (axis.ravel() for axis in np.meshgrid(steps, steps))
    outside = np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) > 0.6
    places = np.stack([box.x + x * box.width, box.y + y * box.height], axis=1)
    return places[outside].astype(np.float32)


def _follow(
    before: np.ndarray, after: np.ndarray, start: np.ndarray, shift: np.ndarray, parameters: Parameters
) -> tuple[Points, np.ndarray]:
    """Follow points (N, 2) forward and back; returns them all and which were found, (N,) bool."""
    options = {
        "winSize": (parameters.lk_window, parameters.lk_window),
        "maxLevel": parameters.lk_levels,
        "criteria": LK_CRITERIA,
        "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
        "minEigThreshold": LK_MIN_EIGENVALUE,
    }
    first = start.reshape(-1, 1, 2)
    end, found, _ = cv2.calcOpticalFlowPyrLK(before, after, first, first + shift, **options)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, end, end - shift, **options)
    points = Points(start, end[:, 0], back[:, 0])
    good = (found[:, 0] & returned[:, 0]).astype(bool)
    good &= np.isfinite(points.end).all(axis=1) & np.isfinite(points.back).all(axis=1)
    size = np.array(before.shape[::-1], np.float32)
    for places in (points.start, points.end):
        good &= ((places >= 0.0) & (places <= size - 1.0)).all(axis=1)
    return points, good


def _apart(own: Points, around: Points, least: float) -> np.ndarray:
    """Find the points (N,) bool that move otherwise than the surroundings, none if too few or nearly all.

    Parameters
    ----------
    least : the difference that counts [pixel of the crops].
    """
    none = np.zeros(len(own), bool)
    if len(around) < MIN_BACKGROUND:
        return none
    background = np.median(around.motion, axis=0)
    wobble = np.median(np.hypot(*(around.motion - background).T))
    differs = np.hypot(*(own.motion - background).T) > max(3.0 * wobble, least, 0.5)
    share = differs.mean() if len(own) else 0.0
    return differs if MIN_SHARE < share < MAX_SHARE else none


def _motion(
    before: np.ndarray, after: np.ndarray, points: Points, box: Box, factor: int, parameters: Parameters
) -> Flow | None:
    """Median motion of the better half of the points; `factor` is the crops' pixel size [pixel]."""
    if len(points) < MIN_POINTS:
        return None
    side = np.sqrt(box.area)
    distance = points.error
    error = float(np.median(distance)) * factor / side
    if error > parameters.max_fb_error:
        return None
    similarity = patch_ncc(before, after, points.start, points.end, parameters.flow_patch)
    kept = distance <= np.median(distance)
    similar = kept & (similarity >= np.median(similarity))
    if np.count_nonzero(similar) >= MIN_POINTS:
        kept = similar
    best = points[kept]
    shift = np.median(best.motion, axis=0)
    scale = median_scale(best.start, best.end)
    expected = points.start + shift + (scale - 1.0) * (points.start - np.median(best.start, axis=0))
    residual = float(np.median(np.hypot(*(points.end - expected).T))) * factor / side
    center_x, center_y = np.array(box.center) + shift * factor
    moved = Box.from_center(float(center_x), float(center_y), box.width * scale, box.height * scale)
    return Flow(moved, error, residual)


def _crops(
    previous: Frame,
    current: Frame,
    box: Box,
    octave: int,
    parameters: Parameters,
    guess: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray, int, np.ndarray]:
    """Cut the target's surroundings out of one octave of both frames.

    Returns
    -------
    both crops, the octave's pixel size [pixel of the image], and the crop's origin (x, y) [pixel of the
    octave].
    """
    before, after = previous.level(octave).gray, current.level(octave).gray
    factor = round(previous.height / before.shape[0])
    height, width = before.shape
    margin = (parameters.lk_window << parameters.lk_levels) + int(max(map(abs, guess)) / factor)
    x0 = min(max(int(box.x / factor) - margin, 0), width - 1)
    y0 = min(max(int(box.y / factor) - margin, 0), height - 1)
    x1 = max(min(int(box.right / factor) + margin, width), x0 + 1)
    y1 = max(min(int(box.bottom / factor) + margin, height), y0 + 1)
    return before[y0:y1, x0:x1], after[y0:y1, x0:x1], factor, np.array([x0, y0], np.float32)


@njit(cache=True)
def median_scale(start, end):
    """Median ratio of the distances between pairs of points after and before, 1 if no pair is apart.

    Parameters
    ----------
    start, end : (N, 2) float32
    """
    count = start.shape[0]
    ratios = np.empty(count * (count - 1) // 2)
    used = 0
    for i in range(count):
        for j in range(i):
            before = np.hypot(start[i, 0] - start[j, 0], start[i, 1] - start[j, 1])
            if before > 1e-3:
                ratios[used] = np.hypot(end[i, 0] - end[j, 0], end[i, 1] - end[j, 1]) / before
                used += 1
    if used == 0:
        return 1.0
    return np.median(ratios[:used])


@njit(cache=True)
def _bilinear(image, y, x):
    """Read an image at a fractional pixel, borders repeated."""
    y = min(max(y, 0.0), image.shape[0] - 1.0)
    x = min(max(x, 0.0), image.shape[1] - 1.0)
    row = int(y)
    col = int(x)
    below = min(row + 1, image.shape[0] - 1)
    right = min(col + 1, image.shape[1] - 1)
    fy = y - row
    fx = x - col
    top = image[row, col] * (1.0 - fx) + image[row, right] * fx
    bottom = image[below, col] * (1.0 - fx) + image[below, right] * fx
    return top * (1.0 - fy) + bottom * fy


@njit(cache=True)
def patch_ncc(before, after, start, end, side):
    """NCC (thesis eq. 3.3) of the side x side patches around pairs of points; 0 where one has no contrast.

    Parameters
    ----------
    before, after : (H, W) uint8
    start, end : (N, 2) float32, pixel centres at whole numbers.

    Returns
    -------
    (N,) float32, -1..1
    """
    count = start.shape[0]
    result = np.zeros(count, np.float32)
    middle = 0.5 * (side - 1)
    size = side * side
    for n in range(count):
        sum_a = sum_b = sum_aa = sum_bb = sum_ab = 0.0
        for i in range(side):
            for j in range(side):
                a = _bilinear(before, start[n, 1] + i - middle, start[n, 0] + j - middle)
                b = _bilinear(after, end[n, 1] + i - middle, end[n, 0] + j - middle)
                sum_a += a
                sum_b += b
                sum_aa += a * a
                sum_bb += b * b
                sum_ab += a * b
        var_a = sum_aa - sum_a * sum_a / size
        var_b = sum_bb - sum_b * sum_b / size
        if var_a > 1e-6 and var_b > 1e-6:
            result[n] = (sum_ab - sum_a * sum_b / size) / np.sqrt(var_a * var_b)
    return result
