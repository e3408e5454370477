# SPDX-License-Identifier: BSD-3-Clause
"""The ensemble classifier: random ferns on pixel comparisons (thesis section 3.1.2, eq. 3.6)."""

from __future__ import annotations

import numpy as np
from numba import njit

MIN_REACH = 0.2


def make_comparisons(ferns: int, comparisons: int, rng: np.random.Generator) -> np.ndarray:
    """Draw the pixel pairs of each fern: horizontal or vertical, spread over the window.

    Returns
    -------
    (ferns, comparisons, 4) float64: x and y of both pixels, as fractions 0..1 of the window.
    """
    count = ferns * comparisons
    # Anchors on a jittered lattice cover the window evenly; each pair is at least a fifth of it apart.
    side = int(np.ceil(np.sqrt(count)))
    cells = rng.permutation(side * side)[:count]
    first = (np.stack([cells % side, cells // side], axis=1) + rng.random((count, 2))) / side
    axis = rng.integers(0, 2, count)
    along = first[np.arange(count), axis]
    reach = rng.uniform(MIN_REACH, 1.0, count)
    forward = np.clip(along + reach, 0.0, 1.0)
    backward = np.clip(along - reach, 0.0, 1.0)
    second = first.copy()
    second[np.arange(count), axis] = np.where(along < 0.5, forward, backward)
    return np.concatenate([first, second], axis=1)[rng.permutation(count)].reshape(ferns, comparisons, 4)


def pixel_offsets(comparisons: np.ndarray, width: int, height: int) -> np.ndarray:
    """Place the comparisons in a window of width x height pixels.

    Returns
    -------
    (ferns, comparisons, 4) int32: x and y of both pixels, from the window's first pixel.
    """
    limit = np.array([width - 1, height - 1, width - 1, height - 1])
    return np.rint(comparisons * limit).astype(np.int32)


class Ferns:
    """Counts of positive and negative examples for each code of each fern, and the posteriors from them.

    Parameters
    ----------
    ferns, comparisons : number of ferns, and of comparisons (bits) in each.
    """

    def __init__(self, ferns: int, comparisons: int, rng: np.random.Generator) -> None:
        self.comparisons = make_comparisons(ferns, comparisons, rng)
        self._positives = np.zeros((ferns, 1 << comparisons), np.int32)
        self._negatives = np.zeros((ferns, 1 << comparisons), np.int32)
        self.posteriors = np.zeros((ferns, 1 << comparisons), np.float32)

    @property
    def count(self) -> int:
        """Number of ferns."""
        return self.posteriors.shape[0]

    @property
    def counts(self) -> np.ndarray:
        """Positive and negative examples seen, (2, ferns, 2^comparisons) int32."""
        return np.stack([self._positives, self._negatives])

    def restore(self, comparisons: np.ndarray, counts: np.ndarray) -> None:
        """Take over `comparisons` and `counts` of other ferns, of the same shapes."""
        self.comparisons = comparisons
        self._positives[:], self._negatives[:] = counts
        self.posteriors[:] = counts[0] / np.maximum(counts.sum(axis=0), 1)

    def confidence(self, codes: np.ndarray) -> np.ndarray:
        """Mean posterior of examples, given their codes (N, ferns).

        Returns
        -------
        (N,) float32, 0..1
        """
        return self.posteriors[np.arange(self.count), codes].mean(axis=1)

    def train(
        self, codes: np.ndarray, labels: np.ndarray, threshold: float, negative_threshold: float
    ) -> None:
        """Add the examples that are misclassified, one after the other (Kalal 2012: update on error only).

        Parameters
        ----------
        codes : (N, ferns) int32
        labels : (N,) bool, True for the target.
        threshold : a positive is wrong at or under this mean posterior.
        negative_threshold : a negative is wrong at or over this one.
        """
        train_ferns(
            np.ascontiguousarray(codes, np.int32),
            np.ascontiguousarray(labels, np.bool_),
            self._positives,
            self._negatives,
            self.posteriors,
            threshold,
            negative_threshold,
        )


@njit(cache=True)
def train_ferns(codes, labels, positives, negatives, posteriors, threshold, negative_threshold):
    """Update counts and posteriors in place; see `Ferns.train`."""
    ferns = posteriors.shape[0]
    for n in range(codes.shape[0]):
        total = 0.0
        for f in range(ferns):
            total += posteriors[f, codes[n, f]]
        mean = total / ferns
        if labels[n]:
            if mean > threshold:
                continue
        elif mean < negative_threshold:
            continue
        for f in range(ferns):
            code = codes[n, f]
            if labels[n]:
                positives[f, code] += 1
            else:
                negatives[f, code] += 1
            posteriors[f, code] = positives[f, code] / (positives[f, code] + negatives[f, code])


@njit(cache=True)
def fern_codes(image, corners, offsets):
    """Compute the codes of windows of one size.

    Parameters
    ----------
    image : (H, W) uint8, blurred.
    corners : (N, 2) int32, x and y of the windows' first pixels; the windows lie inside the image.
    offsets : (ferns, comparisons, 4) int32, see `pixel_offsets`.

    Returns
    -------
    (N, ferns) int32; bit by bit, the first comparison highest: 1 where the first pixel is brighter.
    """
    count = corners.shape[0]
    codes = np.zeros((count, offsets.shape[0]), np.int32)
    for n in range(count):
        x = corners[n, 0]
        y = corners[n, 1]
        for f in range(offsets.shape[0]):
            code = 0
            for b in range(offsets.shape[1]):
                first = image[y + offsets[f, b, 1], x + offsets[f, b, 0]]
                second = image[y + offsets[f, b, 3], x + offsets[f, b, 2]]
                code = (code << 1) | (1 if first > second else 0)
            codes[n, f] = code
    return codes


@njit(cache=True)
def scan_windows(
    image,
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
    image : (H, W) uint8, blurred; C-contiguous.
    integral, squares : integral images of the level and of its square, (H + 1, W + 1) int32 and float64.
    grid : (width, height, step x, step y), the windows' size and shift [pixel of the level].
    offsets : (ferns, comparisons, 4) int32
    posteriors : (ferns, 2^comparisons) float32
    min_variance : the gate; windows with less are rejected.
    min_confidence : windows must have a mean posterior above it.
    sparse : (stride, phase): away from `near` only every stride-th window is looked at.
    near : (x0, y0, x1, y1), corners of windows that are always looked at [pixel of the level].
    corners, confidences, codes : (M, 2) int32, (M,) float32, (M, ferns) int32, filled from row `filled` on.

    Returns
    -------
    the number of rows filled; windows beyond M are dropped.
    """
    width, height, step_x, step_y = grid
    win_w = round(width)
    win_h = round(height)
    stride, phase = sparse
    rows, cols = image.shape
    ferns = offsets.shape[0]
    bits = offsets.shape[1]
    pixels = image.reshape(-1)
    linear = np.empty((ferns, bits, 2), np.int32)
    for f in range(ferns):
        for b in range(bits):
            linear[f, b, 0] = offsets[f, b, 1] * cols + offsets[f, b, 0]
            linear[f, b, 1] = offsets[f, b, 3] * cols + offsets[f, b, 2]
    area = float(win_w * win_h)
    needed = min_confidence * ferns
    iy = 0
    while True:
        y = round(iy * step_y)
        if y + win_h > rows:
            break
        ix = -1
        while True:
            ix += 1
            x = round(ix * step_x)
            if x + win_w > cols:
                break
            if (ix + 2 * iy + phase) % stride != 0 and not (
                near[0] <= x <= near[2] and near[1] <= y <= near[3]
            ):
                continue
            total = (
                integral[y + win_h, x + win_w]
                - integral[y, x + win_w]
                - integral[y + win_h, x]
                + integral[y, x]
            )
            square = (
                squares[y + win_h, x + win_w] - squares[y, x + win_w] - squares[y + win_h, x] + squares[y, x]
            )
            mean = total / area
            if square / area - mean * mean < min_variance:
                continue
            if filled >= corners.shape[0]:
                return filled
            base = y * cols + x
            confidence = 0.0
            passed = True
            for f in range(ferns):
                code = 0
                for b in range(bits):
                    first = pixels[base + linear[f, b, 0]]
                    second = pixels[base + linear[f, b, 1]]
                    code = (code << 1) | (1 if first > second else 0)
                codes[filled, f] = code
                confidence += posteriors[f, code]
                # Even if every fern left were certain, the mean would stay too low.
                if confidence + (ferns - 1 - f) <= needed:
                    passed = False
                    break
            if passed:
                corners[filled, 0] = x
                corners[filled, 1] = y
                confidences[filled] = confidence / ferns
                filled += 1
        iy += 1
    return filled
