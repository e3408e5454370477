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
