# SPDX-License-Identifier: BSD-3-Clause
"""Scores of one tracker on one sequence.

A true positive is a frame with the target in view and a box whose overlap (intersection over union) exceeds
the threshold; a false positive is any other box; a false negative is a frame with the target in view that is
no true positive. The first frame, where the target was given, counts as a true positive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tld_follower.box import Box

OVERLAPS = (0.25, 0.5)
FOUND_OVERLAP = 0.25
FOUND_FRAMES = 25
# A failure is a target that is not found for over 5 s after its re-entry, at 30 frames a second.
FAILURE_FRAMES = 150

Boxes = Sequence[Box | None]


@dataclass(frozen=True)
class Counts:
    """Frames that are true and false positives, false and true negatives."""

    tp: int
    fp: int
    fn: int
    tn: int

    @property
    def precision(self) -> float:
        """Share of the boxes given that are right, 0..1."""
        return self.tp / (self.tp + self.fp) if self.tp else 0.0

    @property
    def recall(self) -> float:
        """Share of the frames with the target in view that have the right box, 0..1."""
        return self.tp / (self.tp + self.fn) if self.tp else 0.0

    @property
    def f(self) -> float:
        """Harmonic mean of precision and recall."""
        return 2.0 * self.tp / (2.0 * self.tp + self.fp + self.fn) if self.tp else 0.0

    def as_dict(self) -> dict[str, float]:
        """Return counts and scores under the names of the JSON file."""
        return {
            "tp": self.tp,
            "fp": self.fp,
            "fn": self.fn,
            "tn": self.tn,
            "precision": self.precision,
            "recall": self.recall,
            "f": self.f,
        }


def frame_overlap(truth: Box | None, found: Box | None) -> float:
    """Overlap of two boxes, 0 if there is none of either."""
    return truth.overlap(found) if truth is not None and found is not None else 0.0


def count(truth: Boxes, found: Boxes, min_overlap: float) -> Counts:
    """Count the frames of each kind at an overlap above `min_overlap`."""
    tp = fp = fn = tn = 0
    for index, (true_box, box) in enumerate(zip(truth, found, strict=True)):
        hit = index == 0 or frame_overlap(true_box, box) > min_overlap
        tp += hit
        fp += box is not None and not hit
        fn += true_box is not None and not hit
        tn += true_box is None and box is None
    return Counts(tp, fp, fn, tn)


def reentries(truth: Boxes) -> list[int]:
    """Return the indices of the frames where the target comes into view again."""
    return [i for i in range(1, len(truth)) if truth[i] is not None and truth[i - 1] is None]


def _waiting(truth: Boxes, found: Boxes, start: int) -> int | None:
    """Frames from `start` until the target is found, 0 if it is at once; None if it never is."""
    for index in range(start, len(truth)):
        if frame_overlap(truth[index], found[index]) > FOUND_OVERLAP:
            return index - start
    return None


def score(truth: Boxes, found: Boxes) -> dict:
    """Score the boxes that a tracker gave.

    Parameters
    ----------
    truth, found : one box or None a frame, equally many.

    Returns
    -------
    dict with frames, absent (frames), overlap (counts at each of `OVERLAPS`), boxes_while_absent, reentries,
    reentries_found (within 25 frames) and failures (not found within 150 frames of a re-entry).
    """
    starts = reentries(truth)
    waits = [_waiting(truth, found, start) for start in starts]
    unseen = [len(truth) - start if wait is None else wait for start, wait in zip(starts, waits, strict=True)]
    absent = [box for true_box, box in zip(truth, found, strict=True) if true_box is None]
    return {
        "frames": len(truth),
        "absent": len(absent),
        "overlap": {str(value): count(truth, found, value).as_dict() for value in OVERLAPS},
        "boxes_while_absent": sum(box is not None for box in absent),
        "reentries": len(starts),
        "reentries_found": sum(wait is not None and wait < FOUND_FRAMES for wait in waits),
        "failures": sum(frames > FAILURE_FRAMES for frames in unseen),
    }
