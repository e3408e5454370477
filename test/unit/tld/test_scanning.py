# SPDX-License-Identifier: BSD-3-Clause
"""The scan of one window size against a plain cascade."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import texture

from tld_follower.tld.ferns import fern_codes, make_comparisons, pixel_offsets
from tld_follower.tld.scanning import BLOCK, deinterleave, scan_windows


class Scan:
    """A texture, random ferns, and both ways to scan them."""

    def __init__(self, width, height, grid, ferns=10, comparisons=13, seed=0):
        self.image = texture(height, width, seed=seed, grain=4.0)
        self.integrals = cv2.integral2(self.image, sdepth=cv2.CV_32S, sqdepth=cv2.CV_64F)
        self.grid = grid
        rng = np.random.default_rng(seed)
        self.win_w, self.win_h = round(grid[0]), round(grid[1])
        self.offsets = pixel_offsets(make_comparisons(ferns, comparisons, rng), self.win_w, self.win_h)
        self.posteriors = rng.random((ferns, 1 << comparisons)).astype(np.float32)

    def expected(self, min_variance, min_confidence):
        """All windows that pass: {(x, y): (codes, confidence)}."""
        height, width = self.image.shape
        xs = [round(i * self.grid[2]) for i in range(width) if i * self.grid[2] + self.win_w <= width]
        ys = [round(i * self.grid[3]) for i in range(height)]
        corners = [(x, y) for y in ys for x in xs if y + self.win_h <= height]
        if not corners:
            return {}
        codes = fern_codes(self.image, np.array(corners, np.int32), self.offsets)
        found = {}
        for (x, y), code in zip(corners, codes, strict=True):
            window = self.image[y : y + self.win_h, x : x + self.win_w].astype(float)
            confidence = self.posteriors[np.arange(len(code)), code].mean()
            if window.var() >= min_variance and confidence > min_confidence:
                found[x, y] = (code.tolist(), confidence)
        return found

    def found(self, min_variance, min_confidence, sparse=(1, 0), near=(0.0, 0.0, -1.0, -1.0), room=20000):
        """What the kernel finds, in the same form, and in its order."""
        corners, confidences = np.empty((room, 2), np.int32), np.empty(room, np.float32)
        codes = np.empty((room, len(self.offsets)), np.int32)
        filled = scan_windows(
            deinterleave(self.image, int(self.grid[2]) * sparse[0]), *self.integrals, self.grid, self.offsets,
            self.posteriors, min_variance, min_confidence, sparse, near, corners, confidences, codes, 0,
        )  # fmt: skip
        found = {tuple(map(int, corners[n])): (codes[n].tolist(), confidences[n]) for n in range(filled)}
        assert len(found) == filled
        return found


@pytest.mark.parametrize("step", [1, 2, 3, 5])
@pytest.mark.parametrize("min_confidence", [-1.0, 0.3, 0.6])
def test_scan_matches_a_plain_cascade(step, min_confidence):
    scan = Scan(3 * BLOCK + 7, 50, (15.3, 12.6, float(step), 1.26), seed=5)
    expected = scan.expected(500.0, min_confidence)
    found = scan.found(500.0, min_confidence)
    assert expected
    assert len(expected) < len(scan.expected(-1.0, -1.0))
    assert set(found) == set(expected)
    for corner, (codes, confidence) in found.items():
        assert codes == expected[corner][0]
        assert confidence == pytest.approx(expected[corner][1], abs=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_shares_of_any_stride_make_up_the_whole(data):
    width, height = data.draw(st.integers(8, 90)), data.draw(st.integers(8, 60))
    grid = (
        *data.draw(st.tuples(st.floats(6, 40), st.floats(6, 40))),
        float(data.draw(st.integers(1, 4))),
        1.7,
    )
    stride = data.draw(st.integers(1, 7))
    x, y = data.draw(st.floats(-20, 90)), data.draw(st.floats(-20, 60))
    near = (x, y, x + 12.0, y + 9.0)
    scan = Scan(width, height, grid, ferns=3, comparisons=4, seed=data.draw(st.integers(0, 9)))
    everything = scan.expected(-1.0, 0.4)
    shares = [set(scan.found(-1.0, 0.4, (stride, phase), near)) for phase in range(stride)]
    assert set.union(*shares) == set(everything)
    close = {c for c in everything if near[0] <= c[0] <= near[2] and near[1] <= c[1] <= near[3]}
    for share in shares:
        assert close <= share
    # Away from there each window is looked at once in so many turns.
    assert sum(len(share - close) for share in shares) == len(everything) - len(close)


def test_a_full_buffer_ends_the_scan():
    scan = Scan(60, 60, (12.0, 12.0, 2.0, 2.0), ferns=4, comparisons=5)
    assert len(scan.found(0.0, -1.0, room=7)) == 7


def test_columns_are_sorted_by_their_remainder():
    image = np.arange(3 * 8, dtype=np.uint8).reshape(3, 8) + 1
    planes = deinterleave(image, 3)[:-BLOCK].reshape(3, 3, 3)
    for x in range(8):
        np.testing.assert_array_equal(planes[x % 3, :, x // 3], image[:, x])
    assert not planes[2, :, 2].any()
