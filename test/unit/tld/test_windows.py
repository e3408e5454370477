# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from tld_follower.box import Box
from tld_follower.tld.ferns import make_comparisons
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.windows import window_sizes

COMPARISONS = make_comparisons(2, 4, np.random.default_rng(0))


def positions(grid, image_width, image_height):
    """Every window of a grid, one after the other."""
    width, height, step_x, step_y = grid
    found = 0
    x = 0
    while x * step_x + width <= image_width:
        y = 0
        while y * step_y + height <= image_height:
            found += 1
            y += 1
        x += 1
    return found


def test_sizes_differ_by_the_scale_step_about_the_target():
    parameters = Parameters(scales=3, scale_step=1.2)
    sizes = window_sizes(Box(0, 0, 50, 40), COMPARISONS, parameters)
    assert [s.width for s in sizes] == pytest.approx([50 * 1.2**k for k in range(-3, 4)])
    assert [s.height for s in sizes] == pytest.approx([40 * 1.2**k for k in range(-3, 4)])


def test_no_window_is_under_the_minimal_side_but_the_target_itself():
    parameters = Parameters(min_side=20.0)
    sizes = window_sizes(Box(0, 0, 30, 24), COMPARISONS, parameters)
    assert min(min(s.width, s.height) for s in sizes) >= 20.0
    small = window_sizes(Box(0, 0, 20, 20), COMPARISONS, parameters)
    assert small[0].width == 20.0


@pytest.mark.parametrize("side", [10.0, 30.0, 100.0, 400.0])
def test_large_windows_are_scanned_on_an_octave_of_bounded_size(side):
    parameters = Parameters(window_side=24.0)
    for size in window_sizes(Box(0, 0, side, side), COMPARISONS, parameters):
        assert size.factor == 2**size.octave
        on_level = size.width / size.factor
        assert on_level < 48.0
        assert size.octave == 0 or on_level >= 24.0
        assert size.grid[2] == max(round(0.1 * on_level), 1)
        assert size.grid[3] == pytest.approx(max(0.1 * on_level, 1.0))


def test_comparisons_stay_inside_the_window():
    for size in window_sizes(Box(0, 0, 61, 33), COMPARISONS, Parameters()):
        x, y = size.offsets[..., ::2], size.offsets[..., 1::2]
        assert x.min() >= 0
        assert y.min() >= 0
        assert x.max() < round(size.grid[0])
        assert y.max() < round(size.grid[1])


@pytest.mark.parametrize("image", [(160, 120), (50, 300), (641, 479), (3, 3)])
@pytest.mark.parametrize("box", [Box(0, 0, 23, 31), Box(0, 0, 90, 70)])
def test_windows_are_counted(image, box):
    for size in window_sizes(box, COMPARISONS, Parameters(scales=4)):
        level = [side // size.factor for side in image]
        assert size.count(*image) == positions(size.grid, *level)


def test_boxes_are_in_pixels_of_the_image():
    size = window_sizes(Box(0, 0, 120, 100), COMPARISONS, Parameters(scales=1))[1]
    assert size.factor == 4
    boxes = size.boxes(np.array([[0, 0], [5, 7]], np.int32))
    assert boxes.tolist() == [[0, 0, 120, 100], [20, 28, 120, 100]]
