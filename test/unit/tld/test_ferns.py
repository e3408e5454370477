# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
from synthetic_video import texture

from tld_follower.tld.ferns import MIN_REACH, Ferns, fern_codes, make_comparisons, pixel_offsets


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
