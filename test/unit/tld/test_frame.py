# SPDX-License-Identifier: BSD-3-Clause
import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import texture

from tld_follower.tld.frame import PATCH_SIDE, Frame, to_gray


def reference_patch(image, box):
    """The area means of 15x15 cells by exact supersampling of the pixels, zero mean and unit norm."""
    x, y, width, height = box
    values = np.zeros((PATCH_SIDE, PATCH_SIDE))

    def weights(start, stop, count):
        return np.clip(np.minimum(stop, np.arange(count) + 1) - np.maximum(start, np.arange(count)), 0, None)

    for i in range(PATCH_SIDE):
        rows = weights(y + height * i / PATCH_SIDE, y + height * (i + 1) / PATCH_SIDE, image.shape[0])
        for j in range(PATCH_SIDE):
            cols = weights(x + width * j / PATCH_SIDE, x + width * (j + 1) / PATCH_SIDE, image.shape[1])
            values[i, j] = rows @ image @ cols / (rows.sum() * cols.sum())
    values -= values.mean()
    return (values / np.linalg.norm(values)).ravel()


@settings(max_examples=40, deadline=None)
@given(st.floats(0, 60), st.floats(0, 40), st.floats(4, 80), st.floats(4, 60))
def test_patches_are_area_means(x, y, width, height):
    image = texture(100, 140, seed=3)
    patch = Frame(image, 3.0).patches(np.array([[x, y, width, height]]))[0]
    np.testing.assert_allclose(patch, reference_patch(image.astype(float), (x, y, width, height)), atol=1e-4)


def test_patch_partly_outside_repeats_the_border():
    image = texture(60, 60, seed=1)
    # A third of the box, 5 of 15 columns, lies left of the image.
    patch = Frame(image, 3.0).patches(np.array([[-10.0, 10.0, 30.0, 30.0]]))[0]
    grid = patch.reshape(PATCH_SIDE, PATCH_SIDE)
    assert np.linalg.norm(patch) == pytest.approx(1.0, abs=1e-4)
    for column in range(5):
        np.testing.assert_allclose(grid[:, column], grid[:, 5], atol=1e-5)
    assert not np.allclose(grid[:, 5], grid[:, 6])


@pytest.mark.parametrize("box", [[200.0, 0.0, 20.0, 20.0], [-50.0, -50.0, 20.0, 20.0]])
def test_patch_outside_or_without_contrast_is_zero(box):
    assert not Frame(texture(60, 60, 0), 3.0).patches(np.array([box])).any()
    assert not Frame(np.full((60, 60), 255, np.uint8), 3.0).patches(np.array([[5.0, 5, 20, 20]])).any()


def test_octaves_are_exact_means_of_the_even_part():
    image = texture(51, 77, seed=2)
    half = Frame(image, 3.0).level(1).gray
    expected = image[:50, :76].reshape(25, 2, 38, 2).mean(axis=(1, 3))
    assert half.shape == (25, 38)
    assert np.abs(half - expected).max() <= 0.5


def test_octaves_end_before_the_pixels_do():
    frame = Frame(texture(9, 9, seed=2), 3.0)
    assert frame.level(20).gray.shape == (2, 2)


@pytest.mark.parametrize("blur", [0.3, 2.0, 3.0, 7.5])
@pytest.mark.parametrize("shape", [(50, 70), (20, 33)])
def test_the_blurred_copy_is_gaussian_to_a_grey_level(blur, shape):
    image = texture(50, 70, 3)[: shape[0], : shape[1]]
    size = 2 * round(3.0 * blur) + 1
    expected = cv2.GaussianBlur(image, (size, size), blur, borderType=cv2.BORDER_REFLECT_101)
    difference = np.abs(Frame(image, blur).level(0).blurred.astype(int) - expected)
    assert difference.max() <= 1
    assert difference.mean() < 0.1


def test_variance_is_that_of_the_pixels_inside():
    image = texture(60, 80, seed=4)
    frame = Frame(image, 3.0)
    expected = image[10:30, 20:50].astype(float).var()
    assert frame.variance(np.array([20.0, 10.0, 30.0, 20.0])) == pytest.approx(expected)
    assert frame.variance(np.array([-40.0, 0.0, 20.0, 20.0])) == 0.0


def test_to_gray_takes_any_strides_and_colour():
    image = np.random.default_rng(0).integers(0, 256, (40, 60, 3), np.uint8)
    gray = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    np.testing.assert_array_equal(to_gray(image), gray)
    np.testing.assert_array_equal(to_gray(image[::2, ::-3]), gray[::2, ::-3])
    np.testing.assert_array_equal(to_gray(gray[::2, ::-3]), gray[::2, ::-3])


def test_to_gray_copies():
    image = texture(30, 30, seed=0)
    gray = to_gray(image)
    image[:] = 0
    assert gray.any()


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (None, "uint8"),
        (np.zeros((10, 10)), "uint16, got float64"),
        (np.zeros((10, 10), np.int16), "uint16, got int16"),
        (np.zeros((10, 10, 4), np.uint8), "HxWx3"),
        (np.zeros(10, np.uint8), "HxW"),
        (np.zeros((0, 10), np.uint8), "empty"),
    ],
)
def test_to_gray_refuses(image, message):
    with pytest.raises(ValueError, match=message):
        to_gray(image)
