# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from synthetic_video import texture

from tld_follower.box import Box
from tld_follower.tld.frame import Frame
from tld_follower.tld.keypoints import SiftKeypoints, flow_points, grid


@pytest.mark.parametrize("side", [1, 2, 10])
def test_grid_is_spread_over_the_box(side):
    box = Box(10.0, 20.0, 40.0, 60.0)
    points = grid(box, side)
    assert points.shape == (side * side, 2)
    assert len(np.unique(points, axis=0)) == side * side
    assert np.all((points > [box.x, box.y]) & (points < [box.right, box.bottom]))
    if side > 1:
        assert points.mean(axis=0) == pytest.approx(box.center)


def spots(*places, size=(200, 260)):
    """Bright Gaussian spots on grey, centred at (x, y) in the image's coordinates."""
    y, x = np.mgrid[: size[0], : size[1]] + 0.5
    image = np.full(size, 60.0)
    for place in places:
        image += 150 * np.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / (2 * 4.0**2))
    return image.astype(np.uint8)


def test_keypoints_are_where_the_spots_are_in_pixels_of_the_image():
    frame = Frame(spots((100.0, 80.0), (140.5, 120.25)), 2.0)
    points, descriptors = SiftKeypoints(50, 96.0).detect(frame, Box(70.0, 50.0, 100.0, 100.0), 0)
    assert descriptors.shape == (len(points), 128)
    for place in ((100.0, 80.0), (140.5, 120.25)):
        assert np.hypot(*(points - place).T).min() < 0.6


@pytest.mark.parametrize(("side", "octave"), [(10, 0), (96, 0), (97, 1), (192, 1), (400, 3)])
def test_large_targets_are_read_from_an_octave(side, octave):
    assert SiftKeypoints(50, 96.0).octave(Box(0.0, 0.0, 2.0 * side, 0.5 * side)) == octave


def test_keypoints_of_an_octave_are_in_pixels_of_the_image():
    frame = Frame(spots((100.0, 80.0)), 2.0)
    points, _ = SiftKeypoints(50, 96.0).detect(frame, Box(0.0, 0.0, 260.0, 200.0), 1)
    assert np.hypot(*(points - (100.0, 80.0)).T).min() < 1.5


def test_keypoints_lie_in_their_region_and_are_bounded_in_number():
    frame = Frame(texture(200, 260, 0), 2.0)
    region = Box(60.0, 40.0, 90.0, 70.0)
    points, _ = SiftKeypoints(20, 96.0).detect(frame, region, 0)
    assert 0 < len(points) <= 25
    assert np.all((points >= [60, 40]) & (points <= [151, 111]))


@pytest.mark.parametrize("region", [Box(300, 300, 20, 20), Box(10, 10, 3, 3), Box(-50, -50, 52, 52)])
def test_no_keypoints_outside_the_image_or_in_a_sliver(region):
    points, descriptors = SiftKeypoints(20, 96.0).detect(Frame(texture(200, 260, 0), 2.0), region, 0)
    assert points.shape == (0, 2)
    assert descriptors.shape == (0, 128)


def test_the_grid_carries_the_flow_with_as_many_keypoints_as_half_of_it():
    box = Box(60.0, 40.0, 90.0, 70.0)
    np.testing.assert_array_equal(flow_points(np.zeros((0, 2), np.float32), box, 10), grid(box, 10))
    points, _ = SiftKeypoints(2000, 96.0).around(Frame(texture(200, 260, 0), 2.0), box)
    rich = flow_points(points, box, 4)
    assert len(rich) == 24
    assert np.all((rich > [box.x, box.y]) & (rich < [box.right, box.bottom]))
