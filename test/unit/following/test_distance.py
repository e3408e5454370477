import math

import numpy as np
import pytest

from tld_follower.box import Box
from tld_follower.following.distance import BoxDistance, StereoDistance, box_pixels, ranges
from tld_follower.following.parameters import Parameters

PARAMETERS = Parameters(image_width=320, image_height=240)


def wall(depth, height=240, width=320):
    """A plane that faces the camera."""
    points = np.zeros((height, width, 3), np.float32)
    points[..., 2] = depth
    return points


def test_ranges_are_euclidean_and_skip_points_without_depth():
    points = np.array([[3.0, 0, 4.0], [np.nan] * 3, [0, 0, np.inf]], np.float32)
    assert ranges(points) == pytest.approx([5.0])


@pytest.mark.parametrize(
    ("box", "rows", "columns"),
    [
        (Box(10.2, 20.9, 5.0, 4.0), (20, 25), (10, 16)),
        (Box(-5, -5, 10, 10), (0, 5), (0, 5)),
        (Box(310, 230, 100, 100), (230, 240), (310, 320)),
        (Box(400, 300, 10, 10), (300, 300), (400, 400)),
    ],
)
def test_pixels_of_a_box_are_clipped_to_the_image(box, rows, columns):
    assert box_pixels(box, 240, 320) == (slice(*rows), slice(*columns))


class TestStereo:
    box = Box(100, 80, 60, 50)
    stereo = StereoDistance(PARAMETERS)

    def test_target_before_a_far_background(self):
        cloud = wall(5.0)
        cloud[85:125, 105:155, 2] = 1.2
        assert self.stereo.measure(self.box, cloud) == pytest.approx(1.2)

    def test_what_is_outside_the_box_does_not_count(self):
        cloud = wall(2.0)
        cloud[:70, :, 2] = 0.5
        assert self.stereo.measure(self.box, cloud) == pytest.approx(2.0)

    def test_lone_wrong_matches_do_not_count(self):
        cloud = wall(2.0)
        cloud[90:130:5, 110:160:5, 2] = 0.4
        assert self.stereo.measure(self.box, cloud) == pytest.approx(2.0)

    def test_too_few_points(self):
        cloud = np.full((240, 320, 3), np.nan, np.float32)
        assert math.isnan(self.stereo.measure(self.box, cloud))
        cloud[100, 110:150] = 1.0
        assert math.isnan(self.stereo.measure(self.box, cloud))

    def test_no_cloud_and_a_box_outside(self):
        assert math.isnan(self.stereo.measure(self.box, None))
        assert math.isnan(self.stereo.measure(Box(400, 0, 50, 50), wall(1.0)))


def test_half_the_size_is_twice_the_distance():
    box = BoxDistance(PARAMETERS)
    assert box.measure(Box(0, 0, 80, 60), None) == pytest.approx(1.0)
    assert box.measure(Box(9, 9, 40, 30), None) == pytest.approx(2.0)
