import pytest

from tld_follower.evaluation.scenarios import SPIRI_START, STRAIGHT


def test_straight_is_the_thesis_experiment():
    assert STRAIGHT.halt - STRAIGHT.start == pytest.approx(12.0)
    assert STRAIGHT.target_command(STRAIGHT.start - 0.01) == (0.0, 0.0)
    assert STRAIGHT.target_command(STRAIGHT.start) == (1.0, 0.0)
    assert STRAIGHT.target_command(STRAIGHT.halt) == (0.0, 0.0)


def test_a_seed_moves_the_start_and_always_the_same_way():
    assert STRAIGHT.spiri_pose(0) == SPIRI_START
    poses = [STRAIGHT.spiri_pose(seed) for seed in range(1, 20)]
    assert len(set(poses)) == len(poses)
    assert poses == [STRAIGHT.spiri_pose(seed) for seed in range(1, 20)]
    for x, y, yaw in poses:
        assert abs(x - SPIRI_START[0]) <= 0.05
        assert abs(y) <= 0.15
        assert abs(yaw) <= 0.05
