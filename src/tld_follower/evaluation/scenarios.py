# SPDX-License-Identifier: BSD-3-Clause
"""The scenarios: functions of a seed that return the `Plan` of a flight. Seed 0 is the plain one."""

import math

from tld_follower.evaluation.encounters import approach, obstacle
from tld_follower.evaluation.fastboard import fastboard
from tld_follower.evaluation.losses import escape, occlusion
from tld_follower.evaluation.metrics import FOLLOWING
from tld_follower.evaluation.paths import following_path, scenery, stand_off, target_path
from tld_follower.evaluation.plan import Draw, Leg, Plan, Pose

# Those that make sense where the target moves all the time but never evenly for long.
_UNSTEADY = frozenset(FOLLOWING) - {"steady_error_m"}
# Where the drone is 1 m from the target drone at the origin, as in worlds/target_drone.world [m, m, rad].
_AIR_START = (-1.292, 0.0, 0.0)
# The same of a ground vehicle that follows Husky: worlds/ugv.world.
_GROUND_START = (-1.72, 0.0, 0.0)


def straight(seed):
    """Let the target rest, drive 12 s straight at 1 m/s and halt (thesis sections 4.2 and 4.3)."""
    draw = Draw("straight", seed)
    target = Pose(0.0, 0.0, 0.0)
    return Plan(
        "straight",
        stand_off(target, math.pi, draw),
        target,
        (Leg(12.0, 1.0),),
        frozenset(FOLLOWING),
        start=6.0,
        rest=6.0,
        world="testing_grounds.world",
        light=draw.light(),
    )


def _ground_plan(scenario, draw, legs):
    """Let Husky drive away by its legs, on open ground with things standing about."""
    target = Pose(0.0, 0.0, 0.0)
    drone = stand_off(target, math.pi, draw)
    path = target_path(target, legs, 0.0, sum(leg.duration for leg in legs))
    things = scenery(draw, path, following_path(path, drone))
    return Plan(scenario, drone, target, legs, _UNSTEADY, obstacles=things, light=draw.light())


def turn(seed):
    """Let the target take two sharp turns and a curve between straight stretches (figure 4.4 c)."""
    draw = Draw("turn", seed)
    legs = []
    for kind in ("sharp", "curve", "sharp"):
        speed, side = draw.between(0.6, 1.0), draw.side()
        legs.append(Leg(draw.between(1.5, 2.5), speed))
        if kind == "sharp":
            angle, rate, speed = draw.between(1.0, 2.1), draw.between(0.9, 1.5), draw.between(0.2, 0.5)
        else:
            angle, speed = draw.between(1.6, 3.1), draw.between(0.5, 0.9)
            rate = speed / draw.between(1.2, 2.5)
        legs.append(Leg(angle / rate, speed, side * rate))
    legs.append(Leg(1.5, draw.between(0.6, 1.0)))
    return _ground_plan("turn", draw, tuple(legs))


def stop_and_go(seed):
    """Let the target drive at varied speeds, with halts in between."""
    draw = Draw("stop_and_go", seed)
    legs = []
    for halts in (False, True, False, True, True):
        legs.append(Leg(draw.between(1.0, 2.5), draw.between(0.3, 1.0), draw.between(-0.2, 0.2)))
        if halts or draw.random.random() < 0.3:
            legs.append(Leg(draw.between(0.4, 1.5)))
        else:
            legs.append(Leg(draw.between(1.0, 2.0), draw.between(0.2, 0.5)))
    return _ground_plan("stop_and_go", draw, tuple(legs))


def _shifted(draw, x, y, yaw):
    return Pose(x + draw.between(-0.05, 0.05), y + draw.between(-0.15, 0.15), yaw + draw.between(-0.05, 0.05))


def target_drone(seed):
    """Let a second drone fly straight, turn, climb, sink and halt (figure 4.4 b, d)."""
    draw = Draw("target_drone", seed)
    speed, climb = draw.between(0.4, 0.9), draw.between(0.15, 0.35)
    rate, angle = draw.side() * draw.between(0.4, 0.8), draw.between(0.8, 1.6)
    sharp, way = -rate * draw.between(1.0, 1.4), draw.between(0.8, 1.6)
    legs = (
        Leg(2.5, speed),
        Leg(angle / abs(rate), speed, rate),
        Leg(2.0, draw.between(0.3, 0.7), climb=climb),
        Leg(draw.between(0.8, 1.5)),
        Leg(2.0, speed, climb=-draw.between(0.4, 0.8) * climb),
        Leg(way / abs(sharp), draw.between(0.1, 0.4), sharp),
        Leg(1.5, draw.between(0.4, 0.9)),
    )
    drone, target = _shifted(draw, *_AIR_START), Pose(0.0, 0.0, 0.0)
    path = target_path(target, legs, 0.0, sum(leg.duration for leg in legs))
    return Plan(
        "target_drone",
        drone,
        target,
        legs,
        _UNSTEADY,
        world="target_drone.world",
        obstacles=scenery(draw, path, following_path(path, drone)),
        light=draw.light(),
        target_robot="target",
    )


def ugv(seed):
    """Let a Husky that carries the stereo pair follow another one through curves and a halt."""
    draw = Draw("ugv", seed)
    speed, rate = draw.between(0.4, 0.8), draw.side() * draw.between(0.15, 0.4)
    legs = (
        Leg(2.5, speed),
        Leg(draw.between(0.6, 1.4) / abs(rate), speed, rate),
        Leg(draw.between(0.8, 1.5)),
        Leg(2.0, draw.between(0.3, 0.7)),
        Leg(draw.between(0.5, 1.2) / abs(rate), draw.between(0.4, 0.7), -rate),
        Leg(1.5, speed),
    )
    vehicle, target = _shifted(draw, *_GROUND_START), Pose(0.0, 0.0, 0.0)
    path = target_path(target, legs, 0.0, sum(leg.duration for leg in legs))
    return Plan(
        "ugv",
        vehicle,
        target,
        legs,
        _UNSTEADY,
        world="ugv.world",
        obstacles=scenery(draw, path, following_path(path, vehicle), room=3.0),
        light=draw.light(),
        vehicle="ugv",
    )


SCENARIOS = {
    plan.__name__: plan
    for plan in (
        *(straight, turn, stop_and_go, target_drone, ugv),
        *(approach, obstacle, occlusion, escape, fastboard),
    )
}
