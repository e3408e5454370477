"""The predictive follower in flight, without ROS: distances, obstacles, recovery, limits."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from flying import PARAMETERS, RATE, World
from hypothesis import given, settings
from hypothesis import strategies as st

from tld_follower.box import Box
from tld_follower.following.avoidance import Trend
from tld_follower.following.controller import HOVER
from tld_follower.following.follower import Follower, Mode
from tld_follower.following.search import Phase


def fly(world, seconds, each=lambda state: None):
    """Fly for a time; return the states."""
    states = []
    for _ in range(round(seconds * RATE)):
        states.append(world.frame())
        each(states[-1])
    return states


def hovering(parameters=PARAMETERS, **target):
    world = World(parameters, **target)
    world.tell()
    fly(world, 2.0)
    return world


def test_it_comes_to_the_set_distance_and_stays():
    world = World(target=(2.6, 0.3, 0.2))
    world.tell()
    states = fly(world, 5.0)
    assert world.distance() == pytest.approx(1.0, abs=0.02)
    assert states[-1].mode == Mode.FOLLOWING
    assert np.hypot(*world.velocity[:2]) < 0.03


def test_a_target_that_starts_drives_and_halts_is_followed_without_a_lag():
    world = hovering()
    errors = []
    for speed, seconds in ((1.0, 6.0), (0.0, 3.0)):
        for _ in range(round(seconds * RATE)):
            change = speed - world.target_velocity[0]
            world.target_velocity[0] += np.clip(change, -3.0 / RATE, 3.0 / RATE)
            world.frame()
            errors.append(world.distance() - 1.0)
    errors = np.array(errors)
    driving = errors[: round(6 * RATE)]
    assert driving.max() < 0.25
    assert np.abs(driving[-round(3 * RATE) :]).mean() < 0.03
    assert errors.min() > -0.16
    assert np.abs(errors[-round(1.5 * RATE) :]).max() < 0.05


def test_it_tells_the_velocity_of_the_target():
    world = hovering()
    world.target_velocity[:] = 0.5, 0.0, 0.0
    state = fly(world, 3.0)[-1]
    assert state.target_velocity == pytest.approx((0.5, 0.0, 0.0), abs=0.06)


def test_a_target_that_goes_around_is_faced():
    world = hovering()
    world.target_velocity[:] = 0.0, 0.5, 0.0
    for _ in range(round(4 * RATE)):
        state = world.frame()
        assert state.mode == Mode.FOLLOWING
    sight = world.target - world.centre()
    assert abs(math.remainder(math.atan2(sight[1], sight[0]) - world.yaw, 2 * math.pi)) < 0.3


def test_a_target_that_comes_is_backed_off_from():
    world = hovering()
    world.target_velocity[:] = -0.8, 0.0, 0.0
    nearest = []
    fly(world, 4.0, lambda state: nearest.append(world.distance()))
    assert min(nearest) > 0.55


def test_without_odometry_it_reckons_from_its_commands():
    world = World(target=(2.2, 0.0, 0.2))
    world.tell = lambda: None
    fly(world, 5.0)
    assert world.distance() == pytest.approx(1.0, abs=0.2)


def test_it_does_not_fly_into_a_post_in_its_way():
    world = World(target=(3.4, 0.0, 0.2))
    world.obstacles = [(np.array([1.6, 0.1, 0.7]), np.array([0.15, 0.15, 1.4]))]
    world.tell()
    clearances = []
    states = fly(world, 6.0, lambda state: clearances.append(world.clearance()))
    assert min(clearances) > 0.35
    assert any(state.mode == Mode.AVOIDING for state in states)


def test_what_left_the_view_is_remembered_when_backing_off():
    """It has seen a post, turns its back on it, and is driven towards it."""
    world = World()
    world.obstacles = [(np.array([1.6, 1.5, 0.6]), np.array([0.3, 0.3, 1.2]))]
    world.yaw = 0.5
    world.tell()
    fly(world, 1.0)
    world.position[:2] = 2.0, 2.4  # beyond the post, which is now behind it to the right
    world.velocity[:] = 0
    world.yaw = 0.9
    world.target = np.array([3.0, 3.6, 0.2])
    world.tell()
    fly(world, 1.0)  # a target that jumps is believed after half a second
    direction = (world.position - world.target) * [1.0, 1.0, 0.0]
    world.target_velocity = 0.7 * direction / np.linalg.norm(direction)
    clearances = []
    fly(world, 3.0, lambda state: clearances.append(world.clearance()))
    assert min(clearances) > 0.3


def test_unknown_space_is_entered_slowly():
    world = hovering(replace(PARAMETERS, lateral="strafe", strafe_gain=4.0))
    world.target = world.target + np.array([0.0, 0.5, 0.0])
    speeds = []
    fly(world, 0.6, lambda state: speeds.append(abs(state.command.y)))
    assert 0.2 < max(speeds) <= PARAMETERS.unknown_speed + 1e-6


def hide(world, seconds):
    """Put a wall between, for some time."""
    world.obstacles = [
        (np.array([*((world.position + world.target) / 2)[:2], 0.6]), np.array([0.1, 1.2, 1.2]))
    ]
    return fly(world, seconds)


def test_a_target_hidden_by_a_wall_is_found_again_from_beside():
    world = hovering(replace(PARAMETERS, set_distance=2.0), target=(2.6, 0.0, 0.2))
    clearances = []
    states = hide(world, 1.0)
    assert states[-1].mode in (Mode.SEARCHING, Mode.AVOIDING)
    for _ in range(round(12 * RATE)):
        state = world.frame()
        clearances.append(world.clearance())
        if state.mode == Mode.FOLLOWING:
            break
    assert state.mode == Mode.FOLLOWING
    assert min(clearances) > 0.35


@pytest.mark.parametrize("side", [-1, 1])
def test_a_target_that_left_the_view_is_turned_to(side):
    world = hovering()
    world.target_velocity[:] = 0.0, side * 2.0, 0.0
    turned = []
    for _ in range(round(1.2 * RATE)):
        world.frame()
    world.target_velocity[:] = 0
    for _ in range(round(8 * RATE)):
        state = world.frame()
        turned.append(state.command.yaw)
        if state.mode == Mode.FOLLOWING and len(turned) > RATE:
            break
    assert state.mode == Mode.FOLLOWING
    assert np.sign(turned[0]) in (0, side)


def test_a_search_in_vain_ends_in_hover():
    world = hovering()
    world.target = np.array([50.0, 0.0, 0.2])
    states = fly(world, PARAMETERS.search_time + 2.0)
    reasons = {state.reason for state in states if state.mode == Mode.SEARCHING}
    assert {phase.value for phase in Phase} <= reasons
    assert (states[-1].mode, states[-1].command) == (Mode.LOST, HOVER)
    assert states[-1].reason == "the search has ended in vain"


def test_without_search_time_it_hovers_for_good():
    world = hovering(replace(PARAMETERS, search_time=0.0))
    world.target = np.array([50.0, 0.0, 0.2])
    states = fly(world, 3.0)
    assert {state.mode for state in states} == {Mode.LOST}


def test_modes_change_only_along_their_edges():
    edges = {
        Mode.WAITING: {Mode.FOLLOWING, Mode.AVOIDING},
        Mode.FOLLOWING: {Mode.AVOIDING, Mode.LOST, Mode.WAITING},
        Mode.AVOIDING: {Mode.FOLLOWING, Mode.LOST, Mode.SEARCHING, Mode.WAITING},
        Mode.LOST: {Mode.FOLLOWING, Mode.AVOIDING, Mode.SEARCHING, Mode.WAITING},
        Mode.SEARCHING: {Mode.FOLLOWING, Mode.AVOIDING, Mode.LOST, Mode.WAITING},
    }
    world = hovering()
    random = np.random.default_rng(3)
    last = Mode.FOLLOWING
    for n in range(round(30 * RATE)):
        if n % 40 == 0:
            world.target = world.position + np.array([random.uniform(0.6, 3), random.uniform(-2, 2), -0.45])
            world.target_velocity[:] = *random.uniform(-1, 1, 2), 0.0
        mode = world.frame().mode
        assert mode == last or mode in edges[last]
        last = mode


def test_a_ground_vehicle_is_commanded_in_x_and_yaw_alone():
    parameters = replace(PARAMETERS, vehicle="ugv", camera_z=0.5, body_radius=0.5)
    world = World(parameters, target=(3.0, 0.4, 0.3))
    world.position[2] = 0.13
    world.tell()
    commands = [state.command for state in fly(world, 2.0)]
    assert all(command.y == command.z == 0 for command in commands)
    assert max(command.x for command in commands) > 0.5
    assert max(command.yaw for command in commands) > 0.1


@pytest.mark.parametrize("missing", ["cloud", "old cloud", "old box"])
def test_without_a_fresh_measurement_it_hovers(missing):
    world = hovering()
    world.target = world.target + np.array([0.5, 0.0, 0.0])
    fly(world, 0.3)
    cloud, box = world.see()
    t = world.time
    if missing == "cloud":
        state = world.follower.update(box, 1, t, t, None, -math.inf)
    elif missing == "old cloud":
        state = world.follower.update(box, 1, t, t, cloud, t - 0.31)
    else:
        state = world.follower.update(box, 1, t - 0.31, t, cloud, t)
    assert state.command == HOVER


def test_an_occluder_in_the_box_is_no_jump_of_the_distance():
    world = hovering()
    cloud, box = world.see()
    near = cloud.copy()
    near[: cloud.shape[0] // 2] *= 0.55
    t = world.time
    state = world.follower.update(box, 1, t, t, near, t)
    assert state.command.x > -0.3


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_every_command_is_finite_and_within_the_caps(data):
    parameters = replace(
        PARAMETERS,
        distance=data.draw(st.sampled_from(["stereo", "box"])),
        lateral=data.draw(st.sampled_from(["yaw", "strafe", "both"])),
        vehicle=data.draw(st.sampled_from(["uav", "ugv"])),
        max_speed=data.draw(st.floats(0.1, 3)),
        max_slew=data.draw(st.floats(1, 50)),
    )
    follower = Follower(parameters)
    number, size = st.floats(-1e4, 1e4), st.floats(0.01, 1e4)
    now, last = 100.0, HOVER
    for _ in range(4):
        now += 1 / RATE
        follower.add_odometry(
            now, [data.draw(number) for _ in "xyz"], (0, 0, math.sin(0.3), math.cos(0.3)),
            [data.draw(st.floats(-5, 5)) for _ in "xyz"],
        )  # fmt: skip
        box = data.draw(st.none() | st.builds(Box, number, number, size, size))
        cloud = np.full((120, 160, 3), np.nan, np.float32)
        cloud[::2] = data.draw(st.floats(0.01, 50))
        age = data.draw(st.floats(-0.5, 0.5))
        command = follower.update(box, 1, now, now, cloud, now - age).command
        values = np.array(astuple(command))
        assert np.isfinite(values).all()
        assert math.hypot(command.x, command.y) <= parameters.max_speed * (1 + 1e-9)
        assert abs(command.z) <= parameters.max_climb_rate
        assert abs(command.yaw) <= parameters.max_yaw_rate
        if command != HOVER:
            change = np.linalg.norm((values - np.array(astuple(last)))[:3])
            assert change <= parameters.max_slew * (0.3 if last is HOVER else 1.01 / RATE) + 1e-9 or _ == 0
        if abs(age) > parameters.max_age and parameters.distance == "stereo":
            assert command == HOVER
        last = command


def test_a_trend_tells_what_comes_on_from_what_jumps():
    trend = Trend(0.3)
    coming = [trend.ahead(n / RATE, 1.0 - 0.02 * n) for n in range(6)]
    assert coming[2] == pytest.approx(0.96)  # too few to tell
    assert coming[5] == pytest.approx(0.9 - 0.3 * 0.02 * RATE)
    assert trend.ahead(6 / RATE, 0.4) == 0.4  # another thing
    assert [trend.ahead((7 + n) / RATE, 0.4 + 0.05 * n) for n in range(6)][-1] == pytest.approx(
        0.65
    )  # leaves


def test_a_search_without_clouds_turns_and_climbs_only():
    world = hovering(replace(PARAMETERS, distance="box"))
    states = []
    for _ in range(round(12 * RATE)):
        t = world.time
        states.append(world.follower.update(None, 1, t, t, None, -math.inf))
        world.fly(states[-1].command)
    assert Mode.SEARCHING in {state.mode for state in states}
    assert all(state.command.x == state.command.y == 0 for state in states)
    assert any(state.command.yaw for state in states)
