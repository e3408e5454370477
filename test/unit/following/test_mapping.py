import pytest
from hypothesis import given
from hypothesis import strategies as st

from tld_follower.following.mapping import map_range, to_velocity

reals = st.floats(-1e6, 1e6)


def test_the_example_of_the_thesis():
    # 150 of 160 pixels off the centre, at most 1 m/s.
    assert map_range(150, 0, 160, 0, 1) == pytest.approx(0.9375)


@given(reals, reals)
def test_ends_of_the_input_range_map_to_the_ends_of_the_output_range(out_min, out_max):
    assert map_range(3, 3, 11, out_min, out_max) == pytest.approx(out_min)
    assert map_range(11, 3, 11, out_min, out_max) == pytest.approx(out_max, abs=1e-6)


def test_reversed_range():
    assert map_range(-40, 0, -160, 0, -1) == pytest.approx(-0.25)


@given(reals, st.floats(0.01, 1e3), st.floats(0.01, 10))
def test_velocity_is_odd_capped_and_points_at_the_displacement(x, x_max, v_max):
    v = to_velocity(x, x_max, v_max)
    assert abs(v) <= v_max
    assert v * x >= 0
    assert to_velocity(-x, x_max, v_max) == pytest.approx(-v)
