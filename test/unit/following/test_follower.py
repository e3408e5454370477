"""Properties of the follower: where it can't know better it hovers, and what is too near comes first."""

import math
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from tld_follower.box import Box
from tld_follower.following.controller import HOVER
from tld_follower.following.follower import Follower, Mode
from tld_follower.following.parameters import Parameters

PARAMETERS = Parameters(
    control="thesis", image_width=320, image_height=240, max_speed=1.0, max_yaw_rate=1.0, max_slew=1e6
)
CENTRE = Box(130, 95, 60, 50)


def scene(target, background=4.0):
    """A target that covers the box CENTRE generously, before a background; metres."""
    points = np.zeros((240, 320, 3), np.float32)
    points[..., 2] = background
    points[80:160, 110:210, 2] = target
    return points


def step(follower, box=CENTRE, cloud=None, target=1, box_age=0.02, cloud_age=0.02):
    now = follower.now = getattr(follower, "now", 100.0) + 1 / 30
    return follower.update(box, target, now - box_age, now, cloud, now - cloud_age)


def test_waits_until_a_target_was_seen():
    state = step(Follower(PARAMETERS), box=None, cloud=scene(0.3))
    assert (state.mode, state.command) == (Mode.WAITING, HOVER)


def test_holds_at_the_set_distance():
    state = step(Follower(PARAMETERS), cloud=scene(1.0))
    assert state.mode == Mode.FOLLOWING
    assert state.distance == pytest.approx(1.0)
    assert astuple(state.command) == pytest.approx((0, 0, 0, 0), abs=1e-9)


@pytest.mark.parametrize(
    ("distance", "speed"), [(1.3, 0.5), (1.6, 1.0), (3.0, 1.0), (0.85, -0.25), (0.7, -0.5)]
)
def test_distance_error_maps_to_forward_speed(distance, speed):
    assert step(Follower(PARAMETERS), cloud=scene(distance)).command.x == pytest.approx(speed, abs=1e-5)


def test_turns_and_climbs_towards_the_box():
    command = step(Follower(PARAMETERS), box=Box(110, 80, 20, 20), cloud=scene(1.0)).command
    assert command.yaw == pytest.approx(40 / 160)  # the box is left of the centre: yaw left
    assert command.z == pytest.approx(0.5 * 30 / 120)  # and above it: climb
    assert command.y == 0


@pytest.mark.parametrize(("lateral", "strafes", "yaws"), [("strafe", True, False), ("both", True, True)])
def test_lateral_motion(lateral, strafes, yaws):
    follower = Follower(replace(PARAMETERS, lateral=lateral))
    command = step(follower, box=Box(110, 95, 20, 50), cloud=scene(1.0)).command
    assert (command.y > 0, command.yaw > 0) == (strafes, yaws)


def test_ignoring_the_depth_would_show():
    near, far = (step(Follower(PARAMETERS), cloud=scene(d)).command.x for d in (0.8, 1.2))
    assert near < 0 < far


def test_lost_is_hover():
    follower = Follower(PARAMETERS)
    step(follower, cloud=scene(2.0))
    state = step(follower, box=None, cloud=scene(2.0))
    assert (state.mode, state.command) == (Mode.LOST, HOVER)


@pytest.mark.parametrize("box", [CENTRE, None])
def test_backs_off_from_anything_too_near_and_ends_it(box):
    follower = Follower(PARAMETERS)
    step(follower, cloud=scene(2.0))
    cloud = scene(2.0)
    cloud[:60, :80, 2] = 0.4  # beside the target
    cloud[:60, :80, :2] = 0
    state = step(follower, box=box, cloud=cloud)
    assert state.mode == Mode.AVOIDING
    assert state.command.x < 0
    assert state.command.y == 0
    assert state.nearest_obstacle == pytest.approx(0.4)
    cloud[:60, :80, 2] = 0.53  # within the hysteresis: goes on
    assert step(follower, box=box, cloud=cloud).mode == Mode.AVOIDING
    cloud[:60, :80, 2] = 0.56
    assert step(follower, box=box, cloud=cloud).mode == (Mode.FOLLOWING if box else Mode.LOST)


@pytest.mark.parametrize(
    "arguments",
    [
        {"cloud": None},
        {"cloud": scene(2.0), "cloud_age": 0.4},
        {"cloud": scene(2.0), "cloud_age": -5.0},
        {"cloud": scene(2.0), "box_age": 0.4},
        {"cloud": scene(2.0), "box_age": -5.0},
        {"cloud": scene(2.0), "box_age": math.nan},
        {"cloud": scene(2.0), "cloud_age": math.nan},
    ],
)
def test_without_a_fresh_measurement_it_hovers(arguments):
    follower = Follower(PARAMETERS)
    assert step(follower, cloud=scene(2.0)).command.x > 0
    assert step(follower, **arguments).command == HOVER


def test_a_cloud_without_depth_gives_no_forward_motion():
    state = step(Follower(PARAMETERS), cloud=np.full((240, 320, 3), np.nan, np.float32))
    assert state.command.x == 0
    assert math.isnan(state.distance)


def test_box_distance_needs_no_cloud_but_heeds_one():
    follower = Follower(replace(PARAMETERS, distance="box"))
    step(follower)
    assert step(follower, box=Box(145, 107.5, 30, 25)).command.x == pytest.approx(1.0)
    assert step(follower, cloud=scene(0.4)).mode == Mode.AVOIDING


def ground(height, pitch=0.34):
    """The cloud of flat ground, seen from `height` metres by a camera pitched down; f = 250 pixels."""
    v, u = np.mgrid[:240, :320]
    rays = np.dstack([(u - 160) / 250, (v - 120) / 250, np.ones(u.shape)])
    down = rays[..., 1] * math.cos(pitch) + rays[..., 2] * math.sin(pitch)
    return np.where(down > 0.05, height / down, np.nan)[..., None] * rays


def test_backing_off_from_the_ground_climbs_until_it_is_clear():
    follower = Follower(PARAMETERS)
    step(follower, cloud=ground(1.0))
    height = 0.34
    for _ in range(600):
        state = step(follower, box=None, cloud=ground(height))
        if state.mode != Mode.AVOIDING:
            break
        assert state.command.z > 0
        height += state.command.z / 30
    assert state.mode == Mode.LOST
    assert 0.34 < height < 0.5


def test_does_not_descend_onto_what_is_near():
    low = Box(130, 200, 60, 40)
    assert step(Follower(PARAMETERS), box=low, cloud=ground(1.0)).command.z < 0
    state = step(Follower(PARAMETERS), box=low, cloud=ground(0.42))
    assert state.mode == Mode.FOLLOWING
    assert state.command.z == 0


def test_what_enters_the_blind_zone_is_not_forgotten():
    follower = Follower(PARAMETERS)
    step(follower, cloud=scene(2.0))
    assert step(follower, cloud=scene(0.4)).mode == Mode.AVOIDING
    state = step(follower, cloud=np.full((240, 320, 3), np.nan, np.float32))
    assert (state.mode, state.command) == (Mode.AVOIDING, HOVER)


def test_a_new_target_sets_the_scale_of_the_box_distance():
    follower = Follower(replace(PARAMETERS, distance="box"))
    assert step(follower, box=Box(140, 100, 40, 40)).distance == pytest.approx(1.0)
    assert step(follower, box=Box(150, 110, 20, 20)).distance == pytest.approx(2.0)
    assert step(follower, box=Box(150, 110, 20, 20), target=2).distance == pytest.approx(1.0)
    # A tracker that was restarted counts its targets from one again, but begins with none.
    assert step(follower, box=None, target=0).mode == Mode.WAITING
    assert step(follower, box=Box(130, 90, 60, 60), target=2).distance == pytest.approx(1.0)


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_every_command_is_finite_and_within_the_caps(data):
    number = st.floats(-1e4, 1e4)
    parameters = replace(
        PARAMETERS,
        distance=data.draw(st.sampled_from(["stereo", "box"])),
        lateral=data.draw(st.sampled_from(["yaw", "strafe", "both"])),
        max_speed=data.draw(st.floats(0.1, 3)),
    )
    follower = Follower(parameters)
    for _ in range(3):
        size = st.floats(0.01, 1e4)
        box = data.draw(st.none() | st.builds(Box, number, number, size, size))
        cloud = data.draw(st.sampled_from([None, "plane", "holes"]))
        if cloud is not None:
            holes = cloud == "holes"
            cloud = scene(data.draw(st.floats(0.01, 50)), data.draw(st.floats(0.01, 50)))
            if holes:
                cloud[::2] = np.nan
        state = step(follower, box, cloud, cloud_age=data.draw(st.floats(-1, 1)))
        command = state.command
        assert all(math.isfinite(value) for value in astuple(command))
        assert max(abs(command.x), abs(command.y)) <= parameters.max_speed
        assert abs(command.z) <= parameters.max_climb_rate
        assert abs(command.yaw) <= parameters.max_yaw_rate
        if state.nearest_obstacle < parameters.minimum_distance and state.mode != Mode.WAITING:
            assert command.x < 0 or command.z > 0


@pytest.mark.parametrize(
    "values",
    [
        {"control": "magic"},
        {"distance": "sonar"},
        {"lateral": "up"},
        {"max_speed": 0},
        {"max_age": math.nan},
        {"near_percentile": 101.0},
        {"obstacle_fraction": 5.0},
        {"max_speed": [1]},
        {"set_distance": "abc"},
        {"image_width": 320.9},
        {"min_points": True},
        {"minimum_distance": 1.5},
        {"nonsense": 1},
    ],
)
def test_wrong_parameters_are_refused(values):
    with pytest.raises(ValueError, match=next(iter(values))):
        Parameters.from_dict(values)


def test_the_config_file_gives_the_defaults():
    config = Path(__file__).resolve().parents[3] / "config" / "follower.yaml"
    values = yaml.safe_load(config.read_text())
    assert Parameters.from_dict(values) == Parameters()
    assert set(values) == set(Parameters.__dataclass_fields__)


@pytest.mark.parametrize("x", [290.0, 321.0, 500.0, 1e6])
@pytest.mark.parametrize("distance", [0.8, 3.0])
def test_a_box_that_leaves_the_image_at_the_right_turns_right(x, distance):
    """The right camera may still see what has left the left image."""
    box = Box(x, 95, 60, 50)
    state = step(Follower(PARAMETERS), box=box, cloud=scene(1.0, background=distance))
    assert state.command.yaw < -0.9
    assert state.command.yaw >= -PARAMETERS.max_yaw_rate


@pytest.mark.parametrize("box", [Box(321, 95, 60, 50), Box(-70, 95, 60, 50), Box(130, 245, 60, 50)], ids=str)
def test_without_points_inside_the_box_it_does_not_fly_forward(box):
    state = step(Follower(PARAMETERS), box=box, cloud=scene(3.0))
    assert math.isnan(state.distance)
    assert state.reason == "no depth inside the box"
    assert state.command.x == 0.0


def test_what_still_shows_of_a_box_gives_its_distance():
    cloud = scene(3.0)
    cloud[80:160, 300:, 2] = 1.2
    state = step(Follower(PARAMETERS), box=Box(302, 95, 60, 50), cloud=cloud)
    assert state.distance == pytest.approx(1.2, abs=0.01)
