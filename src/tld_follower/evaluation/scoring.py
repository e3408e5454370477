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


def recoveries(in_view: Sequence[bool], overlaps: Sequence[float]) -> dict[str, int]:
    """Count how often the target comes back, and is found again.

    A re-entry is found if the overlap exceeds 0.25 within 25 frames of it. It is a failure, as in the thesis'
    figure 4.8, if it does not for over 5 s: 150 frames on, be the target in view or not in between, it still
    has not been found. A re-entry in the last 5 s of a sequence can't fail.

    Parameters
    ----------
    in_view : whether the target is in view, one a frame.
    overlaps : overlap of true and found box, 0 where there is none of either.

    Returns
    -------
    dict with reentries, reentries_found and failures.
    """
    starts = [i for i in range(1, len(in_view)) if in_view[i] and not in_view[i - 1]]
    hits = [i for i, overlap in enumerate(overlaps) if overlap > FOUND_OVERLAP]
    waits = [next((hit for hit in hits if hit >= start), None) for start in starts]
    unseen = [
        (len(in_view) if hit is None else hit) - start for start, hit in zip(starts, waits, strict=True)
    ]
    found = [hit is not None and n < FOUND_FRAMES for n, hit in zip(unseen, waits, strict=True)]
    return {
        "reentries": len(starts),
        "reentries_found": sum(found),
        "failures": sum(n > FAILURE_FRAMES for n in unseen),
    }


def score(truth: Boxes, found: Boxes) -> dict:
    """Score the boxes that a tracker gave.

    Parameters
    ----------
    truth, found : one box or None a frame, equally many.

    Returns
    -------
    dict with frames, absent (frames), overlap (counts at each of `OVERLAPS`), boxes_while_absent, and
    what `recoveries` returns.
    """
    absent = [box for true_box, box in zip(truth, found, strict=True) if true_box is None]
    return {
        "frames": len(truth),
        "absent": len(absent),
        "overlap": {str(value): count(truth, found, value).as_dict() for value in OVERLAPS},
        "boxes_while_absent": sum(box is not None for box in absent),
        **recoveries(
            [true_box is not None for true_box in truth],
            [frame_overlap(true_box, box) for true_box, box in zip(truth, found, strict=True)],
        ),
    }
