# SPDX-License-Identifier: BSD-3-Clause
"""The target's outline in depth, on made-up scenes: a thing on the ground, in the air, covered, cut off."""

import numpy as np
import pytest
from synthetic_video import Scene, texture

from tld_follower.box import Box
from tld_follower.tld.depth import FIRST_SIZES, HOLD_FRAMES, TargetDepth
from tld_follower.tld.outline import FIRST, Outline, Plane
from tld_follower.tld.parameters import TRACKERS, Parameters
from tld_follower.tld.tracker import Tracker

HEIGHT, WIDTH = 120, 160
TOLERANCE = 0.03
HORIZON, SLOPE = 20.0, 0.008  # row [pixel] and inverse depth a row [1/(m pixel)] of the ground
DISTANCE = 2.0
TARGET = Box(60.0, 52.0, 40.0, 30.0)  # its lower side is where the ground is as far as it
NAN = float("nan")


def ground(height=HEIGHT, width=WIDTH, slope=SLOPE, horizon=HORIZON):
    """Depth map [m] of a plain under an empty sky."""
    inverse = np.maximum(slope * (np.arange(height) + 0.5 - horizon), 0.0)
    with np.errstate(divide="ignore"):
        return np.repeat((1.0 / inverse)[:, None], width, axis=1).astype(np.float32)


def sky(far=np.inf):
    """Depth map [m] of a wall, or of nothing at all."""
    return np.full((HEIGHT, WIDTH), far, np.float32)


def put(depth, box, z):
    """Put a flat thing into a depth map."""
    depth[round(box.y) : round(box.bottom), round(box.x) : round(box.right)] = z
    return depth


def seen(background=ground, box=TARGET, thing=TARGET):
    """What depth says of a target that was boxed and stood still until its outline holds it."""
    target = TargetDepth(Parameters())
    for _ in range(max(FIRST, FIRST_SIZES) + HOLD_FRAMES):
        target.look(put(background(), thing, DISTANCE), HEIGHT, WIDTH)
        target.follow(box, trusted=True)
    return target


def held(target, depth, box=TARGET):
    target.look(depth, HEIGHT, WIDTH)
    return target.hold(box)


def test_the_plane_of_the_ground_is_found_beside_things_and_noise():
    depth = put(put(ground(), TARGET, DISTANCE), Box(0.0, 40.0, 30.0, 50.0), 1.5)
    rng = np.random.default_rng(0)
    depth = (1.0 / (1.0 / depth + rng.normal(0.0, 0.005, depth.shape))).astype(np.float32)
    plane = Plane(TOLERANCE)
    plane.fit(depth, TARGET, 5.0)
    a, b, c = plane.coefficients
    assert abs(a) < 1e-4
    assert b == pytest.approx(SLOPE, rel=0.02)
    assert c == pytest.approx(-SLOPE * HORIZON, abs=0.01)


def test_a_slab_before_everything_is_not_the_plane_behind_it():
    depth = put(put(sky(6.0), TARGET, DISTANCE), Box(0.0, 20.0, 60.0, 90.0), 1.0)
    plane = Plane(TOLERANCE)
    plane.fit(depth, TARGET, 4.0)
    assert plane.coefficients is None
    assert not plane.clear


@pytest.mark.parametrize("depth", [sky(NAN), sky(), sky(0.0), sky(-1.0)])
def test_there_is_no_plane_where_nothing_is_known(depth):
    plane = Plane(TOLERANCE)
    plane.fit(depth, TARGET, 4.0)
    assert plane.coefficients is None
    assert plane.clear


@pytest.mark.parametrize(
    "background",
    [ground, sky, lambda: sky(2.8), lambda: sky(6.0), lambda: sky(NAN)],
    ids=["ground", "air", "near wall", "far wall", "unknown"],
)
def test_a_target_is_held_wherever_it_stands_out(background):
    target = seen(background)
    moved = Box(TARGET.x + 4.0, TARGET.y, TARGET.width, TARGET.height)
    found = held(target, put(background(), moved, DISTANCE))
    assert found.overlap(moved) > 0.9
    assert target.distance == pytest.approx(DISTANCE)


def test_a_turning_target_is_held_at_its_new_shape():
    """Seen from behind first and from its side in the end, in one second."""
    target, box = seen(), TARGET
    for width in np.linspace(40.0, 70.0, 30):
        true = Box(80.0 - 0.5 * round(width), TARGET.y, float(round(width)), TARGET.height)
        box = held(target, put(ground(), true, DISTANCE), box)
        assert box.overlap(true) > 0.85
        target.follow(box, trusted=True)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
def test_an_occluder_ends_the_hold(share):
    cover = Box(TARGET.x, 30.0, share * TARGET.width, 60.0)
    assert held(seen(), put(put(ground(), TARGET, DISTANCE), cover, 1.0)) is None


def test_another_thing_that_joins_it_ends_the_hold():
    beside = Box(TARGET.right - 1.0, TARGET.y - 30.0, 60.0, 60.0)
    assert held(seen(), put(put(ground(), TARGET, DISTANCE), beside, DISTANCE)) is None


def test_a_box_on_bare_ground_is_no_target():
    target = seen()
    assert held(target, ground()) is None
    assert not target.agrees(TARGET)


def test_holes_do_not_matter():
    depth = put(ground(), TARGET, DISTANCE)
    depth[np.random.default_rng(0).random(depth.shape) < 0.3] = NAN
    assert held(seen(), depth).overlap(TARGET) > 0.8


@pytest.mark.parametrize("depth", [None, sky(NAN), sky(), sky(0.0)])
def test_after_a_frame_without_depth_it_must_be_sure_again(depth):
    target, scene = seen(), put(ground(), TARGET, DISTANCE)
    assert held(target, depth) is None
    for _ in range(HOLD_FRAMES):
        assert held(target, scene) is None
        target.follow(TARGET, trusted=True)
    assert held(target, scene) is not None


def test_a_doubtful_box_ends_the_hold():
    target, scene = seen(), put(ground(), TARGET, DISTANCE)
    assert held(target, scene) is not None
    target.follow(TARGET, trusted=False)
    assert held(target, scene) is None


def test_where_depth_ends_the_side_stays_where_it_was_tracked():
    left = Box(20.0, TARGET.y, TARGET.width, TARGET.height)
    target = seen(thing=left, box=left)
    depth = put(ground(), left, DISTANCE)
    depth[:, :30] = NAN  # as left of the first disparity
    found = held(target, depth, left)
    assert found.x == left.x
    assert found.overlap(left) > 0.9


def test_a_part_of_a_thing_has_no_outline():
    target = seen(thing=Box(50.0, 22.0, 60.0, 60.0), box=Box(60.0, 40.0, 24.0, 20.0))
    scene = put(ground(), Box(50.0, 22.0, 60.0, 60.0), DISTANCE)
    assert held(target, scene, Box(60.0, 40.0, 24.0, 20.0)) is None
    assert target.agrees(Box(60.0, 40.0, 24.0, 20.0))


def test_a_flat_target_is_not_taken_for_bare_ground():
    target = TargetDepth(Parameters())
    for _ in range(FIRST + HOLD_FRAMES):
        target.look(ground(), HEIGHT, WIDTH)
        assert target.agrees(TARGET)
        target.follow(TARGET, trusted=True)
    assert held(target, ground()) is None


def test_the_margins_of_the_users_box_are_kept():
    loose = TARGET.scale(1.2)
    found = held(seen(box=loose), put(ground(), TARGET, DISTANCE), loose)
    assert found.overlap(loose) > 0.9


def test_an_outline_is_not_known_before_enough_boxes():
    outline, depth = Outline(TOLERANCE), put(ground(), TARGET, DISTANCE)
    for number in range(FIRST):
        assert not outline.known
        outline.look(depth, TARGET, 4.0)
        outline.learn(depth, TARGET, (1.5, 2.5), DISTANCE)
        assert outline.known == (number + 1 == FIRST)


@pytest.mark.parametrize("name", TRACKERS)
def test_depth_keeps_a_target_whose_look_changes_at_once(name):
    """Without depth it is lost, as every target that suddenly looks like nothing seen before."""
    width, height = 320, 240
    home = Box(100.0, 110.0, 60.0, 50.0)
    scene = Scene(width, height, (60, 50))
    depth = ground(height, width, slope=0.0036, horizon=20.0)
    depth[110:160, 100:160] = DISTANCE
    other = scene.frame(home)
    other[110:160, 100:160] = texture(50, 60, 5)
    kept = []
    for known in (depth, None):
        tracker = Tracker(Parameters(tracker=name))
        tracker.init(scene.frame(home), home, known)
        for _ in range(FIRST + HOLD_FRAMES + 5):
            tracker.update(scene.frame(home), known)
        before = tracker.templates
        results = [tracker.update(other, known) for _ in range(10)]
        kept.append([result.box is not None and result.box.overlap(home) > 0.8 for result in results])
        if known is not None:
            assert tracker.templates > before
    assert all(kept[0])
    assert not kept[1][-1]
