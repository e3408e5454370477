# SPDX-License-Identifier: BSD-3-Clause
import cv2
import numpy as np
import pytest
from synthetic_video import texture

from tld_follower.box import Box
from tld_follower.tld.frame import Frame
from tld_follower.tld.keypoints import SiftKeypoints
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.redetection import SiftMemory, Witness, search_tiles

BLUR = 3.0
BOX = Box(100.0, 80.0, 80.0, 70.0)


def moved(image, dx, dy, scale):
    """The image shifted, and scaled about its centre."""
    height, width = image.shape
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, scale)
    matrix[:, 2] += dx, dy
    return cv2.warpAffine(image, matrix, (width, height))


def memory(views=10, interval=1):
    parameters = Parameters(sift_views=views, sift_interval=interval, sift_pixels=10**6)
    return SiftMemory(SiftKeypoints(200, 96.0), parameters)


def view(seed):
    """A frame with a target in BOX that differs from seed to seed."""
    image = texture(240, 320, 500, 4.0)
    image[80:150, 100:180] = texture(70, 80, seed)
    return image


def elsewhere(seed, dx, dy, scale):
    """The same target moved and scaled, and its box."""
    height, width = 240, 320
    x, y = BOX.center
    place = width / 2 + scale * (x - width / 2) + dx, height / 2 + scale * (y - height / 2) + dy
    truth = Box.from_center(*place, BOX.width * scale, BOX.height * scale)
    image = texture(height, width, 501, 4.0)
    columns, rows = (slice(int(a), int(b)) for a, b in ((truth.x, truth.right), (truth.y, truth.bottom)))
    image[rows, columns] = moved(view(seed), dx, dy, scale)[rows, columns]
    return Frame(image, BLUR), truth


@pytest.mark.parametrize(
    "motion", [(0.0, 0.0, 1.0), (70.0, -30.0, 1.0), (-60.0, 40.0, 1.3), (40.0, 40.0, 0.75)]
)
def test_the_target_is_found_elsewhere_and_in_another_size(motion):
    known = memory()
    known.learn(Frame(view(0), BLUR), BOX)
    frame, truth = elsewhere(0, *motion)
    assert known.propose(frame, BOX, 0).overlap(truth) > 0.75


def test_no_proposal_without_the_target():
    known = memory()
    known.learn(Frame(view(0), BLUR), BOX)
    for image in (texture(240, 320, 9), view(1), np.full((240, 320), 255, np.uint8)):
        assert known.propose(Frame(image, BLUR), BOX, 0) is None


def test_no_proposal_without_a_memory():
    assert memory().propose(Frame(view(0), BLUR), BOX, 0) is None
    blank = memory()
    blank.learn(Frame(np.zeros((240, 320), np.uint8), BLUR), BOX)
    assert blank.propose(Frame(view(0), BLUR), BOX, 0) is None


def test_a_full_memory_keeps_the_first_view_and_the_last_ones():
    known = memory(views=3)
    for seed in range(6):
        known.learn(Frame(view(seed), BLUR), BOX)
    found = [known.propose(Frame(view(seed), BLUR), BOX, 0) is not None for seed in range(6)]
    assert found == [True, False, False, False, True, True]


def test_only_one_call_in_an_interval_is_remembered():
    known = memory(interval=3)
    for seed in range(5):
        known.learn(Frame(view(seed), BLUR), BOX)
    found = [known.propose(Frame(view(seed), BLUR), BOX, 0) is not None for seed in range(5)]
    assert found == [True, False, False, True, False]


def asked(known, frame, box):
    return known.ask(*SiftKeypoints(200, 96.0).around(frame, box), box, trusted=False)


def test_the_keypoints_speak_for_the_target_and_against_another():
    known = memory()
    known.learn(Frame(view(0), BLUR), BOX)
    frame, truth = elsewhere(0, 70.0, -30.0, 1.0)
    assert asked(known, frame, truth) is Witness.FOR
    assert asked(known, Frame(view(1), BLUR), BOX) is Witness.AGAINST
    # The same keypoints in other places are no target.
    assert asked(known, frame, Box(truth.x - 60.0, truth.y, truth.width, truth.height)) is Witness.AGAINST


def test_a_target_without_keypoints_says_nothing():
    blank = Frame(np.full((240, 320), 90, np.uint8), BLUR)
    known = memory()
    assert asked(known, blank, BOX) is Witness.SILENT
    known.learn(blank, BOX)
    assert asked(known, Frame(view(0), BLUR), BOX) is Witness.SILENT


def test_what_trusted_boxes_show_is_expected():
    known, blank = memory(), Frame(np.full((240, 320), 90, np.uint8), BLUR)
    known.learn(Frame(view(0), BLUR), BOX)
    assert asked(known, blank, BOX) is Witness.AGAINST
    nothing = SiftKeypoints(200, 96.0).around(blank, BOX)
    for _ in range(100):
        known.ask(*nothing, BOX, trusted=True)
    assert asked(known, blank, BOX) is Witness.SILENT


def test_a_memory_matures_with_its_views():
    known = memory()
    for seed in range(Parameters().witness_views):
        assert not known.mature
        known.learn(Frame(view(seed), BLUR), BOX)
    assert known.mature


@pytest.mark.parametrize("size", [(320, 240), (640, 480), (1280, 720), (470, 310)])
@pytest.mark.parametrize("side", [10.0, 60.0, 96.0])
def test_tiles_hold_the_target_wherever_it_is(size, side):
    width, height = size
    target = Box(30.0, 20.0, side, 1.5 * side)
    tiles = search_tiles(width, height, target, 50000)
    limit = max(50000.0, 3.0 * side * max(np.sqrt(50000.0), 2.0 * side))
    assert all(tile.area <= limit + 1e-6 for tile in tiles)
    assert all(tile.clip(width, height).area == pytest.approx(tile.area) for tile in tiles)
    rng = np.random.default_rng(0)
    for x, y in rng.random((200, 2)) * (width - target.width, height - target.height):
        part = Box(x, y, target.width, target.height)
        assert any(
            min(part.right, t.right) - max(x, t.x) >= part.width - 1e-6
            and min(part.bottom, t.bottom) - max(y, t.y) >= part.height - 1e-6
            for t in tiles
        )


def test_the_search_begins_where_the_target_was():
    tiles = search_tiles(1280, 720, Box(900.0, 500.0, 60.0, 60.0), 50000)
    assert tiles[0].x < 900 < 960 < tiles[0].right
    assert tiles[0].y < 500 < 560 < tiles[0].bottom


def test_a_large_image_is_searched_tile_by_tile():
    known = SiftMemory(SiftKeypoints(200, 96.0), Parameters(sift_interval=1, sift_pixels=20000))
    known.learn(Frame(view(0), BLUR), BOX)
    frame, truth = elsewhere(0, 70.0, -30.0, 1.0)
    turns = len(search_tiles(320, 240, BOX, 20000))
    found = [known.propose(frame, BOX, turn) for turn in range(2 * turns)]
    assert turns > 1
    assert found[:turns] == found[turns:]
    assert any(box is not None and box.overlap(truth) > 0.75 for box in found)
    assert any(box is None for box in found)
