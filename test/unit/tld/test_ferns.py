# SPDX-License-Identifier: BSD-3-Clause
import cv2
import numpy as np
import pytest
from synthetic_video import texture

from tld_follower.tld.ferns import MIN_REACH, Ferns, fern_codes, make_comparisons, pixel_offsets, scan_windows


def reference_code(window, offsets):
    """Fern codes of one window (H, W), bit by bit."""
    codes = []
    for fern in offsets:
        bits = ["1" if window[y0, x0] > window[y1, x1] else "0" for x0, y0, x1, y1 in fern]
        codes.append(int("".join(bits), 2))
    return codes


def test_comparisons_are_straight_long_and_inside():
    comparisons = make_comparisons(10, 13, np.random.default_rng(0)).reshape(-1, 4)
    shift = np.abs(comparisons[:, 2:] - comparisons[:, :2])
    assert comparisons.min() >= 0.0
    assert comparisons.max() <= 1.0
    assert (shift.min(axis=1) == 0.0).all()
    assert (shift.max(axis=1) >= MIN_REACH - 1e-9).all()
    assert 0.3 < (shift[:, 0] > 0).mean() < 0.7


def test_codes_match_the_reference():
    rng = np.random.default_rng(1)
    image = texture(60, 80, seed=1)
    offsets = pixel_offsets(make_comparisons(10, 13, rng), 24, 18)
    corners = np.stack([rng.integers(0, 80 - 24, 50), rng.integers(0, 60 - 18, 50)], axis=1).astype(np.int32)
    codes = fern_codes(image, corners, offsets)
    for (x, y), code in zip(corners, codes, strict=True):
        assert code.tolist() == reference_code(image[y : y + 18, x : x + 24], offsets)


class TestTraining:
    def test_posteriors_are_counts_of_the_mistakes(self):
        ferns = Ferns(2, 3, np.random.default_rng(0))
        positive, negative = np.array([[1, 2]]), np.array([[1, 5]])
        assert ferns.confidence(positive)[0] == 0.0
        ferns.train(positive, np.array([True]), 0.5, 0.5)
        assert ferns.confidence(positive)[0] == 1.0
        # Half sure of the negative (fern 0 alone fires), which counts as a mistake at the threshold.
        assert ferns.confidence(negative)[0] == 0.5
        ferns.train(negative, np.array([False]), 0.5, 0.5)
        np.testing.assert_allclose(ferns.posteriors[0, 1], 0.5)
        np.testing.assert_allclose(ferns.posteriors[1, 2], 1.0)

    def test_what_is_right_is_left_alone(self):
        ferns = Ferns(2, 3, np.random.default_rng(0))
        codes = np.array([[1, 2], [4, 4]])
        ferns.train(codes[:1], np.array([True]), 0.5, 0.5)
        before = ferns.posteriors.copy()
        ferns.train(codes, np.array([True, False]), 0.5, 0.5)
        np.testing.assert_array_equal(ferns.posteriors, before)

    def test_a_code_never_seen_has_probability_zero(self):
        assert not Ferns(3, 4, np.random.default_rng(0)).posteriors.any()


@pytest.mark.parametrize("min_confidence", [-1.0, 0.3, 0.6])
def test_scan_matches_a_plain_cascade(min_confidence):
    rng = np.random.default_rng(2)
    image = texture(50, 70, seed=5, grain=4.0)
    integral, squares = cv2.integral2(image, sdepth=cv2.CV_32S, sqdepth=cv2.CV_64F)
    grid = (15.3, 12.6, 1.53, 1.26)
    offsets = pixel_offsets(make_comparisons(10, 13, rng), 15, 13)
    posteriors = rng.random((10, 1 << 13)).astype(np.float32)
    min_variance = 500.0
    expected = {}
    for iy in range(50):
        for ix in range(70):
            x, y = round(ix * grid[2]), round(iy * grid[3])
            window = image[y : y + 13, x : x + 15]
            if window.shape != (13, 15) or window.astype(float).var() < min_variance:
                continue
            code = reference_code(window, offsets)
            confidence = posteriors[np.arange(10), code].mean()
            if confidence > min_confidence:
                expected[x, y] = (code, confidence)
    corners, codes = np.empty((9000, 2), np.int32), np.empty((9000, 10), np.int32)
    confidences = np.empty(9000, np.float32)
    filled = scan_windows(
        image, integral, squares, grid, offsets, posteriors, min_variance, min_confidence, (1, 0),
        (0.0, 0.0, 0.0, 0.0), corners, confidences, codes, 0,
    )  # fmt: skip
    assert 0 < len(expected) < 40 * 57
    assert {tuple(c) for c in corners[:filled].tolist()} == set(expected)
    for corner, code, confidence in zip(corners[:filled].tolist(), codes, confidences, strict=False):
        assert code.tolist() == expected[tuple(corner)][0]
        assert confidence == pytest.approx(expected[tuple(corner)][1], abs=1e-5)


def test_sparse_scans_take_turns_and_never_skip_what_is_near():
    image = texture(60, 60, seed=6)
    integral, squares = cv2.integral2(image, sdepth=cv2.CV_32S, sqdepth=cv2.CV_64F)
    offsets = pixel_offsets(make_comparisons(4, 5, np.random.default_rng(0)), 12, 12)
    posteriors = np.ones((4, 32), np.float32)
    near = (20.0, 20.0, 26.0, 26.0)

    def scan(stride, phase):
        corners = np.empty((5000, 2), np.int32)
        filled = scan_windows(
            image, integral, squares, (12.0, 12.0, 2.0, 2.0), offsets, posteriors, 0.0, 0.5, (stride, phase),
            near, corners, np.empty(5000, np.float32), np.empty((5000, 4), np.int32), 0,
        )  # fmt: skip
        return {tuple(c) for c in corners[:filled].tolist()}

    everything = scan(1, 0)
    shares = [scan(3, phase) for phase in range(3)]
    assert set.union(*shares) == everything
    close = {c for c in everything if near[0] <= c[0] <= near[2] and near[1] <= c[1] <= near[3]}
    assert close
    for share in shares:
        assert close <= share
        assert len(share) < 0.5 * len(everything)


def test_a_full_buffer_ends_the_scan():
    image = texture(60, 60, seed=6)
    integral, squares = cv2.integral2(image, sdepth=cv2.CV_32S, sqdepth=cv2.CV_64F)
    offsets = pixel_offsets(make_comparisons(4, 5, np.random.default_rng(0)), 12, 12)
    filled = scan_windows(
        image, integral, squares, (12.0, 12.0, 2.0, 2.0), offsets, np.ones((4, 32), np.float32), 0.0, 0.5,
        (1, 0), (0.0, 0.0, 0.0, 0.0), np.empty((7, 2), np.int32), np.empty(7, np.float32),
        np.empty((7, 4), np.int32), 0,
    )  # fmt: skip
    assert filled == 7
