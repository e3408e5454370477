# SPDX-License-Identifier: BSD-3-Clause
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tld_follower.box import Box
from tld_follower.tld.depth import FIRST_SIZES, TargetDepth
from tld_follower.tld.parameters import Parameters

HEIGHT, WIDTH = 120, 160
BACKGROUND = 6.0
TARGET = Box(60.0, 40.0, 40.0, 30.0)


def scene(*things, background=BACKGROUND, noise=0.0, seed=0):
    """Depth map [m] of flat things: pairs of a box and its depth, the later ones in front."""
    depth = np.full((HEIGHT, WIDTH), background, np.float32)
    for box, z in things:
        depth[round(box.y) : round(box.bottom), round(box.x) : round(box.right)] = z
    error = np.random.default_rng(seed).normal(0.0, noise, depth.shape).astype(np.float32)
    return 1.0 / (1.0 / depth + error)


def look(target, depth):
    target.look(depth, HEIGHT, WIDTH)


def seen(frames=FIRST_SIZES, distance=2.0, **parameters):
    """A target that was watched for some frames at one distance."""
    target = TargetDepth(Parameters(**parameters))
    for _ in range(frames):
        look(target, scene((TARGET, distance)))
        target.follow(TARGET, trusted=True)
    return target


def test_size_and_distance_are_learnt():
    target = seen()
    assert target.distance == 2.0
    assert target.size == pytest.approx(2.0 * math.sqrt(TARGET.area), rel=1e-6)


def test_one_size_is_not_yet_a_size():
    assert seen(FIRST_SIZES - 1).size is None


def test_the_background_about_a_target_is_not_taken_for_it():
    target = TargetDepth(Parameters())
    look(target, scene((TARGET, 2.0)))
    target.follow(TARGET.scale(1.3), trusted=True)
    assert target.distance == 2.0


def test_wrong_frames_do_not_move_the_size_far():
    target = seen(3 * FIRST_SIZES)
    before = target.size
    look(target, scene((TARGET, 2.0)))
    target.follow(TARGET.scale(1.4), trusted=True)
    assert target.size == pytest.approx(1.01 * before)


def test_the_size_of_a_doubtful_box_is_not_learnt():
    target = seen(FIRST_SIZES - 1)
    look(target, scene((TARGET, 2.0)))
    target.follow(TARGET, trusted=False)
    assert target.size is None


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_a_look_alike_of_another_size_is_rejected(ratio):
    """It fills the same pixels at another distance, and has had the time to get there."""
    target = seen()
    for _ in range(100):
        look(target, None)
    elsewhere = Box(10.0, 70.0, TARGET.width, TARGET.height)
    look(target, scene((elsewhere, 2.0 * ratio)))
    assert not target.agrees(elsewhere)
    look(target, scene((elsewhere, 2.0)))
    assert target.agrees(elsewhere)


@pytest.mark.parametrize("ratio", [0.5, 1.8])
def test_a_look_alike_at_another_distance_is_rejected_until_the_target_may_be_there(ratio):
    target = seen()
    elsewhere = Box(10.0, 70.0, TARGET.width / ratio, TARGET.height / ratio)
    depth = scene((elsewhere, 2.0 * ratio))
    look(target, depth)
    assert not target.agrees(elsewhere)
    for _ in range(30):
        look(target, depth)
    assert target.agrees(elsewhere)


def test_a_box_of_the_wrong_size_for_its_own_depth_is_rejected():
    target = seen()
    look(target, scene((TARGET, 2.0)))
    assert target.agrees(TARGET)
    assert target.agrees(TARGET.scale(1.3))
    assert not target.agrees(TARGET.scale(0.4))


def test_a_target_that_comes_nearer_agrees_all_the_way():
    target = seen(distance=4.0)
    for frame in range(1, 60):
        distance = 4.0 - 0.05 * frame
        box = Box.from_center(80.0, 60.0, 160.0 / distance, 120.0 / distance)
        look(target, scene((box, distance), noise=0.01, seed=frame))
        assert target.agrees(box)
        assert not target.occluded(box)
        target.follow(box, trusted=True)
    assert target.distance == pytest.approx(1.05, rel=0.05)
    assert target.size == pytest.approx(4.0 * math.sqrt(TARGET.area), rel=0.1)


@pytest.mark.parametrize(("share", "occluded"), [(0.0, False), (0.1, False), (0.4, True), (0.9, True)])
def test_something_before_the_target_is_noticed(share, occluded):
    target = seen()
    cover = Box(TARGET.x, TARGET.y, share * TARGET.width, TARGET.height)
    look(target, scene((TARGET, 2.0), (cover, 1.0), noise=0.01))
    assert target.occluded(TARGET) == occluded


def test_something_behind_the_target_occludes_nothing():
    target = seen()
    uncovered = Box(TARGET.x, TARGET.y, 0.5 * TARGET.width, TARGET.height)
    look(target, scene((TARGET, 2.0), (uncovered, 5.0)))
    assert not target.occluded(TARGET)
    assert target.agrees(TARGET)


def test_an_occluder_alone_is_not_the_target():
    target = seen()
    look(target, scene((TARGET, 1.0)))
    assert not target.agrees(TARGET)


def test_the_farther_the_target_the_more_may_its_depth_be_wrong():
    """Half a metre off is much at 2 m and nothing at 5 m, where stereo errs by as much."""
    for distance, occluded in ((2.0, True), (5.0, False)):
        target = seen(distance=distance)
        look(target, scene((TARGET, distance - 0.6)))
        assert target.occluded(TARGET) == occluded


NOTHING = {
    "none": None,
    "nan": np.full((HEIGHT, WIDTH), np.nan, np.float32),
    "infinite": np.full((HEIGHT, WIDTH), np.inf, np.float32),
    "zero": np.zeros((HEIGHT, WIDTH), np.float32),
    "behind the camera": np.full((HEIGHT, WIDTH), -1.0, np.float32),
}


@pytest.mark.parametrize("depth", NOTHING.values(), ids=NOTHING.keys())
def test_without_depth_nothing_is_held_against_a_box(depth):
    target = seen()
    look(target, depth)
    for box in (TARGET, TARGET.scale(0.1), TARGET.scale(5.0), Box(-500.0, 0.0, 10.0, 10.0)):
        assert target.agrees(box)
        assert not target.occluded(box)
        target.follow(box, trusted=True)
    assert target.distance == 2.0


def test_sparse_depth_says_nothing():
    target = seen()
    depth = scene((TARGET, 1.0))
    depth[np.random.default_rng(0).random(depth.shape) < 0.95] = np.nan
    look(target, depth)
    assert target.agrees(TARGET)
    assert not target.occluded(TARGET)


def test_points_on_what_stands_before_the_target_are_left_out():
    target = seen()
    cover = Box(TARGET.x, TARGET.y, 10.0, TARGET.height)
    covered, free, outside = [65.0, 50.0], [90.0, 50.0], [500.0, -20.0]
    points = np.array([covered, free, outside], np.float32)
    look(target, scene((TARGET, 2.0), (cover, 1.0)))
    np.testing.assert_array_equal(target.uncovered(points), points)  # they lie in the frame before
    look(target, scene((TARGET, 2.0)))
    np.testing.assert_array_equal(target.uncovered(points), points[1:])
    look(target, scene((TARGET, 2.0), (cover, 1.0)))
    target.leave_view()
    look(target, None)
    np.testing.assert_array_equal(target.uncovered(points), points)


@pytest.mark.parametrize("depth", [np.ones((60, 80), np.float32), np.ones((HEIGHT, WIDTH), np.uint16)])
def test_a_map_of_another_kind_is_refused(depth):
    target = seen()
    with pytest.raises(ValueError, match="depth map"):
        look(target, depth)
    assert target.agrees(TARGET)


coordinates = st.floats(-400.0, 400.0)
boxes = st.builds(Box, coordinates, coordinates, st.floats(0.01, 500.0), st.floats(0.01, 500.0))
maps = arrays.arrays(np.float32, (HEIGHT, WIDTH), elements=st.floats(width=32), fill=st.floats(width=32))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(maps, boxes), min_size=1, max_size=4))
def test_any_depth_and_any_box_are_taken(frames):
    target = seen(FIRST_SIZES - 1)
    for depth, box in frames:
        look(target, depth)
        target.agrees(box)
        target.occluded(box)
        target.follow(box, trusted=True)
    assert 0.0 < target.distance < math.inf
    assert target.size is None or 0.0 < target.size < math.inf


@settings(max_examples=40, deadline=None)
@given(st.floats(0.5, 8.0), st.floats(0.7, 1.4), st.integers(0, 1000))
def test_no_scale_of_depth_and_no_noise_within_the_error_rejects_the_target(distance, ratio, seed):
    target = TargetDepth(Parameters())
    for frame in range(2 * FIRST_SIZES):
        look(target, scene((TARGET, distance), background=2.0 * distance, noise=0.02, seed=seed + frame))
        box = TARGET.scale(ratio) if frame % 5 == 4 else TARGET
        assert target.agrees(box)
        assert not target.occluded(TARGET)
        target.follow(box, trusted=True)
