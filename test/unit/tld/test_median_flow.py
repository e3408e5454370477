# SPDX-License-Identifier: BSD-3-Clause
import itertools

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import Scene, texture

from tld_follower.box import Box
from tld_follower.tld import keypoints
from tld_follower.tld.frame import Frame
from tld_follower.tld.median_flow import median_scale, patch_ncc, search, track
from tld_follower.tld.parameters import Parameters

PARAMETERS = Parameters()


def flow(scene, before, after, guess=(0.0, 0.0)):
    first, second = Frame(scene.frame(before), 3.0), Frame(scene.frame(after), 3.0)
    points = keypoints.grid(before, PARAMETERS.grid_points)
    found = track(first, second, before, points, PARAMETERS, guess)
    return found[0] if found else None


@settings(max_examples=25, deadline=None)
@given(st.floats(-6, 6), st.floats(-6, 6), st.floats(0.92, 1.08))
def test_follows_shift_and_scale(dx, dy, scale):
    before = Box(60, 45, 36, 30)
    moved = Box(60 + dx, 45 + dy, 36, 30).scale(scale)
    found = flow(Scene(), before, moved)
    assert found.box.overlap(moved) > 0.9
    assert found.residual < PARAMETERS.max_residual


def test_large_targets_are_followed_to_a_fraction_of_a_pixel():
    scene = Scene(640, 480, (300, 260))
    before = Box(150, 100, 300, 260)
    moved = Box(171, 91.5, 300, 260)
    found = flow(scene, before, moved)
    assert found.box.overlap(moved) > 0.97


def test_a_guess_widens_the_reach():
    scene = Scene(320, 240, (24, 24))
    before, moved = Box(60, 60, 24, 24), Box(130, 95, 24, 24)
    missed = flow(scene, before, moved)
    assert missed is None or missed.box.overlap(moved) < 0.5
    assert flow(scene, before, moved, (68.0, 36.0)).box.overlap(moved) > 0.9


@pytest.mark.parametrize("side", [20, 60, 150])
@pytest.mark.parametrize(("dx", "dy"), [(1.2, -0.4), (-1.7, 1.1), (0.0, 0.0)])
def test_a_target_is_seen_again_within_two_sides(side, dx, dy):
    scene = Scene(900, 700, (side, side))
    before = Box(330.0, 270.0, side, side)
    moved = Box(330.0 + dx * side, 270.0 + dy * side, side, side)
    found = search(Frame(scene.frame(before), 3.0), Frame(scene.frame(moved), 3.0), before)
    assert found == pytest.approx((dx * side, dy * side), abs=0.08 * side + 1.0)


@pytest.mark.parametrize(
    "box", [Box(-50, -50, 30, 30), Box(70, 50, 40, 40), Box(30, 30, 3, 3), Box(10, 10, 60, 40)]
)
def test_a_search_without_a_picture_says_no_move(box):
    blank = Frame(np.full((60, 80), 90, np.uint8), 3.0)
    assert search(blank, Frame(texture(60, 80, 1), 3.0), box) == (0.0, 0.0)


def test_no_flow_where_the_target_vanished():
    before = Box(60, 45, 36, 30)
    found = flow(Scene(), before, None)
    assert found is None or found.residual > PARAMETERS.max_residual or found.box.overlap(before) > 0.8


@pytest.mark.parametrize("value", [0, 255])
def test_blank_frames(value):
    blank = Frame(np.full((60, 80), value, np.uint8), 3.0)
    box = Box(20, 20, 20, 20)
    found = track(blank, blank, box, keypoints.grid(box, 10), PARAMETERS)
    assert all(one.box.finite for one in found)


@settings(max_examples=40, deadline=None)
@given(st.floats(-30, 90), st.floats(-30, 70), st.floats(2, 120), st.floats(2, 90))
def test_any_box_gives_finite_flows(x, y, width, height):
    frames = [Frame(texture(48, 64, seed), 3.0) for seed in (0, 1)]
    box = Box(x, y, width, height)
    found = track(*frames, box, keypoints.grid(box, 10), PARAMETERS)
    assert all(one.box.finite for one in found)


def narrow(step):
    """A small target that walks over a background at rest, and the wide box about it."""
    target = Box(60.0 + 5.0 * step, 45.0, 18.0, 30.0)
    return Frame(Scene(target=(18, 30)).frame(target), 3.0), Box.from_center(*target.center, 44.0, 34.0)


def test_a_target_that_fills_little_of_its_box_has_a_motion_of_its_own():
    (first, before), (second, after) = narrow(0), narrow(1)
    found = track(first, second, before, keypoints.grid(before, PARAMETERS.grid_points), PARAMETERS)
    assert len(found) == 2
    assert abs(found[0].box.center[0] - before.center[0]) < 1.0
    assert found[1].box.center == pytest.approx(after.center, abs=0.5)


def test_where_all_moves_together_there_is_one_motion():
    first, second = (Frame(np.roll(texture(120, 160, 3), step, axis=1), 3.0) for step in (0, 4))
    box = Box(60.0, 45.0, 36.0, 30.0)
    found = track(first, second, box, keypoints.grid(box, PARAMETERS.grid_points), PARAMETERS)
    assert len(found) == 1
    assert found[0].box.center[0] == pytest.approx(box.center[0] + 4.0, abs=0.2)


def test_median_scale_matches_the_reference():
    rng = np.random.default_rng(0)
    start = rng.uniform(0, 50, (30, 2)).astype(np.float32)
    end = (1.3 * start + rng.normal(0, 0.5, (30, 2))).astype(np.float32)
    pairs = list(itertools.combinations(range(30), 2))
    ratios = [np.linalg.norm(end[i] - end[j]) / np.linalg.norm(start[i] - start[j]) for i, j in pairs]
    assert median_scale(start, end) == pytest.approx(np.median(ratios), rel=1e-5)
    assert median_scale(np.zeros((5, 2), np.float32), end[:5]) == 1.0


def test_patch_ncc_matches_the_reference():
    before, after = texture(60, 60, 0), texture(60, 60, 1)
    rng = np.random.default_rng(0)
    start, end = rng.uniform(10, 50, (2, 20, 2)).astype(np.float32)
    result = patch_ncc(before, after, start, end, 10)
    for a, b, ncc in zip(start, end, result, strict=True):
        first, second = (
            cv2.getRectSubPix(image.astype(np.float32), (10, 10), tuple(map(float, point)))
            for image, point in ((before, a), (after, b))
        )
        assert ncc == pytest.approx(np.corrcoef(first.ravel(), second.ravel())[0, 1], abs=2e-3)


def test_patch_ncc_without_contrast_is_zero():
    points = np.array([[5.0, 5.0]], np.float32)
    assert patch_ncc(np.zeros((20, 20), np.uint8), texture(20, 20, 0), points, points, 10)[0] == 0.0


def test_grid_spreads_over_the_box():
    points = keypoints.grid(Box(10, 20, 40, 60), 10)
    assert points.shape == (100, 2)
    np.testing.assert_allclose(points.min(axis=0), [12, 23])
    np.testing.assert_allclose(points.max(axis=0), [48, 77])
