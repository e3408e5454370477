# SPDX-License-Identifier: BSD-3-Clause
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import Scene, moving_box, texture

from tld_follower.box import Box
from tld_follower.tld.parameters import TRACKERS, Parameters
from tld_follower.tld.tracker import Tracker

STEPS = 25


def play(tracker, scene, steps=STEPS):
    """Results for the moving target, from its first frame on."""
    tracker.init(scene.frame(moving_box(0)), moving_box(0))
    return [tracker.update(scene.frame(moving_box(step))) for step in range(1, steps)]


@pytest.mark.parametrize("name", TRACKERS)
def test_follows_a_moving_target(name):
    results = play(Tracker(Parameters(tracker=name)), Scene())
    for step, result in enumerate(results, 1):
        assert result.visible
        assert result.box.overlap(moving_box(step)) > 0.85
        assert 0.0 <= result.confidence <= 1.0
        assert result.source == "tracker"
    assert results[-1].valid


@pytest.mark.parametrize("name", TRACKERS)
def test_says_lost_and_finds_the_target_again(name):
    scene, tracker = Scene(320, 240, (48, 42)), Tracker(Parameters(tracker=name))
    first = Box(60, 60, 48, 42)
    tracker.init(scene.frame(first), first)
    for step in range(1, 10):
        tracker.update(scene.frame(Box(60 + step, 60, 48, 42)))
    absent = [tracker.update(scene.frame(None)) for _ in range(30)]
    assert not any(result.visible for result in absent[5:])
    assert absent[-1].box is None
    assert absent[-1].confidence == 0.0
    assert absent[-1].source == "none"
    back = Box(200, 150, 48, 42)
    returned = [tracker.update(scene.frame(back)) for _ in range(5)]
    assert returned[-1].box.overlap(back) > 0.7
    assert "detector" in [result.source for result in returned] or returned[-1].visible


def test_a_target_that_leaves_at_the_side_is_kept_while_it_shows():
    scene, tracker = Scene(), Tracker()
    tracker.init(scene.frame(moving_box(0)), moving_box(0))
    for step in range(1, 14):
        box = Box(40.0 - 4.0 * step, 40.0, 32, 28)
        result = tracker.update(scene.frame(box))
        if box.x > -12:
            assert result.box.overlap(box) > 0.6


def test_is_the_same_for_the_same_seed():
    scene = Scene()
    runs = [play(Tracker(seed=3), scene) for _ in range(2)]
    assert runs[0] == runs[1]
    again = Tracker(seed=3)
    play(again, Scene(seed=9))
    assert play(again, scene) == runs[0]


def test_two_trackers_do_not_disturb_each_other():
    scenes = Scene(seed=0), Scene(seed=5)
    alone = [play(Tracker(), scene) for scene in scenes]
    trackers = Tracker(), Tracker()
    for tracker, scene in zip(trackers, scenes, strict=True):
        tracker.init(scene.frame(moving_box(0)), moving_box(0))
    together = [
        [
            tracker.update(scene.frame(moving_box(step)))
            for tracker, scene in zip(trackers, scenes, strict=True)
        ]
        for step in range(1, STEPS)
    ]
    assert [list(results) for results in zip(*together, strict=True)] == alone


def test_a_new_target_replaces_the_old():
    scene, tracker = Scene(320, 240, (40, 40)), Tracker()
    first = Box(30, 30, 40, 40)
    tracker.init(scene.frame(first), first)
    tracker.update(scene.frame(first))
    background = Box(200, 140, 60, 50)
    tracker.init(scene.frame(first), background)
    results = [tracker.update(scene.frame(first)) for _ in range(5)]
    assert all(result.box.overlap(background) > 0.9 for result in results)


def test_without_learning_the_model_stays():
    tracker = Tracker(Parameters(learning=False))
    scene = Scene()
    tracker.init(scene.frame(moving_box(0)), moving_box(0))
    before = tracker.templates
    for step in range(1, 10):
        tracker.update(scene.frame(moving_box(step, speed=(2.0, 0.5))))
    assert tracker.templates == before
    tracker.learning = True
    for seed in range(3):
        tracker.update(texture(120, 160, seed))
    assert tracker.templates >= before


@pytest.mark.parametrize("value", [0, 128, 255])
def test_blank_frames_are_lost_frames(value):
    scene, tracker = Scene(), Tracker()
    tracker.init(scene.frame(moving_box(0)), moving_box(0))
    for _ in range(3):
        result = tracker.update(np.full((120, 160), value, np.uint8))
    assert not result.visible
    recovered = [tracker.update(scene.frame(moving_box(1))) for _ in range(4)]
    assert recovered[-1].box.overlap(moving_box(1)) > 0.7


def test_a_blank_target_is_taken():
    tracker = Tracker()
    blank = np.full((90, 120), 200, np.uint8)
    tracker.init(blank, Box(30, 30, 20, 20))
    for _ in range(3):
        tracker.update(blank)
    tracker.update(texture(90, 120, 0))


def test_noise_is_not_the_target():
    scene, tracker = Scene(), Tracker()
    tracker.init(scene.frame(moving_box(0)), moving_box(0))
    rng = np.random.default_rng(0)
    results = [tracker.update(rng.integers(0, 256, (120, 160), np.uint8)) for _ in range(20)]
    assert sum(result.visible for result in results) <= 1


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_any_image_and_box(data):
    width, height = data.draw(st.integers(16, 300)), data.draw(st.integers(16, 200))
    colour, strided = data.draw(st.booleans()), data.draw(st.booleans())
    corner = st.floats(-20, 300)
    box = Box(
        data.draw(corner), data.draw(corner), data.draw(st.floats(1, 300)), data.draw(st.floats(1, 300))
    )
    parameters = Parameters(tracker=data.draw(st.sampled_from(TRACKERS)), max_windows=3000)
    rng = np.random.default_rng(data.draw(st.integers(0, 5)))

    def image():
        shape = (2 * height, width, 3) if colour else (2 * height, width)
        pixels = rng.integers(0, 256, shape, np.uint8)
        return pixels[::-2] if strided else np.ascontiguousarray(pixels[:height])

    tracker = Tracker(parameters)
    inside = box.clip(width, height)
    if min(inside.width, inside.height) < parameters.min_side:
        with pytest.raises(ValueError, match=r"outside|sides"):
            tracker.init(image(), box)
        assert not tracker.initialised
        return
    tracker.init(image(), box)
    for _ in range(2):
        result = tracker.update(image())
        assert result.visible == (result.box is not None)
        assert result.box is None or (result.box.finite and result.box.area > 0)


class TestRefusals:
    IMAGE = texture(120, 160, 0)

    @pytest.mark.parametrize(
        ("box", "message"),
        [
            (Box(200, 10, 30, 30), "outside the image of 160x120"),
            (Box(-40, 10, 30, 30), "outside the image"),
            (Box(10, 10, -30, 30), "outside the image"),
            (Box(10, 10, 30, 4), "at least 8 pixels"),
            (Box(155, 10, 30, 30), "at least 8 pixels"),
            (Box(math.nan, 10, 30, 30), "finite"),
            (Box(10, 10, math.inf, 30), "finite"),
        ],
    )
    def test_boxes(self, box, message):
        tracker = Tracker()
        with pytest.raises(ValueError, match=message):
            tracker.init(self.IMAGE, box)
        assert not tracker.initialised

    def test_images(self):
        with pytest.raises(ValueError, match="uint8"):
            Tracker().init(self.IMAGE.astype(np.int32), Box(10, 10, 30, 30))

    def test_update_before_init(self):
        with pytest.raises(RuntimeError, match="init"):
            Tracker().update(self.IMAGE)

    def test_a_refused_image_changes_nothing(self):
        scene = Scene()
        calm, disturbed = Tracker(), Tracker()
        for tracker in (calm, disturbed):
            tracker.init(scene.frame(moving_box(0)), moving_box(0))
        for step in range(1, 6):
            with pytest.raises(ValueError, match="160x100"):
                disturbed.update(scene.frame(None)[:100])
            with pytest.raises(ValueError, match="uint8"):
                disturbed.update(scene.frame(None).astype(float))
            frame = scene.frame(moving_box(step))
            assert calm.update(frame) == disturbed.update(frame)

    def test_a_refused_target_changes_nothing(self):
        scene = Scene()
        tracker = Tracker()
        tracker.init(scene.frame(moving_box(0)), moving_box(0))
        with pytest.raises(ValueError, match="outside"):
            tracker.init(scene.frame(None), Box(500, 500, 30, 30))
        assert tracker.update(scene.frame(moving_box(1))).box.overlap(moving_box(1)) > 0.8


def test_the_model_stays_within_its_bounds():
    parameters = Parameters(max_positives=6, max_negatives=8, warps=1, initial_warps=2)
    tracker = Tracker(parameters)
    scene = Scene()
    tracker.init(scene.frame(moving_box(0)), moving_box(0))
    rng = np.random.default_rng(0)
    for step in range(1, 200):
        box = moving_box(0.2 * step)
        image = scene.frame(box)
        noise = rng.normal(0, 20, image.shape) + 30 * np.sin(0.3 * step)
        tracker.update(np.clip(image + noise, 0, 255).astype(np.uint8))
        assert tracker.templates <= 14
