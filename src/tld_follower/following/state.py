"""What the follower sees and what it decides."""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from tld_follower.box import Box
from tld_follower.following.controller import HOVER, Command
from tld_follower.following.own_motion import Motion


class Mode(IntEnum):
    """What the follower is doing; the numbers are those of FollowState.msg."""

    WAITING = 0
    FOLLOWING = 1
    AVOIDING = 2
    LOST = 3
    SEARCHING = 4


@dataclass(frozen=True)
class Scene:
    """One image's measurements, all fresh.

    box : where the target is, pixels of the left image; None while it is not visible.
    stamp, now : when the image was taken, and the present, s.
    cloud : points of the left image's pixels, ndarray (height, width, 3), metres, optical frame, NaN where
        there is no depth; None without a fresh one.
    cloud_stamp : when the cloud's images were taken, s.
    then, cloud_then, present : the drone's `Motion` at those three times.
    """

    box: Box | None
    stamp: float
    now: float
    cloud: np.ndarray | None
    cloud_stamp: float
    then: Motion
    cloud_then: Motion
    present: Motion


@dataclass(frozen=True)
class State:
    """What the follower decided for one box; distances in metres, NaN where unknown."""

    mode: Mode
    reason: str
    distance: float = math.nan
    nearest_obstacle: float = math.nan
    command: Command = HOVER
    target_velocity: tuple[float, float, float] = (math.nan,) * 3  # m/s, yaw frame
