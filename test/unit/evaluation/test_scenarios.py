import math
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from geometry import husky_footprint, shown, target_shown

from tld_follower.evaluation.graph import world_file
from tld_follower.evaluation.metrics import FOLLOWING
from tld_follower.evaluation.paths import FOLLOWING_LENGTH, following_path, target_path
from tld_follower.evaluation.plan import BOX_AT, Leg, Plan, Pose
from tld_follower.evaluation.scenarios import SCENARIOS, straight

SEEDS = range(50)
HULL = 0.165  # m, half the drone's width
CLEARANCE = 0.35  # m, what is asked for
STEP = 0.2  # s
# Where the drone keeps its distance to the target throughout, whatever stands or moves about.
FOLLOWED = ("straight", "turn", "stop_and_go", "target_drone", "ugv", "approach")
DRIVEN = [name for name in SCENARIOS if name != "fastboard"]


@lru_cache
def every(name):
    """Each seed with its plan, the target's way and that of a drone which keeps its distance."""
    return list(_every(name))


def _every(name):
    for seed in SEEDS:
        plan = SCENARIOS[name](seed)
        path = target_path(plan.target, plan.legs, plan.start, plan.end)
        yield seed, plan, path, following_path(path, plan.drone)


def times(plan, first=BOX_AT):
    return np.arange(first, plan.end, STEP)


def kind(plan):
    return "+".join(sorted({obstacle.name.rstrip("_0123456789") for obstacle in plan.obstacles}))


def test_straight_is_the_thesis_experiment():
    plan = straight(0)
    assert plan.halt - plan.start == pytest.approx(12.0)
    assert plan.target_command(plan.start - 0.01) == (0.0, 0.0, 0.0, 0.0)
    assert plan.target_command(plan.start) == (1.0, 0.0, 0.0, 0.0)
    assert plan.target_command(plan.halt) == (0.0, 0.0, 0.0, 0.0)
    assert plan.figures == set(FOLLOWING)
    assert plan.drone == pytest.approx((-1.5, 0.0, 0.0), abs=0.002)
    assert -plan.drone.x == pytest.approx(FOLLOWING_LENGTH, abs=0.002)


def test_the_target_moves_by_its_legs_one_after_the_other():
    legs = (Leg(1.0, 0.5), Leg(2.0, turn=0.7), Leg(1.5, -1.0, climb=0.2))
    plan = Plan("s", Pose(0, 0, 0), Pose(0, 0, 0), legs, frozenset(), start=2.0)
    assert (plan.drive_s, plan.halt) == (4.5, 6.5)
    moments = (1.9, 2.0, 2.9, 3.1, 4.9, 5.1, 6.4, 6.6)
    expected = [(0, 0, 0, 0), (0.5, 0, 0, 0), (0.5, 0, 0, 0), (0, 0, 0, 0.7), (0, 0, 0, 0.7)]
    expected += [(-1, 0, 0.2, 0), (-1, 0, 0.2, 0), (0, 0, 0, 0)]
    assert [plan.target_command(t) for t in moments] == expected


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_is_whole_and_a_function_of_its_seed(name):
    plans = [SCENARIOS[name](seed) for seed in SEEDS]
    assert Path(world_file(plans[0].world)).is_file()
    assert len({plan.drone for plan in plans}) == len(plans)
    assert plans[7].drone == SCENARIOS[name](7).drone
    assert plans[7].obstacles == SCENARIOS[name](7).obstacles
    for seed, plan in enumerate(plans):
        assert plan.scenario == name
        assert plan.end - plan.box_at < 36, seed
        assert max(abs(leg.forward) for leg in plan.legs) <= 1.0, seed
        assert max(abs(leg.turn) for leg in plan.legs) <= 2.0, seed
        assert len({obstacle.name for obstacle in plan.obstacles}) == len(plan.obstacles)
        for obstacle in plan.obstacles:
            assert np.all(np.diff([spot.t for spot in obstacle.track]) > 5e-4), seed


@pytest.mark.parametrize("name", DRIVEN)
def test_the_target_is_seen_when_it_is_boxed(name):
    for seed, plan, path, _ in every(name):
        assert plan.box_at < plan.start
        if plan.target_robot == "husky":
            assert target_shown(plan, plan.drone, path.at(BOX_AT), BOX_AT) > 0.5, seed


@pytest.mark.parametrize("name", DRIVEN)
def test_the_target_never_runs_into_an_obstacle(name):
    for seed, plan, path, _ in every(name):
        moments = times(plan, 0.0)
        covered = [husky_footprint(path.at(t)) for t in moments]
        for obstacle in plan.obstacles:
            if len(obstacle.track) == 1:
                gap = obstacle.distance(np.concatenate(covered), 0.0).min()
            else:
                gap = min(
                    obstacle.distance(points, t).min() for points, t in zip(covered, moments, strict=True)
                )
            assert gap > 0.02, (seed, obstacle.name)


@pytest.mark.parametrize("name", DRIVEN)
def test_no_obstacle_comes_to_a_drone_that_keeps_its_place(name):
    for seed, plan, _, _ in every(name):
        spot = (plan.drone.x, plan.drone.y)
        for obstacle in plan.obstacles:
            if plan.vehicle == "uav" and not obstacle.name.startswith("post"):
                gaps = [float(obstacle.distance(spot, t)[0]) for t in times(plan, 0.0)]
                assert min(gaps) > HULL + CLEARANCE, (seed, obstacle.name)


@pytest.mark.parametrize("name", FOLLOWED)
def test_a_drone_that_follows_well_has_room(name):
    for seed, plan, _, flown in every(name):
        for obstacle in plan.obstacles:
            assert obstacle.distance(flown.places, 0.0).min() > 1.5, (seed, obstacle.name)


def test_obstacles_leave_room_to_a_drone_that_acts_in_time():
    found = set()
    for seed, plan, _, flown in every("obstacle"):
        found.add(seed % 5)
        assert plan.obstacles, seed
        for obstacle in plan.obstacles:
            speeds = [
                math.dist(a[1:3], b[1:3]) / (b.t - a.t)
                for a, b in zip(obstacle.track, obstacle.track[1:], strict=False)
            ]
            assert max(speeds, default=0.0) < 1.0, seed
            gaps = np.array([float(obstacle.distance(flown.at(t)[:2], t)[0]) for t in times(plan)])
            if seed % 5 != 1:  # all but the post that cuts in, for which the drone has to stop
                assert gaps.min() > HULL + CLEARANCE, (seed, obstacle.name)
                continue
            # When its edge can be seen in the lane, the drone can still stop before it.
            comes = next(t for t in times(plan) if abs(obstacle.pose(t).y) < 0.4 + 0.5 * obstacle.size[0])
            speed = max(leg.forward for leg in plan.legs)
            room = float(obstacle.distance(flown.at(comes)[:2], comes)[0]) - HULL - CLEARANCE
            assert room > speed * 0.15 + speed**2 / (2 * 2.5), seed
            assert gaps.min() < HULL, seed  # it does have to
    assert found == set(range(5))


def test_what_is_behind_the_drone_was_seen_and_would_be_hit():
    for seed, plan, _, flown in every("obstacle"):
        if seed % 5 != 3:
            continue
        (thing,) = plan.obstacles
        x, y, _ = thing.pose(0.0)
        middle = np.array([[x, y, 0.5 * thing.size[2]]])
        seen = [shown(plan, flown.at(t), middle, t, obstacles=()) for t in times(plan)]
        assert sum(seen) * STEP > 1.0, seed
        last = flown.at(plan.end)
        back = (last.x - 1.5 * math.cos(last.yaw), last.y - 1.5 * math.sin(last.yaw))
        way = np.linspace(last[:2], back, 20)
        assert thing.distance(way, 0.0).min() == 0.0, seed


def hidden_s(plan, path, flown=None):
    """For how many seconds on end, at most, a drone on a way, or that stays, sees nothing of the target."""
    longest = now = 0.0
    for t in times(plan):
        drone = flown.at(t) if flown else plan.drone
        now = 0.0 if target_shown(plan, drone, path.at(t), t) > 0 else now + STEP
        longest = max(longest, now)
    return longest


def test_occluders_hide_the_whole_target():
    for seed, plan, path, flown in every("occlusion"):
        standing = seed % 2 == 1
        hidden = hidden_s(plan, path, None if standing else flown)
        assert hidden > (1.5 if standing else 0.5), seed
        assert plan.figures == {"recovered_10s"}
        if seed % 4 == 1:  # halts behind the wall
            assert target_shown(plan, plan.drone, path.at(plan.end), plan.end) == 0.0, seed
        elif not standing:
            assert hidden < 5.0, seed
        assert plan.end - plan.halt > 10.0


def test_an_escaping_target_leaves_the_view_of_a_drone_that_hovers():
    for seed, plan, path, _ in every("escape"):
        assert hidden_s(plan, path) > 2.0, seed
        assert target_shown(plan, plan.drone, path.at(plan.end), plan.end) == 0.0, seed
        assert plan.end - plan.halt > 10.0


def test_a_target_that_escapes_past_the_drone_does_not_touch_it():
    for seed, plan, path, _ in every("escape"):
        if seed % 5 in (1, 2, 4):
            gap = min(math.dist(path.at(t)[:2], plan.drone[:2]) for t in times(plan))
            assert gap > 0.5, seed


def test_approaches_come_to_the_drone():
    for seed, plan, path, flown in every("approach"):
        begins = plan.halt - plan.legs[-1].duration
        place = flown.at(begins)[:2]
        nearest = min(math.dist(path.at(t)[:2], place) for t in times(plan, begins))
        assert nearest < 0.8, seed


def test_a_target_drone_stays_off_the_ground():
    for seed, _, path, _ in every("target_drone"):
        assert path.z.min() > -0.05, seed
        assert 0.2 < path.z.max() < 1.0, seed


def test_light_differs_by_seed_and_the_plain_one_is_the_worlds():
    lights = [straight(seed).light for seed in SEEDS]
    assert (lights[0].elevation, lights[0].sun, lights[0].ambient) == (None, 1.0, 1.0)
    assert len(set(lights)) == len(lights)
    assert all(0.4 < light.elevation < 1.3 for light in lights[1:])
