# SPDX-License-Identifier: BSD-3-Clause
import itertools

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import Scene, texture

from tld_follower.box import Box
from tld_follower.tld.parameters import TRACKERS, Parameters
from tld_follower.tld.stereo_view import Parallax, StereoTracker, View, row_match
from tld_follower.tld.tracker import Tracker

WIDTH, HEIGHT, DISPARITY = 320, 240, 24.0
SIZE = (48.0, 42.0)
SCENE = Scene(WIDTH, HEIGHT, (48, 42))


def shifted(box, shift):
    return Box(box.x + shift, box.y, box.width, box.height)


def pair(box, disparity=DISPARITY):
    """Both images of a target that is in `box` in the left one; the background is far away."""
    if box is None:
        return SCENE.frame(None), SCENE.frame(None)
    return SCENE.frame(box), SCENE.frame(shifted(box, -disparity))


def at(x, y=100.0):
    return Box(x, y, *SIZE)


def started(parameters=None, x=180.0, disparity=DISPARITY):
    """A stereo tracker that has seen its target at rest."""
    tracker = StereoTracker(Tracker(parameters))
    left, right = pair(at(x), disparity)
    tracker.init(left, at(x), right=right)
    for _ in range(5):
        tracker.update(left, right=right)
    return tracker


def play(tracker, places, disparity=DISPARITY):
    results = []
    for box in places:
        left, right = pair(box, disparity)
        results.append((box, tracker.update(left, right=right), tracker.view))
    return results


@pytest.mark.parametrize("name", TRACKERS)
def test_the_right_image_takes_over_and_gives_back(name):
    tracker = started(Parameters(tracker=name))
    # To the place where the left image shows a quarter of the target and the right one three.
    there = [at(180 + 3.0 * step) for step in range(43)]
    results = play(tracker, [*there, *there[::-1]])
    views = [view for *_, view in results]
    assert views[0] is View.LEFT
    assert views[42] is View.RIGHT
    assert views[-1] is View.LEFT
    assert sum(a is not b for a, b in itertools.pairwise(views)) == 2  # it does not flicker
    for box, result, _ in results:
        assert result.visible
        assert result.box.overlap(box) > 0.8
    assert results[42][1].box.right > WIDTH + 30


def test_one_camera_alone_loses_sight_sooner():
    places = [at(180 + 3.0 * step) for step in range(50)]
    alone = Tracker()
    alone.init(pair(at(180))[0], at(180))
    kept = sum(alone.update(pair(box)[0]).visible for box in places)
    both = sum(result.visible for _, result, _ in play(started(), places))
    assert both >= kept + DISPARITY / 3.0 - 2


def test_a_target_wholly_outside_the_left_image_is_reported_where_it_is():
    wide = 70.0
    tracker = started(disparity=wide)
    results = play(tracker, [at(180 + 3.0 * step) for step in range(50)], wide)
    box, result, view = results[-1]
    assert box.x > WIDTH
    assert view is View.RIGHT
    assert result.visible
    assert result.box.overlap(box) > 0.7


def test_disparity_grows_with_the_target():
    tracker = started()
    play(tracker, [at(180 + 3.0 * step) for step in range(36)])
    assert tracker.view is View.RIGHT
    box = at(285.0)
    for step in range(1, 16):
        size = 1.0 + 0.02 * step
        grown = Box.from_center(*box.center, box.width * size, box.height * size)
        ((_, result, _),) = play(tracker, [grown], DISPARITY * size)
    assert result.box.overlap(grown) > 0.8
    assert abs(result.box.center[0] - grown.center[0]) < 4.0


def test_without_right_images_it_is_the_tracker_alone():
    places = [at(60 + 2.5 * step) for step in range(80)]
    alone, wide = Tracker(), StereoTracker(Tracker())
    left = pair(at(60))[0]
    alone.init(left, at(60))
    wide.init(left, at(60))
    frames = [pair(box)[0] for box in places]
    assert [wide.update(frame) for frame in frames] == [alone.update(frame) for frame in frames]


def test_a_lost_target_is_found_again_by_the_right_camera():
    tracker = started()
    play(tracker, [None] * 30)
    hidden = at(285.0)  # a third of it shows in the left image, five sixths in the right one
    results = play(tracker, [hidden] * 8)
    assert results[-1][2] is View.RIGHT
    assert results[-1][1].box.overlap(hidden) > 0.7


def test_a_right_camera_that_dies_costs_only_its_view():
    tracker = started()
    play(tracker, [at(180 + 3.0 * step) for step in range(40)])
    assert tracker.view is View.RIGHT
    back = [at(297 - 3.0 * step) for step in range(40)]
    results = [tracker.update(pair(box)[0]) for box in back]
    assert tracker.view is View.LEFT
    assert results[-1].box.overlap(back[-1]) > 0.7


def test_a_right_image_of_another_size_changes_nothing():
    tracker, twin = started(), started()
    left, right = pair(at(183.0))
    with pytest.raises(ValueError, match="320x240, the right one 160x240"):
        tracker.update(left, right=right[:, :160])
    assert tracker.update(left, right=right) == twin.update(left, right=right)


def test_a_new_target_begins_without_what_was_known_of_another():
    tracker = started()
    left, right = pair(at(60.0))
    with pytest.raises(ValueError, match="outside"):
        tracker.init(left, Box(900, 0, 10, 10), right=right)
    tracker.init(left, at(60.0), right=right)
    assert tracker.view is View.LEFT
    assert play(tracker, [at(62.0)])[0][1].box.overlap(at(62.0)) > 0.8


def test_blank_right_images_are_no_evidence():
    tracker = StereoTracker(Tracker())
    blank = np.full((HEIGHT, WIDTH), 128, np.uint8)
    tracker.init(pair(at(200))[0], at(200), right=blank)
    for step in range(30):
        result = tracker.update(pair(at(200 + 2.0 * step))[0], right=blank)
        assert tracker.view is View.LEFT
        assert result.visible


@settings(max_examples=60, deadline=None)
@given(shift=st.floats(-60, 60), x=st.floats(70, 180), y=st.floats(0, 180), side=st.floats(16, 60))
def test_row_match_finds_the_shift(shift, x, y, side):
    image = texture(HEIGHT, WIDTH, 4)
    matrix = np.array([[1, 0, shift], [0, 1, 0]], np.float64)
    other = cv2.warpAffine(image, matrix, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT)
    found = row_match(image, other, Box(x, y, side, side), [-70.0, 70.0])
    assert found == pytest.approx(shift, abs=0.5)


@settings(max_examples=100, deadline=None)
@given(
    box=st.builds(Box, *[st.floats(-500, 500)] * 2, *[st.floats(0.5, 900)] * 2),
    size=st.tuples(st.integers(1, 60), st.integers(1, 60)),
    seed=st.integers(0, 5),
)
def test_any_box_in_any_image_may_be_measured(box, size, seed):
    rng = np.random.default_rng(seed)
    images = tuple(rng.integers(0, 256, size, np.uint8) for _ in range(2))
    parallax = Parallax()
    for view in View:
        for _ in range(4):
            parallax.measure(view, images, box)
    assert 0.0 <= parallax.of(box) <= 2.0 * np.sqrt(box.area)


def test_disparity_is_known_after_some_measurements_and_survives_a_wrong_one():
    parallax, images = Parallax(), pair(at(200.0))
    assert not parallax.known
    for _ in range(3):
        parallax.measure(View.LEFT, images, at(200.0))
    assert parallax.known
    assert parallax.of(at(200.0)) == pytest.approx(DISPARITY, abs=0.3)
    parallax.measure(View.RIGHT, images, at(200.0 - DISPARITY))
    parallax.measure(View.LEFT, pair(at(200.0), 28.0), at(200.0))
    assert parallax.of(at(200.0)) == pytest.approx(DISPARITY, abs=0.3)


def test_a_disparity_that_is_wrong_for_good_is_measured_anew():
    parallax = Parallax()
    for disparity, views in ((DISPARITY, 5), (70.0, 30)):
        for _ in range(views):
            parallax.measure(View.LEFT, pair(at(200.0), disparity), at(200.0))
    assert parallax.of(at(200.0)) == pytest.approx(70.0, abs=0.5)


def test_a_disparity_is_kept_while_one_camera_cannot_see_the_target():
    parallax = Parallax()
    for _ in range(5):
        parallax.measure(View.LEFT, pair(at(200.0)), at(200.0))
    for _ in range(60):
        parallax.measure(View.RIGHT, pair(at(300.0)), at(300.0 - DISPARITY))
        parallax.measure(View.LEFT, pair(at(10.0)), at(10.0))
    assert parallax.of(at(200.0)) == pytest.approx(DISPARITY, abs=0.5)
