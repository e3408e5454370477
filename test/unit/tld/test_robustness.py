# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's tracker meets: reused buffers, other encodings, exits, odd targets and settings."""

import gc
import tracemalloc

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import Scene, moving_box, texture

from tld_follower.box import Box
from tld_follower.tld.parameters import TRACKERS, Parameters
from tld_follower.tld.tracker import Tracker, warm_up

both_trackers = pytest.mark.parametrize("name", TRACKERS)


def started(name="tld", scene=None, box=None, **options):
    scene, box = scene or Scene(), box or moving_box(0)
    tracker = Tracker(Parameters(tracker=name), **options)
    tracker.init(scene.frame(box), box)
    return tracker


@both_trackers
def test_the_caller_may_reuse_its_buffer(name):
    scene, buffer = Scene(), np.empty((120, 160), np.uint8)
    kept, reused = started(name), Tracker(Parameters(tracker=name))
    buffer[:] = scene.frame(moving_box(0))
    reused.init(buffer, moving_box(0))
    for step in range(1, 12):
        buffer[:] = scene.frame(moving_box(step))
        assert reused.update(buffer) == kept.update(scene.frame(moving_box(step)))
        buffer[:] = 0


def test_an_image_is_not_written_to():
    image = Scene().frame(moving_box(0))
    image.setflags(write=False)
    tracker = Tracker()
    tracker.init(image, moving_box(0))
    assert tracker.update(image).visible


@both_trackers
@pytest.mark.parametrize(
    "encode",
    [
        lambda gray: cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR),
        lambda gray: np.repeat(gray, 2, axis=1)[:, ::2],
        lambda gray: np.asfortranarray(gray),
        lambda gray: np.broadcast_to(gray[..., None], (*gray.shape, 3)),
        lambda gray: gray.astype(np.uint16) * 257,
        lambda gray: cv2.cvtColor(gray.astype(np.uint16) << 8, cv2.COLOR_GRAY2BGR)[:, ::-1][:, ::-1],
    ],
    ids=["colour", "strided", "fortran", "broadcast", "16 bit", "16 bit colour strided"],
)
def test_the_same_picture_gives_the_same_result_in_any_layout(name, encode):
    scene = Scene()
    plain, other = started(name), Tracker(Parameters(tracker=name))
    other.init(encode(scene.frame(moving_box(0))), moving_box(0))
    for step in range(1, 8):
        image = scene.frame(moving_box(step))
        assert other.update(encode(image)) == plain.update(image)


@both_trackers
@pytest.mark.parametrize("seed", range(3))
def test_a_target_that_leaves_and_returns_elsewhere(name, seed):
    scene = Scene(240, 180, (44, 38), seed=seed)
    boxes = [Box(120.0 + 6.0 * step, 60.0, 44.0, 38.0) for step in range(21)]
    tracker = started(name, scene, boxes[0], seed=seed)
    for box in boxes[1:]:
        tracker.update(scene.frame(box))
    absent = [tracker.update(scene.frame(None)) for _ in range(30)]
    assert sum(result.visible for result in absent) <= 2
    returned = [Box(10.0 + step, 110.0 - step, 44.0, 38.0) for step in range(20)]
    results = [tracker.update(scene.frame(box)) for box in returned]
    overlaps = [
        result.box.overlap(box) if result.visible else 0.0
        for result, box in zip(results, returned, strict=True)
    ]
    assert min(overlaps[-5:]) > 0.6


@both_trackers
def test_lost_is_said_in_every_field(name):
    tracker = started(name)
    blank = np.zeros((120, 160), np.uint8)
    for _ in range(15):
        result = tracker.update(blank)
        assert (result.box, result.confidence, result.visible) == (None, 0.0, False)
        assert (result.valid, result.source) == (False, "none")
    assert tracker.initialised


def test_a_saturated_picture_is_survived():
    scene, tracker = Scene(), started()
    for step in range(1, 6):
        overexposed = np.where(scene.frame(moving_box(step)) > 60, 255, 0).astype(np.uint8)
        result = tracker.update(overexposed)
        assert result.visible == (result.box is not None)
    results = [tracker.update(scene.frame(moving_box(6))) for _ in range(12)]
    assert results[-1].box.overlap(moving_box(6)) > 0.6


@both_trackers
def test_a_new_target_may_come_in_an_image_of_another_size(name):
    tracker = started(name)
    tracker.update(Scene().frame(moving_box(1)))
    scene, box = Scene(240, 180, (44, 38), seed=4), Box(90.0, 60.0, 44.0, 38.0)
    tracker.init(scene.frame(box), box)
    fresh = started(name, scene, box)
    for step in range(1, 10):
        image = scene.frame(Box(90.0 + step, 60.0, 44.0, 38.0))
        assert tracker.update(image) == fresh.update(image)
    assert tracker.templates == fresh.templates


@both_trackers
@pytest.mark.parametrize(
    ("image", "box"),
    [
        (np.zeros((120, 160), np.float32), moving_box(0)),
        (np.zeros((0, 0), np.uint8), moving_box(0)),
        (texture(120, 160, 3), Box(np.nan, 0, 30, 30)),
        (texture(90, 90, 3), Box(200, 200, 30, 30)),
        (texture(90, 90, 3), Box(10, 10, 3, 3)),
    ],
)
def test_a_refused_target_leaves_the_old_one(name, image, box):
    scene, calm, disturbed = Scene(), started(name), started(name)
    for step in range(1, 6):
        with pytest.raises(ValueError, match=r"image|box|Box"):
            disturbed.init(image, box)
        frame = scene.frame(moving_box(step))
        assert disturbed.update(frame) == calm.update(frame)
    assert disturbed.templates == calm.templates


def test_warming_up_disturbs_no_tracker():
    scene, calm, disturbed = Scene(), started(), started()
    for step in range(1, 4):
        warm_up()
        frame = scene.frame(moving_box(step))
        assert disturbed.update(frame) == calm.update(frame)


@both_trackers
def test_a_target_of_half_the_image_is_followed(name):
    scene = Scene(640, 480, (330, 260))
    boxes = [Box(100.0 + 4 * k, 90.0 + 2 * k, 330.0, 260.0).scale(1.0 + 0.005 * k) for k in range(12)]
    tracker = started(name, scene, boxes[0])
    for box in boxes[1:]:
        assert tracker.update(scene.frame(box)).box.overlap(box) > 0.85


@settings(max_examples=15, deadline=None)
@given(st.data())
def test_odd_settings_and_targets_crash_nothing(data):
    parameters = Parameters(
        tracker=data.draw(st.sampled_from(TRACKERS)),
        min_side=data.draw(st.sampled_from([3.0, 8.0])),
        max_windows=data.draw(st.sampled_from([1, 50, 60000])),
        max_candidates=data.draw(st.sampled_from([1, 100])),
        max_positives=data.draw(st.integers(1, 3)),
        max_negatives=data.draw(st.integers(1, 3)),
        ferns=data.draw(st.integers(1, 3)),
        comparisons=data.draw(st.integers(1, 8)),
        grid_points=data.draw(st.integers(1, 10)),
        scales=data.draw(st.integers(1, 10)),
        sift_views=data.draw(st.integers(1, 3)),
        sift_interval=1,
        warps=1,
        initial_warps=1,
    )
    width, height = data.draw(st.integers(4, 120)), data.draw(st.integers(4, 90))
    side_x = data.draw(st.floats(min(4.0, width), width))
    side_y = data.draw(st.floats(min(4.0, height), height))
    box = Box(
        data.draw(st.floats(0, width - side_x)), data.draw(st.floats(0, height - side_y)), side_x, side_y
    )
    scene = texture(height, width, data.draw(st.integers(0, 3)))
    tracker = Tracker(parameters)
    if min(box.clip(width, height).width, box.clip(width, height).height) < parameters.min_side:
        return
    tracker.init(scene, box)
    for image in (scene, np.roll(scene, 2, axis=1), np.full_like(scene, 255), scene, 255 - scene):
        result = tracker.update(image)
        assert result.visible == (result.box is not None)
        assert 0.0 <= result.confidence <= 1.0
        if result.visible:
            assert result.box.finite
            assert result.box.inside_fraction(width, height) > 0.0


@both_trackers
def test_memory_does_not_grow_over_5000_frames(name):
    """The target turns, leaves and returns in ever new backgrounds: everything that can fill, does."""
    limits = {"max_positives": 20, "max_negatives": 30, "sift_views": 3, "sift_interval": 2}
    scenes = [Scene(96, 72, (24, 20), seed) for seed in range(4)]
    frames = []
    for step in range(250):
        scene = scenes[step // 20 % 4]
        box = moving_box(step % 25, (10.0, 10.0), (24.0, 20.0))
        frames.append(scene.frame(None if step % 50 in (45, 46) else box))
    tracker = Tracker(Parameters(tracker=name, **limits))
    tracker.init(frames[0], Box(10.0, 10.0, 24.0, 20.0))
    tracemalloc.start()
    try:
        sizes = []
        for step in range(1, 5000):
            tracker.update(frames[step % len(frames)])
            if step % 1000 == 999:
                gc.collect()  # also empties the interpreter's free lists, which fill up in between
                sizes.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert tracker.templates <= 50
    assert sizes[-1] < sizes[0] + 200_000
