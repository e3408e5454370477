# SPDX-License-Identifier: BSD-3-Clause
"""Local search for the box that looks most like the target, against the drift of the tracker."""

from __future__ import annotations

import numpy as np

from tld_follower.box import Box
from tld_follower.tld.frame import Frame
from tld_follower.tld.object_model import ObjectModel

ROUNDS = 2
# Shifts in x and y and changes of scale, in steps; the middle one changes nothing.
OFFSETS = np.array([(x, y, s) for s in (-1, 0, 1) for y in (-1, 0, 1) for x in (-1, 0, 1)], np.float64)
MIDDLE = len(OFFSETS) // 2


def align(frame: Frame, model: ObjectModel, box: Box, step: float) -> tuple[Box, float]:
    """Move and scale a box to the greatest similarity S+ with the positive templates.

    Each round tries the 26 neighbours of the best box so far; the step halves from round to round.

    Parameters
    ----------
    step : first step, as a fraction of the box's sides.

    Returns
    -------
    the best box and its S+ (thesis eq. 3.8), 0..1.
    """
    best = np.array(box.as_tuple())
    similarity = 0.0
    for _ in range(ROUNDS):
        sizes = best[2:] * (1.0 + step) ** OFFSETS[:, 2:]
        centers = best[:2] + 0.5 * best[2:] + OFFSETS[:, :2] * step * best[2:]
        boxes = np.concatenate([centers - 0.5 * sizes, sizes], axis=1)
        positive = model.positive_similarity(frame.patches(boxes))
        top = int(np.argmax(positive))
        # A tie goes to the box as it is.
        if positive[top] <= positive[MIDDLE]:
            top = MIDDLE
        best, similarity = boxes[top], float(positive[top])
        step *= 0.5
    return Box(*map(float, best)), similarity


def blend(box: Box, other: Box, weight: float) -> Box:
    """Return the box between two, corners and sizes averaged with `weight` on `other`."""
    first, second = np.array(box.as_tuple()), np.array(other.as_tuple())
    return Box(*map(float, first + weight * (second - first)))
