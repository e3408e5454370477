# SPDX-License-Identifier: BSD-3-Clause
"""Integral images, and the patches read from them for boxes anywhere, against plain numpy."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import texture

from tld_follower.tld.frame import PATCH_SIDE, Frame


def cells(start, side, size):
    """The edges of the cells along one axis, cut at the image's."""
    return np.clip(start + side * np.arange(PATCH_SIDE + 1) / PATCH_SIDE, 0, size)


def weights(edges, size):
    """(15, size): the share of each pixel in each cell; a cell outside repeats the nearest one inside."""
    inside = np.flatnonzero(np.diff(edges) > 1e-3)
    pixels = np.arange(size)
    rows = []
    for i in np.clip(np.arange(PATCH_SIDE), inside[0], inside[-1]):
        share = np.minimum(edges[i + 1], pixels + 1) - np.maximum(edges[i], pixels)
        rows.append(np.clip(share, 0, None) / (edges[i + 1] - edges[i]))
    return np.array(rows)


def test_integral_images_are_sums_over_the_pixels_before():
    gray = texture(23, 31, 2)
    total, squares = Frame(gray, 2.0).level(0).integrals
    padded = np.pad(gray.astype(np.int64), ((1, 0), (1, 0)))
    assert np.array_equal(total, padded.cumsum(0).cumsum(1))
    assert np.array_equal(squares, (padded**2).cumsum(0).cumsum(1))


def test_sums_of_a_large_saturated_image_are_exact():
    total, squares = Frame(np.full((1080, 1920), 255, np.uint8), 2.0).level(0).integrals
    assert total[-1, -1] == 1080 * 1920 * 255
    assert squares[-1, -1] == 1080 * 1920 * 255**2


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(st.integers(1, 50), st.integers(1, 50)),
    st.tuples(st.floats(-60, 60), st.floats(-60, 60), st.floats(0.5, 90), st.floats(0.5, 90)),
    st.integers(0, 5),
)
def test_patches_equal_the_reference_for_any_box(size, box, seed):
    gray = np.random.default_rng(seed).integers(0, 256, size, dtype=np.uint8)
    patch = Frame(gray, 2.0).patches(np.array([box]))[0]
    rows, columns = cells(box[1], box[3], size[0]), cells(box[0], box[2], size[1])
    for edges in (rows, columns):
        lengths = np.diff(edges)
        if lengths.max() <= 1e-3:
            assert not patch.any()
            return
        if np.any((lengths > 0) & (lengths < 1e-2)):
            return  # on the edge of counting as inside
    values = (weights(rows, size[0]) @ gray.astype(float) @ weights(columns, size[1]).T).ravel()
    values -= values.mean()
    norm = np.linalg.norm(values)
    if norm**2 < 1e-3 * PATCH_SIDE**2:
        assert np.linalg.norm(patch) in (0.0, 1.0) or norm < 1e-6
        return
    assert np.abs(patch - values / norm).max() < 1e-4
