# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from synthetic_video import Scene, moving_box

from tld_follower.box import Box
from tld_follower.tld.alignment import align, blend
from tld_follower.tld.frame import Frame
from tld_follower.tld.object_model import ObjectModel

TRUTH = moving_box(0)
FRAME = Frame(Scene().frame(TRUTH), 3.0)


@pytest.fixture
def model():
    model = ObjectModel(10, 10)
    model.positives.add(FRAME.patches(np.array([TRUTH.as_tuple()]))[0])
    return model


@pytest.mark.parametrize("offset", [(2.0, 0.0, 1.0), (-2.0, 2.0, 1.0), (1.0, -2.0, 1.06), (0.0, 0.0, 0.94)])
def test_a_drifted_box_comes_back(model, offset):
    dx, dy, scale = offset
    x, y = TRUTH.center
    drifted = Box.from_center(x + dx, y + dy, TRUTH.width * scale, TRUTH.height * scale)
    aligned, similarity = align(FRAME, model, drifted, 0.06)
    before = model.positive_similarity(FRAME.patches(np.array([drifted.as_tuple()])))[0]
    assert aligned.overlap(TRUTH) > drifted.overlap(TRUTH)
    assert similarity > before
    after = model.positive_similarity(FRAME.patches(np.array([aligned.as_tuple()])))[0]
    assert similarity == pytest.approx(after, abs=1e-5)


def test_the_true_box_stays(model):
    aligned, similarity = align(FRAME, model, TRUTH, 0.06)
    assert aligned.as_tuple() == pytest.approx(TRUTH.as_tuple(), abs=1e-6)
    assert similarity == pytest.approx(1.0, abs=1e-5)


def test_without_contrast_the_box_stays_as_it_is(model):
    blank = Frame(np.full((120, 160), 128, np.uint8), 3.0)
    aligned, similarity = align(blank, model, TRUTH, 0.06)
    assert aligned.as_tuple() == pytest.approx(TRUTH.as_tuple())
    assert similarity == pytest.approx(0.5)


@pytest.mark.parametrize("box", [Box(-30, -20, 32, 28), Box(150, 110, 32, 28), Box(400, 0, 32, 28)])
def test_boxes_over_the_edge_crash_nothing(model, box):
    aligned, similarity = align(FRAME, model, box, 0.06)
    assert aligned.finite
    assert 0.0 <= similarity <= 1.0


def test_blending_is_linear():
    box, other = Box(0, 0, 10, 20), Box(4, 8, 20, 10)
    assert blend(box, other, 0.0) == box
    assert blend(box, other, 1.0) == other
    assert blend(box, other, 0.25).as_tuple() == pytest.approx((1, 2, 12.5, 17.5))
