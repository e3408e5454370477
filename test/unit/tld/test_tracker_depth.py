# SPDX-License-Identifier: BSD-3-Clause
"""The tracker with depth: the same images, told apart by how far things are."""

import numpy as np
import pytest
from synthetic_video import Scene, moving_box, texture

from tld_follower.box import Box
from tld_follower.tld.parameters import TRACKERS, Parameters
from tld_follower.tld.tracker import Tracker

WIDTH, HEIGHT = 320, 240
DISTANCE, BACKGROUND = 2.0, 6.0
HOME, ELSEWHERE = Box(60.0, 60.0, 48.0, 42.0), Box(200.0, 150.0, 48.0, 42.0)


def depth_map(*things):
    """Depth [m] of flat things, pairs of a box and its depth, the later ones in front."""
    depth = np.full((HEIGHT, WIDTH), BACKGROUND, np.float32)
    for box, z in things:
        depth[round(box.y) : round(box.bottom), round(box.x) : round(box.right)] = z
    return depth


def watched(name, frames=15):
    """A tracker that has seen its target at rest, and the scene."""
    scene, tracker = Scene(WIDTH, HEIGHT, (48, 42)), Tracker(Parameters(tracker=name))
    depth = depth_map((HOME, DISTANCE))
    tracker.init(scene.frame(HOME), HOME, depth)
    for _ in range(frames):
        assert tracker.update(scene.frame(HOME), depth).box.overlap(HOME) > 0.9
    return tracker, scene


@pytest.mark.parametrize("name", TRACKERS)
@pytest.mark.parametrize(("distance", "taken"), [(DISTANCE, True), (2.0 * DISTANCE, False)])
def test_only_a_look_alike_of_the_right_size_is_taken_for_the_target(name, distance, taken):
    tracker, scene = watched(name)
    for _ in range(40):
        tracker.update(scene.frame(None), depth_map())
    depth = depth_map((ELSEWHERE, distance))
    results = [tracker.update(scene.frame(ELSEWHERE), depth) for _ in range(10)]
    assert any(result.visible for result in results) == taken


@pytest.mark.parametrize("name", TRACKERS)
def test_the_box_does_not_go_with_what_passes_before_the_target(name):
    tracker, scene = watched(name)
    cover = texture(80, 80, 7, 3.0)
    for left in range(-80, 240, 4):
        image, depth = scene.frame(HOME), depth_map((HOME, DISTANCE))
        columns = slice(max(0, left), max(0, left + 80))
        image[40:120, columns] = cover[:, max(0, -left) : max(0, -left) + columns.stop - columns.start]
        depth[40:120, columns] = 0.5 * DISTANCE
        result = tracker.update(image, depth)
        if result.visible:
            assert result.box.overlap(HOME) > 0.6
    assert result.visible


def test_nothing_is_learnt_while_something_stands_before_the_target():
    tracker, scene = watched("tld")
    before = tracker.templates
    cover = Box(HOME.x, HOME.y, 0.3 * HOME.width, HOME.height)
    image = scene.frame(HOME)
    image[60:102, 60:74] = texture(42, 14, 9)
    for _ in range(10):
        tracker.update(image, depth_map((HOME, DISTANCE), (cover, 0.6 * DISTANCE)))
    assert tracker.templates == before


@pytest.mark.parametrize("name", TRACKERS)
def test_unknown_depth_changes_nothing(name):
    scene = Scene(WIDTH, HEIGHT)
    unknown = np.full((HEIGHT, WIDTH), np.nan, np.float32)
    runs = []
    for depth in (None, unknown, np.full_like(unknown, np.inf)):
        tracker = Tracker(Parameters(tracker=name))
        tracker.init(scene.frame(moving_box(0)), moving_box(0), depth)
        frames = [scene.frame(moving_box(step) if step < 12 else None) for step in range(1, 20)]
        runs.append([tracker.update(frame, depth) for frame in frames])
    assert runs[0] == runs[1] == runs[2]


def test_a_depth_map_of_another_size_is_refused_and_tracking_goes_on():
    tracker, scene = watched("tld")
    with pytest.raises(ValueError, match="depth map"):
        tracker.update(scene.frame(HOME), depth_map()[::2, ::2])
    with pytest.raises(ValueError, match="depth map"):
        tracker.init(scene.frame(ELSEWHERE), ELSEWHERE, depth_map()[:, :, None])
    assert tracker.update(scene.frame(HOME), depth_map((HOME, DISTANCE))).box.overlap(HOME) > 0.9
