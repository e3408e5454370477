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


def track(
    previous: Frame,
    current: Frame,
    box: Box,
    points: np.ndarray,
    parameters: Parameters,
    guess: tuple[float, float] = (0.0, 0.0),
) -> Flow | None:
    """Move a box from one frame to the next.

    Points go forward and back by pyramidal Lucas-Kanade; those with a forward-backward error (eq. 3.2) above
    the median or an NCC (eq. 3.3) under the median are dropped. The box moves by the median displacement and
    scales by the median ratio of the distances between pairs of points.

    Parameters
    ----------
    box : the target in `previous` [pixel].
    points : (N, 2) float32 in `previous` [pixel].
    guess : displacement to start the search from [pixel].

    Returns
    -------
    The flow, or None if too few points were found or their median error exceeds `max_fb_error`.
    """
    if len(points) < MIN_POINTS:
        return None
    side = np.sqrt(box.area)
    # A large target is tracked on a smaller octave: the same points, a wider reach, bounded cost.
    octave = max(0, int(np.floor(np.log2(side / parameters.flow_side))))
    before, after, factor, origin = _crops(previous, current, box, octave, parameters, guess)
    start = (np.ascontiguousarray(points, np.float32) / factor - origin - 0.5).reshape(-1, 1, 2)
    shift = np.array(guess, np.float32) / factor
    options = {
        "winSize": (parameters.lk_window, parameters.lk_window),
        "maxLevel": parameters.lk_levels,
        "criteria": LK_CRITERIA,
        "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
        "minEigThreshold": LK_MIN_EIGENVALUE,
    }
    end, found, _ = cv2.calcOpticalFlowPyrLK(before, after, start, start + shift, **options)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, end, end - shift, **options)
    start, end, back = start[:, 0], end[:, 0], back[:, 0]
    height, width = after.shape
    good = np.isfinite(end).all(axis=1) & np.isfinite(back).all(axis=1)
    good &= (found[:, 0] & returned[:, 0]).astype(bool)
    good &= (end[:, 0] >= 0) & (end[:, 1] >= 0) & (end[:, 0] <= width - 1) & (end[:, 1] <= height - 1)
    if np.count_nonzero(good) < MIN_POINTS:
        return None
    start, end, back = start[good], end[good], back[good]
    distance = np.hypot(*(start - back).T)
    error = float(np.median(distance)) * factor / side
    if error > parameters.max_fb_error:
        return None
    similarity = patch_ncc(before, after, start, end, parameters.flow_patch)
    kept = distance <= np.median(distance)
    similar = kept & (similarity >= np.median(similarity))
    if np.count_nonzero(similar) >= MIN_POINTS:
        kept = similar
    shift = np.median(end[kept] - start[kept], axis=0)
    scale = median_scale(start[kept], end[kept])
    expected = start + shift + (scale - 1.0) * (start - np.median(start[kept], axis=0))
    residual = float(np.median(np.hypot(*(end - expected).T))) * factor / side
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
