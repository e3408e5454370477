# SPDX-License-Identifier: BSD-3-Clause
import math
import xml.etree.ElementTree as ElementTree

import pytest

from tld_follower.evaluation.graph import world_file
from tld_follower.evaluation.plan import Leg, Light, Obstacle, Plan, Pose, Waypoint
from tld_follower.evaluation.scenarios import SCENARIOS
from tld_follower.evaluation.worlds import WorldError, write_world

TLD = "{urn:tld_follower}"
POST = Obstacle(
    "post", (0.2, 0.2, 1.5), (Waypoint(1.0, 2.0, -1.0), Waypoint(3.0, 2.0, 1.0, 0.5)), "post", "cylinder"
)
WALL = Obstacle("wall", (0.1, 2.0, 1.0), (Waypoint(0.0, 4.0, 1.0, 0.3),))


def plan(**more):
    return Plan("s", Pose(-2.0, 0.5, 0.1), Pose(1.0, 2.0, -0.5), (Leg(1.0, 1.0),), frozenset(), **more)


def written(tmp_path, made, base=None):
    write_world(made, base or world_file(made.world), tmp_path / "s.world")
    return ElementTree.parse(tmp_path / "s.world").getroot().find("world")


def numbers(text):
    return [float(word) for word in text.split()]


def test_robots_start_where_the_plan_says_at_their_own_height(tmp_path):
    world = written(tmp_path, plan())
    poses = {robot.findtext("name"): numbers(robot.findtext("pose")) for robot in world.findall("include")}
    assert poses["spiri"] == [-2.0, 0.5, 0.0405, 0.0, 0.0, 0.1]
    assert poses["husky"] == [1.0, 2.0, 0.1325, 0.0, 0.0, -0.5]


def test_obstacles_stand_on_the_ground_or_move_by_waypoints(tmp_path):
    world = written(tmp_path, plan(obstacles=(POST, WALL)))
    post, wall = (world.find(f"model[@name='{name}']") for name in ("post", "wall"))
    ways = [numbers(waypoint.text) for waypoint in post.findall(f"{TLD}waypoint")]
    assert ways == [[1.0, 2.0, -1.0, 0.75, 0.0, 0.0, 0.0], [3.0, 2.0, 1.0, 0.75, 0.0, 0.0, 0.5]]
    assert post.find("static") is None
    for part in ("collision", "visual"):
        assert float(post.findtext(f"link/{part}/geometry/cylinder/radius")) == 0.1
        assert numbers(wall.findtext(f"link/{part}/geometry/box/size")) == [0.1, 2.0, 1.0]
    assert numbers(wall.findtext("pose")) == [4.0, 1.0, 0.5, 0.0, 0.0, 0.3]
    assert wall.findtext("static") == "true"


def test_the_plain_light_is_the_worlds_and_another_one_turns_and_dims_it(tmp_path):
    own = written(tmp_path, plan())
    other = written(tmp_path, plan(light=Light(azimuth=math.pi / 2, elevation=0.5, sun=0.5, ambient=0.5)))
    assert numbers(own.findtext("scene/ambient"))[:3] == pytest.approx([0.52, 0.54, 0.58])
    assert numbers(other.findtext("scene/ambient"))[:3] == pytest.approx([0.26, 0.27, 0.29])
    assert numbers(other.findtext("light/diffuse"))[0] == pytest.approx(0.36)
    before, after = (numbers(world.findtext("light/direction")) for world in (own, other))
    length = math.hypot(0.45, 0.40, 0.80)
    assert before == pytest.approx([0.45 / length, -0.40 / length, -0.80 / length], abs=1e-5)
    assert math.atan2(after[1], after[0]) - math.atan2(before[1], before[0]) == pytest.approx(math.pi / 2)
    assert after[2] == pytest.approx(-math.sin(0.5), abs=1e-5)


def test_files_beside_a_world_of_the_users_are_found_from_elsewhere(tmp_path):
    folder = tmp_path / "own"
    folder.mkdir()
    (folder / "picture.png").touch()
    with open(world_file("empty.world")) as file:
        (folder / "own.world").write_text(file.read().replace("media/ground.png", "picture.png"))
    world = written(tmp_path, plan(), folder / "own.world")
    maps = [element.text for element in world.iter("albedo_map")]
    assert str(folder / "picture.png") in maps


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("not a world", "not XML"),
        ("<sdf version='1.6'/>", "no <world>"),
        ("<sdf version='1.6'><world name='w'/></sdf>", "no robot named 'spiri'"),
    ],
)
def test_a_base_world_that_will_not_do_is_refused(tmp_path, text, reason):
    base = tmp_path / "base.world"
    base.write_text(text)
    with pytest.raises(WorldError, match=reason):
        write_world(plan(), base, tmp_path / "s.world")


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_has_a_world(tmp_path, name):
    made = SCENARIOS[name](2)
    world = written(tmp_path, made)
    names = {
        element.get("name") or element.findtext("name")
        for element in [*world.iter("model"), *world.iter("include")]
    }
    assert {obstacle.name for obstacle in made.obstacles} <= names
