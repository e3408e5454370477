from pathlib import Path

import pytest

from tld_follower.evaluation.graph import world_file
from tld_follower.evaluation.scenarios import OCCLUSION, SPIRI_START, STRAIGHT, Scenario


def test_straight_is_the_thesis_experiment():
    assert STRAIGHT.halt - STRAIGHT.start == pytest.approx(12.0)
    assert STRAIGHT.target_command(STRAIGHT.start - 0.01, 0) == (0.0, 0.0)
    assert STRAIGHT.target_command(STRAIGHT.start, 0) == (1.0, 0.0)
    assert STRAIGHT.target_command(STRAIGHT.halt, 0) == (0.0, 0.0)


def test_the_target_drives_its_pieces_one_after_the_other():
    drive = ((1.0, 0.5, 0.0), (2.0, 0.0, 0.7), (1.5, -1.0, 0.0))
    scenario = Scenario("s", box_at=1.0, start=2.0, halt=6.5, end=7.0, drive=drive)
    times = (1.9, 2.0, 2.9, 3.1, 4.9, 5.1, 6.4, 6.6)
    commands = [(0, 0), (0.5, 0), (0.5, 0), (0, 0.7), (0, 0.7), (-1, 0), (-1, 0), (0, 0)]
    assert [scenario.target_command(t, 0) for t in times] == commands


@pytest.mark.parametrize("scenario", [STRAIGHT, OCCLUSION], ids=["straight", "occlusion"])
def test_every_scenario_is_whole(scenario):
    assert scenario.start + sum(duration for duration, _, _ in scenario.drive) == pytest.approx(scenario.halt)
    assert scenario.box_at < scenario.start < scenario.halt < scenario.end
    assert Path(world_file(scenario.world)).is_file()


def test_a_seed_moves_the_start_and_always_the_same_way():
    assert STRAIGHT.spiri_pose(0) == SPIRI_START
    poses = [STRAIGHT.spiri_pose(seed) for seed in range(1, 20)]
    assert len(set(poses)) == len(poses)
    assert poses == [STRAIGHT.spiri_pose(seed) for seed in range(1, 20)]
    for x, y, yaw in poses:
        assert abs(x - SPIRI_START[0]) <= 0.05
        assert abs(y) <= 0.15
        assert abs(yaw) <= 0.05
