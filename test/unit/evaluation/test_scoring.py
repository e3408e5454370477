# SPDX-License-Identifier: BSD-3-Clause
import pytest

from tld_follower.box import Box
from tld_follower.evaluation import scoring

HERE = Box(10, 10, 20, 20)
THIRD = Box(20, 10, 20, 20)  # overlaps HERE by a third
AWAY = Box(100, 100, 20, 20)


def test_counts_of_each_kind():
    truth = [HERE, HERE, HERE, HERE, None, None]
    found = [HERE, HERE, AWAY, None, HERE, None]
    counts = scoring.count(truth, found, 0.5)
    assert (counts.tp, counts.fp, counts.fn, counts.tn) == (2, 2, 2, 1)
    assert counts.precision == pytest.approx(0.5)
    assert counts.recall == pytest.approx(0.5)
    assert counts.f == pytest.approx(0.5)


def test_the_threshold_is_on_intersection_over_union():
    truth, found = [HERE, HERE], [HERE, THIRD]
    assert scoring.count(truth, found, 0.25).tp == 2
    assert scoring.count(truth, found, 0.5).tp == 1
    assert scoring.count(truth, found, 1 / 3).tp == 1  # it must be exceeded


def test_the_first_frame_is_given():
    assert scoring.count([HERE, HERE], [None, None], 0.25).tp == 1


def test_nothing_found_scores_zero():
    counts = scoring.Counts(0, 0, 5, 0)
    assert (counts.precision, counts.recall, counts.f) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("wait", "found", "failures"), [(0, 1, 0), (24, 1, 0), (25, 0, 0), (151, 0, 1)])
def test_reentries_and_failures(wait, found, failures):
    truth = [HERE] * 3 + [None] * 4 + [HERE] * 200
    boxes = [HERE] * 3 + [None] * 4 + [None] * wait + [THIRD] * (200 - wait)
    result = scoring.score(truth, boxes)
    assert result["reentries"] == 1
    assert result["reentries_found"] == found
    assert result["failures"] == failures


def test_never_found_fails_only_if_there_was_time():
    for length, failures in ((150, 0), (151, 1)):
        result = scoring.score([HERE, None] + [HERE] * length, [HERE, None] + [None] * length)
        assert (result["reentries_found"], result["failures"]) == (0, failures)


def test_boxes_while_absent():
    result = scoring.score([HERE, None, None, None, HERE], [HERE, AWAY, None, HERE, HERE])
    assert (result["frames"], result["absent"], result["boxes_while_absent"]) == (5, 3, 2)
    assert set(result["overlap"]) == {"0.25", "0.5"}
    assert result["overlap"]["0.25"]["tn"] == 1


def test_lengths_must_agree():
    with pytest.raises(ValueError, match="zip"):
        scoring.score([HERE], [HERE, HERE])


def seen(pattern, length):
    """Frames of a pattern like {start: value}, each value held until the next."""
    values = [False] * length
    for start, value in pattern.items():
        values[start:] = [value] * (length - start)
    return values


@pytest.mark.parametrize(
    ("found_from", "found", "failures"),
    [(10, 1, 0), (34, 1, 0), (35, 0, 0), (160, 0, 0), (161, 0, 1), (400, 0, 1)],
)
def test_a_reentry_fails_after_five_seconds_without_the_target(found_from, found, failures):
    in_view = seen({0: True, 5: False, 10: True}, 400)
    overlaps = [0.6 * hit for hit in seen({0: True, 5: False, found_from: True}, 400)]
    assert scoring.recoveries(in_view, overlaps) == {
        "reentries": 1,
        "reentries_found": found,
        "failures": failures,
    }


def test_every_reentry_counts_and_the_last_five_seconds_cannot_fail():
    in_view = seen({0: True, 5: False, 30: True, 60: False, 100: True, 140: False, 200: True}, 265)
    never = [0.0] * 265
    assert scoring.recoveries(in_view, never) == {"reentries": 3, "reentries_found": 0, "failures": 2}
    late = [0.5 * hit for hit in seen({225: True}, 265)]
    assert scoring.recoveries(in_view, late) == {"reentries": 3, "reentries_found": 0, "failures": 1}
