# SPDX-License-Identifier: BSD-3-Clause
import cv2
import numpy as np
import pytest
from synthetic_video import texture

from tld_follower.box import Box
from tld_follower.tld.frame import Frame
from tld_follower.tld.keypoints import SiftKeypoints
from tld_follower.tld.redetection import SiftMemory

BLUR = 3.0
BOX = Box(100.0, 80.0, 80.0, 70.0)


def moved(image, dx, dy, scale):
    """The image shifted, and scaled about its centre."""
    height, width = image.shape
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, scale)
    matrix[:, 2] += dx, dy
    return cv2.warpAffine(image, matrix, (width, height))


def memory(views=10, interval=1):
    return SiftMemory(SiftKeypoints(200, 400.0), views, interval)


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
    assert known.propose(frame, BOX).overlap(truth) > 0.75


def test_no_proposal_without_the_target():
    known = memory()
    known.learn(Frame(view(0), BLUR), BOX)
    for image in (texture(240, 320, 9), view(1), np.full((240, 320), 255, np.uint8)):
        assert known.propose(Frame(image, BLUR), BOX) is None


def test_no_proposal_without_a_memory():
    assert memory().propose(Frame(view(0), BLUR), BOX) is None
    blank = memory()
    blank.learn(Frame(np.zeros((240, 320), np.uint8), BLUR), BOX)
    assert blank.propose(Frame(view(0), BLUR), BOX) is None


def test_a_full_memory_keeps_the_first_view_and_the_last_ones():
    known = memory(views=3)
    for seed in range(6):
        known.learn(Frame(view(seed), BLUR), BOX)
    found = [known.propose(Frame(view(seed), BLUR), BOX) is not None for seed in range(6)]
    assert found == [True, False, False, False, True, True]


def test_only_one_call_in_an_interval_is_remembered():
    known = memory(interval=3)
    for seed in range(5):
        known.learn(Frame(view(seed), BLUR), BOX)
    found = [known.propose(Frame(view(seed), BLUR), BOX) is not None for seed in range(5)]
    assert found == [True, False, False, True, False]
