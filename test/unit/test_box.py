# SPDX-License-Identifier: BSD-3-Clause
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tld_follower.box import Box

numbers = st.floats(-500, 500)
sides = st.floats(0.5, 500)
boxes = st.builds(Box, numbers, numbers, sides, sides)


def test_overlap_of_known_boxes():
    box = Box(0, 0, 10, 10)
    assert box.overlap(Box(5, 0, 10, 10)) == pytest.approx(50 / 150)
    assert box.overlap(Box(10, 0, 10, 10)) == 0.0
    assert box.overlap(Box(2, 2, 5, 5)) == pytest.approx(0.25)


@given(boxes, boxes)
def test_overlap_is_symmetric_and_a_fraction(first, second):
    overlap = first.overlap(second)
    assert 0.0 <= overlap <= 1.0 + 1e-9
    assert overlap == pytest.approx(second.overlap(first))
    assert first.overlap(first) == pytest.approx(1.0)


@given(boxes, sides, sides)
def test_clip_lies_inside_the_image_and_the_box(box, width, height):
    part = box.clip(width, height)
    assert 0 <= part.x <= part.right <= width + 1e-9
    assert 0 <= part.y <= part.bottom <= height + 1e-9
    assert part.area == pytest.approx(box.intersection(Box(0, 0, width, height)), abs=1e-6)


def test_clip_of_a_box_outside_is_empty():
    assert Box(-20, 0, 10, 10).clip(100, 100).area == 0.0
    assert Box(-20, 0, 10, 10).inside_fraction(100, 100) == 0.0


@given(boxes, st.floats(0.1, 10))
def test_scale_keeps_the_centre(box, factor):
    scaled = box.scale(factor)
    assert scaled.center == pytest.approx(box.center, abs=1e-6)
    assert scaled.area == pytest.approx(box.area * factor * factor)


def test_finite():
    assert Box(0, 0, 1, 1).finite
    assert not Box(math.nan, 0, 1, 1).finite
    assert not Box(0, 0, math.inf, 1).finite
