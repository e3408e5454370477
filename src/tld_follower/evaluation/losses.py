# SPDX-License-Identifier: BSD-3-Clause
"""Scenarios of recovery: the target is hidden by something, or leaves the view."""

import math

import numpy as np

from tld_follower.evaluation.paths import (
    CAMERA_AHEAD,
    FOLLOWING_LENGTH,
    following_path,
    scenery,
    stand_off,
    target_path,
)
from tld_follower.evaluation.plan import Draw, Leg, Obstacle, Plan, Pose, Waypoint

RECOVERY = frozenset({"recovered_10s"})
_ORIGIN = Pose(0.0, 0.0, 0.0)
_TEXTURES = ("brick", "concrete", "crate", "container")
_START = 5.0
# From the camera of a drone that keeps its distance to the middle of a slab before it [m].
_SLAB_AHEAD = 0.66
# A slab that is out of the way stands so far aside [m].
_ASIDE = 2.2


def _plan(scenario, draw, drone, legs, things, rest):
    return Plan(
        scenario,
        drone,
        _ORIGIN,
        legs,
        RECOVERY,
        start=_START,
        rest=rest,
        obstacles=tuple(things),
        light=draw.light(),
    )


def occlusion(seed):
    """Let a slab pass between drone and target, or the target drive behind a standing wall."""
    draw = Draw("occlusion", seed)
    return (_slab, _wall_halt, _slab, _wall_through)[seed % 4](draw, seed)


def _moving_slab(draw, x_at, begin, hold, pace):
    """Slide a slab along y into the line of sight, hold it there, and out; its place is x_at(t), in m."""
    size = (0.1, draw.between(0.8, 1.2), draw.between(0.9, 1.3))
    side, over = draw.side(), draw.side()
    comes = begin + _ASIDE / pace
    goes = comes + hold
    ends = goes + _ASIDE / pace
    corners = np.array([begin, comes, goes, ends]), np.array([side, 0.0, 0.0, over]) * _ASIDE
    # Its place along the lane is given from point to point, every tenth of a second.
    times = sorted({round(float(t), 3) for t in (*corners[0], *np.arange(begin, ends, 0.1))})
    track = [Waypoint(t, x_at(t), float(np.interp(t, *corners))) for t in times]
    return Obstacle("slab", size, tuple(track), draw.choice(_TEXTURES)), ends


def _slab(draw, seed):
    """Let a slab come between, keep pace with the target, and leave; the target drives on all the time."""
    speed, begin = draw.between(0.4, 0.9), _START + draw.between(0.8, 2.5)
    pace, hold = draw.between(1.4, 2.2), draw.between(0.6, 2.5)
    back = FOLLOWING_LENGTH - CAMERA_AHEAD - _SLAB_AHEAD
    whole = target_path(_ORIGIN, (Leg(30.0, speed),), _START, 30.0)
    slab, ends = _moving_slab(draw, lambda t: whole.at(t).x - back, begin, hold, pace)
    drive = ends + draw.between(0.5, 1.5) - _START
    things = [slab]
    if seed % 4 == 2:  # a model of half the target's size, which looks the same from half the distance
        spot = Waypoint(0.0, whole.at(ends).x, draw.side() * 1.3)
        things.append(Obstacle("look_alike", (0.5, 0.35, 0.2), (spot,), model="look_alike.sdf"))
    drone = stand_off(_ORIGIN, math.pi, draw)
    return _plan("occlusion", draw, drone, (Leg(drive, speed),), things, rest=11.0)


def _side_view(draw):
    """Return on which side of Husky the drone hovers, and its `Pose` there: it sees Husky's flank."""
    side = draw.side()
    return side, stand_off(_ORIGIN, side * 0.5 * math.pi, draw)


def _wall(draw, side):
    """Put a wall beside the lane of a target that drives from the origin along x; the drone is on `side`."""
    length, thick = draw.between(2.4, 3.2), draw.between(0.08, 0.16)
    begin = draw.between(0.75, 1.0)
    spot = Waypoint(0.0, begin + 0.5 * length, side * (0.45 + 0.5 * thick))
    size = (length, thick, draw.between(0.8, 1.3))
    return Obstacle("wall", size, (spot,), draw.choice(_TEXTURES)), begin, length


def _wall_halt(draw, _seed):
    """Let the target drive behind a wall and halt there: a drone that hovers never sees it again."""
    side, drone = _side_view(draw)
    wall, begin, length = _wall(draw, side)
    speed = draw.between(0.4, 0.8)
    drive = (begin + 0.5 * length + draw.between(-0.2, 0.2)) / speed
    return _plan("occlusion", draw, drone, (Leg(drive, speed),), [wall], rest=12.0)


def _wall_through(draw, _seed):
    """Let the target drive behind a wall and come out at its far end."""
    side, drone = _side_view(draw)
    wall, begin, length = _wall(draw, side)
    speed = draw.between(0.5, 0.9)
    drive = (begin + length + draw.between(1.2, 2.0)) / speed
    return _plan("occlusion", draw, drone, (Leg(drive, speed),), [wall], rest=11.0)


def escape(seed):
    """Let the target leave the view: under cover, past the drone, by a sharp turn, below it, or sideways."""
    draw = Draw("escape", seed)
    return (_cover, _past, _sharp_turn, _under, _sideways)[seed % 5](draw)


def _open_escape(draw, drone, legs):
    path = target_path(_ORIGIN, legs, 0.0, sum(leg.duration for leg in legs))
    things = scenery(draw, path, following_path(path, drone), room=3.0)
    return _plan("escape", draw, drone, legs, things, rest=11.0)


def _sideways(draw):
    """Let the target, seen from its side, drive off across the view as fast as it can."""
    side, drone = _side_view(draw)
    bend = -side * draw.between(-0.1, 0.3)
    return _open_escape(draw, drone, (Leg(draw.between(2.5, 3.5), 1.0, bend),))


def _sharp_turn(draw):
    """Let the target drive away, turn about sharply and come back past the drone."""
    side, rate = draw.side(), draw.between(1.6, 2.0)
    angle = draw.between(2.2, 2.6)
    legs = (
        Leg(draw.between(1.0, 2.0), draw.between(0.6, 0.9)),
        Leg(angle / rate, 0.6, side * rate),
        Leg(draw.between(3.0, 4.0), 1.0, 0.0),
    )
    return _open_escape(draw, stand_off(_ORIGIN, math.pi, draw), legs)


def _past(draw):
    """Let the target, head on and to one side of the drone, drive past it."""
    drone = stand_off(_ORIGIN, draw.side() * draw.between(0.62, 0.75), draw)
    return _open_escape(draw, drone, (Leg(draw.between(3.5, 4.5), 1.0),))


def _under(draw):
    """Let the target drive at the drone as fast as it can, and on below it if it stays."""
    drone = stand_off(_ORIGIN, 0.0, draw)
    return _open_escape(draw, drone, (Leg(draw.between(3.0, 4.0), 1.0),))


def _cover(draw):
    """Let a slab come between; under its cover the target turns aside and drives off."""
    drone = stand_off(_ORIGIN, math.pi, draw)
    side, rate = draw.side(), draw.between(1.4, 1.9)
    hold, pace = draw.between(3.2, 4.2), draw.between(1.4, 2.2)
    begin = _START - _ASIDE / pace + 0.5
    x = drone.x + CAMERA_AHEAD + _SLAB_AHEAD
    slab, _ = _moving_slab(draw, lambda _: x, begin, hold, pace)
    legs = (
        Leg(0.8),
        Leg(1.0, 0.5),
        Leg(draw.between(1.2, 1.6) / rate, 0.4, side * rate),
        Leg(draw.between(2.5, 3.5), 1.0),
    )
    return _plan("escape", draw, drone, legs, [slab], rest=11.0)
