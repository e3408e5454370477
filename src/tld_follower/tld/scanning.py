# SPDX-License-Identifier: BSD-3-Clause
"""The scan of all windows of one size: variance gate and ferns, many windows at a time (thesis 3.1.2)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Windows whose comparisons are made together: neighbours in a row, so that their pixels are, too.
BLOCK = 64


def deinterleave(image: NDArray[np.uint8], step: int) -> NDArray[np.uint8]:
    """Sort the columns of an image by their remainder: pixels `step` columns apart become neighbours.

    Parameters
    ----------
    image : (H, W) uint8
    step : whole pixels, 1 or more.

    Returns
    -------
    (step * H * ceil(W / step) + BLOCK,) uint8: `step` planes, in plane r the columns r, r + step, ...;
    shorter rows are filled up with 0, and so is the end, for a block of pixels to be read from anywhere.
    """
    height, width = image.shape
    pitch = -(-width // step)
    flat = np.zeros(step * height * pitch + BLOCK, np.uint8)
    planes = flat[:-BLOCK].reshape(step, height, pitch)
    for remainder in range(min(step, width)):
        columns = image[:, remainder::step]
        planes[remainder, :, : columns.shape[1]] = columns
    return flat


@njit(cache=True)
def scan_windows(
    pixels,
    integral,
    squares,
    grid,
    offsets,
    posteriors,
    min_variance,
    min_confidence,
    sparse,
    near,
    corners,
    confidences,
    codes,
    filled,
):
    """Run the variance gate and the ferns over all windows of one size, with early exit.

    Parameters
    ----------
    pixels : the blurred image, `deinterleave` d by the step in x times the stride.
    integral, squares : integral images of the level and of its square, (H + 1, W + 1) int32 and float64.
    grid : (width, height, step x, step y), the windows' size and shift [pixel of the level]; step x is whole.
    offsets : (ferns, comparisons, 4) int32
    posteriors : (ferns, 2^comparisons) float32; at most 16 comparisons.
    min_variance : the gate; windows with less are rejected.
    min_confidence : windows must have a mean posterior above it.
    sparse : (stride, phase): away from `near` only every stride-th window is looked at.
    near : (x0, y0, x1, y1), corners of windows that are always looked at [pixel of the level].
    corners, confidences, codes : (M, 2) int32, (M,) float32, (M, ferns) int32, filled from row `filled` on.

    Returns
    -------
    the number of rows filled; windows beyond M are dropped.
    """
    win_w, win_h, step_x = round(grid[0]), round(grid[1]), int(grid[2])
    stride, phase = sparse
    period = step_x * stride
    rows, cols = integral.shape[0] - 1, integral.shape[1] - 1
    pitch = -(-cols // period)
    ferns, bits = offsets.shape[0], offsets.shape[1]
    across = (cols - win_w) // step_x + 1 if win_w <= cols else 0
    area = float(win_w * win_h)
    gate = min_variance * area * area
    needed = min_confidence * ferns
    wide = np.uint64(win_w)
    places = np.empty((stride, ferns, bits, 2), np.int64)
    for r in range(stride):
        for f in range(ferns):
            for b in range(bits):
                for k in range(2):
                    x = r * step_x + offsets[f, b, 2 * k]
                    y = offsets[f, b, 2 * k + 1]
                    places[r, f, b, k] = ((x % period) * rows + y) * pitch + x // period
    block = np.empty((ferns, BLOCK), np.uint16)
    sums = np.empty(BLOCK)
    iy = 0
    while True:
        y = round(iy * grid[3])
        if y + win_h > rows:
            break
        turn = (-2 * iy - phase) % stride
        above, below = integral[y], integral[y + win_h]
        above_squares, below_squares = squares[y], squares[y + win_h]
        iy += 1
        for r in range(stride):
            # Window j of this share has its corner at x = r step_x + j period.
            start, end = 0, (across - r + stride - 1) // stride
            if r != turn:
                if not near[1] <= y <= near[3]:
                    continue
                start = max(start, int(np.ceil((near[0] - r * step_x) / period)))
                end = min(end, int(np.floor((near[2] - r * step_x) / period)) + 1)
            for j in range(start, end, BLOCK):
                # What fails the gate can't make up for it, nor can what lies beyond the end.
                sums[:] = -np.inf
                passed = False
                for n in range(min(BLOCK, end - j)):
                    x = np.uint64(r * step_x + (j + n) * period)
                    total = float(below[x + wide] - above[x + wide] - below[x] + above[x])
                    square = below_squares[x + wide] - above_squares[x + wide]
                    square += above_squares[x] - below_squares[x]
                    if square * area - total * total >= gate:
                        sums[n] = 0.0
                        passed = True
                if not passed:
                    continue
                origin = y * pitch + j
                for f in range(ferns):
                    code = block[f]
                    code[:] = 0
                    for b in range(bits):
                        first = pixels[origin + places[r, f, b, 0] :][:BLOCK]
                        second = pixels[origin + places[r, f, b, 1] :][:BLOCK]
                        for n in range(BLOCK):
                            code[n] = (code[n] << 1) | (first[n] > second[n])
                    # Where even certainty of every fern left would not do, none is asked.
                    least = needed - (ferns - 1 - f)
                    left = 0
                    posterior = posteriors[f]
                    for n in range(BLOCK):
                        sums[n] += posterior[code[n]]
                    for n in range(BLOCK):
                        left += sums[n] > least
                    if left == 0:
                        break
                if left == 0:
                    continue
                for n in range(BLOCK):
                    if sums[n] > needed:
                        if filled >= corners.shape[0]:
                            return filled
                        corners[filled, 0] = r * step_x + (j + n) * period
                        corners[filled, 1] = y
                        confidences[filled] = sums[n] / ferns
                        for f in range(ferns):
                            codes[filled, f] = block[f, n]
                        filled += 1
    return filled
