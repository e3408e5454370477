# SPDX-License-Identifier: BSD-3-Clause
"""The object model: 15x15 templates of the target and of what is not the target (thesis eq. 3.7-3.9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tld_follower.tld.frame import PATCH_SIZE


@dataclass(frozen=True)
class Similarity:
    """Similarities of N patches to the model, each (N,) float32, 0..1.

    Attributes
    ----------
    relative : (1 - S-) / ((1 - S-) + (1 - S+)), the form that the published thresholds belong to.
    conservative : the same with S+ over the first half, in time, of the positives only.
    positive, negative : S+ and S-, similarity (eq. 3.8) to the nearest template of each kind.
    """

    relative: np.ndarray
    conservative: np.ndarray
    positive: np.ndarray
    negative: np.ndarray


class Templates:
    """A bounded list of normalised patches in the order of time.

    When full, one of the two most similar templates goes, so that the most different stay; the first
    `protected` always stay.

    Parameters
    ----------
    capacity : most templates kept.
    protected : number of first templates that are never dropped.
    """

    def __init__(self, capacity: int, protected: int) -> None:
        self._patches = np.zeros((capacity + 1, PATCH_SIZE), np.float32)
        # Of each template: its product with the one most like it, and which that is.
        self._nearest = np.full(capacity + 1, -np.inf, np.float32)
        self._partner = np.full(capacity + 1, -1)
        self._capacity = capacity
        self._protected = min(protected, capacity)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def patches(self) -> np.ndarray:
        """The templates (N, 225) float32, a view."""
        return self._patches[: self._count]

    def add(self, patch: np.ndarray) -> None:
        """Append a normalised patch (225,)."""
        last = self._count
        self._patches[last] = patch
        self._count += 1
        if last:
            products = best_products(self._patches[:last], self._patches[last : last + 1])
            nearer = products > self._nearest[:last]
            self._nearest[:last][nearer] = products[nearer]
            self._partner[:last][nearer] = last
            self._partner[last] = np.argmax(products)
            self._nearest[last] = products.max()
        if self._count > self._capacity:
            self._drop(self._protected + int(np.argmax(self._nearest[self._protected : self._count])))

    def _drop(self, row: int) -> None:
        last = self._count - 1
        alone = np.flatnonzero(self._partner[: self._count] == row)
        for array in (self._patches, self._nearest, self._partner):
            array[row:last] = array[row + 1 : self._count]
        self._partner[:last] -= self._partner[:last] > row
        self._count = last
        for index in alone - (alone > row):
            products = best_products(self.patches, self._patches[index : index + 1])
            products[index] = -np.inf
            self._partner[index] = np.argmax(products)
            self._nearest[index] = products.max()


class ObjectModel:
    """Positive and negative templates, and the nearest-neighbour similarity to them.

    Parameters
    ----------
    max_positives, max_negatives : most templates of each kind.
    """

    def __init__(self, max_positives: int, max_negatives: int) -> None:
        self.positives = Templates(max_positives, protected=1)
        self.negatives = Templates(max_negatives, protected=0)

    def __len__(self) -> int:
        return len(self.positives) + len(self.negatives)

    def similarity(self, patches: np.ndarray) -> Similarity:
        """Compare patches (N, 225), normalised, with the model.

        A kind without templates counts as similarity 0.
        """
        early = (len(self.positives) + 1) // 2
        first = similarity_to(self.positives.patches[:early], patches)
        positive = np.maximum(first, similarity_to(self.positives.patches[early:], patches))
        negative = similarity_to(self.negatives.patches, patches)
        return Similarity(
            relative_similarity(positive, negative), relative_similarity(first, negative), positive, negative
        )

    def positive_similarity(self, patches: np.ndarray) -> np.ndarray:
        """Return S+ (N,) of patches (N, 225), normalised."""
        return similarity_to(self.positives.patches, patches)


def similarity_to(templates: np.ndarray, patches: np.ndarray) -> np.ndarray:
    """Similarity (eq. 3.8), (N,) float32, of patches (N, 225) to the nearest of templates (M, 225)."""
    return 0.5 + 0.5 * best_products(np.ascontiguousarray(patches, np.float32), templates)


def relative_similarity(positive: np.ndarray, negative: np.ndarray) -> np.ndarray:
    """Relative similarity (N,) from S+ and S- (N,); 0.5 where a patch is equal to both."""
    from_positive, from_negative = 1.0 - positive, 1.0 - negative
    total = from_positive + from_negative
    return np.where(total > 1e-9, from_negative / np.maximum(total, 1e-9), 0.5)


@njit(cache=True, fastmath=True)
def best_products(patches, templates):
    """Largest dot product of each patch with any template, -1 without templates.

    The product of the two matrices, tile by tile: as fast as a single-threaded BLAS for a hundred patches,
    faster for few, and always one thread.

    Parameters
    ----------
    patches : (N, 225) float32
    templates : (M, 225) float32

    Returns
    -------
    (N,) float32, clipped to -1..1
    """
    result = np.full(patches.shape[0], np.float32(-1.0))
    tiled = templates.shape[0] // 4 * 4
    for m in range(0, tiled, 4):
        for n in range(patches.shape[0]):
            a = b = c = d = np.float32(0.0)
            for i in range(patches.shape[1]):
                value = patches[n, i]
                a += value * templates[m, i]
                b += value * templates[m + 1, i]
                c += value * templates[m + 2, i]
                d += value * templates[m + 3, i]
            result[n] = max(result[n], a, b, c, d)
    for m in range(tiled, templates.shape[0]):
        for n in range(patches.shape[0]):
            a = np.float32(0.0)
            for i in range(patches.shape[1]):
                a += patches[n, i] * templates[m, i]
            result[n] = max(result[n], a)
    return np.minimum(result, np.float32(1.0))
