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
        self._products = np.full((capacity + 1, capacity + 1), -np.inf, np.float32)
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
        products = best_products(self._patches[: last + 1], self._patches[last : last + 1])
        self._products[last, :last] = products[:last]
        self._products[:last, last] = products[:last]
        self._count += 1
        if self._count > self._capacity:
            self._drop_redundant()

    def _drop_redundant(self) -> None:
        free = self._products[self._protected : self._count, : self._count]
        row = self._protected + int(np.argmax(free.max(axis=1)))
        last = self._count - 1
        self._patches[row:last] = self._patches[row + 1 : last + 1].copy()
        kept = np.delete(np.arange(self._count), row)
        self._products[:last, :last] = self._products[np.ix_(kept, kept)]
        self._products[last, :] = -np.inf
        self._products[:, last] = -np.inf
        self._count = last


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
        patches = np.ascontiguousarray(patches, np.float32)
        early = (len(self.positives) + 1) // 2
        first = 0.5 + 0.5 * best_products(patches, self.positives.patches[:early])
        rest = 0.5 + 0.5 * best_products(patches, self.positives.patches[early:])
        positive = np.maximum(first, rest)
        negative = 0.5 + 0.5 * best_products(patches, self.negatives.patches)
        return Similarity(_relative(positive, negative), _relative(first, negative), positive, negative)

    def positive_similarity(self, patches: np.ndarray) -> np.ndarray:
        """Return S+ (N,) of patches (N, 225), normalised."""
        return 0.5 + 0.5 * best_products(np.ascontiguousarray(patches, np.float32), self.positives.patches)


def _relative(positive: np.ndarray, negative: np.ndarray) -> np.ndarray:
    from_positive, from_negative = 1.0 - positive, 1.0 - negative
    total = from_positive + from_negative
    return np.where(total > 1e-9, from_negative / np.maximum(total, 1e-9), 0.5)


@njit(cache=True, fastmath=True)
def best_products(patches, templates):
    """Largest dot product of each patch with any template, -1 without templates.

    Parameters
    ----------
    patches : (N, 225) float32
    templates : (M, 225) float32

    Returns
    -------
    (N,) float32, clipped to -1..1
    """
    result = np.empty(patches.shape[0], np.float32)
    for n in range(patches.shape[0]):
        best = np.float32(-1.0)
        for m in range(templates.shape[0]):
            total = np.float32(0.0)
            for i in range(patches.shape[1]):
                total += patches[n, i] * templates[m, i]
            best = max(best, total)
        result[n] = min(best, np.float32(1.0))
    return result
