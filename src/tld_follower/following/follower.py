"""The follower: one command for every box, and hover wherever it can't know better."""

import math
from dataclasses import dataclass, replace
from enum import IntEnum

from tld_follower.following.avoidance import Avoidance, Nearest
from tld_follower.following.controller import HOVER, Command, ThesisController
from tld_follower.following.distance import BoxDistance, StereoDistance


class Mode(IntEnum):
    """What the follower is doing; the numbers are those of FollowState.msg."""

    WAITING = 0
    FOLLOWING = 1
    AVOIDING = 2
    LOST = 3
    SEARCHING = 4


@dataclass(frozen=True)
class State:
    """What the follower decided for one box; distances in metres, NaN where unknown."""

    mode: Mode
    reason: str
    distance: float = math.nan
    nearest_obstacle: float = math.nan
    command: Command = HOVER


class Follower:
    """Turns each box and its cloud into one command.

    Backing off from what is too near comes before following; following needs a visible box and, with
    `distance: stereo`, a cloud, both younger than `max_age`; anything else is hover.
    """

    def __init__(self, parameters):
        self._p = parameters
        self._controller = ThesisController(parameters)
        self._avoidance = Avoidance(parameters)
        self._take_target(0)

    def _take_target(self, target):
        """Start afresh for another target: the first box of it sets the scale of `distance: box`."""
        self._target = target
        self._seen = False
        self._distance = (StereoDistance if self._p.distance == "stereo" else BoxDistance)(self._p)

    def update(self, box, target, box_age, cloud, cloud_age):
        """Decide what to do about one box.

        Parameters
        ----------
        box : Box or None
            The target in pixels of the left image; None while it is not visible.
        target : int
            Which target the box belongs to; another number is another target.
        box_age : float
            Seconds since the box's image was taken.
        cloud : ndarray of shape (image_height, image_width, 3), or None
            Points in metres in the left camera's optical frame, NaN where there is no depth.
        cloud_age : float
            Seconds since the cloud's images were taken.

        Returns
        -------
        State
        """
        if target != self._target:
            self._take_target(target)
        if not -self._p.max_age <= cloud_age <= self._p.max_age:
            cloud = None
        if not -self._p.max_age <= box_age <= self._p.max_age:
            return State(Mode.LOST if self._seen else Mode.WAITING, "the newest box is too old")
        if box is None and not self._seen:
            return State(Mode.WAITING, "no target was shown yet")

        nearest = self._avoidance.nearest(cloud)
        retreat = self._avoidance.retreat(nearest)
        if box is None:
            if retreat:
                return State(Mode.AVOIDING, "something is too near", math.nan, nearest.distance, retreat)
            return State(Mode.LOST, "the target is not in view", math.nan, nearest.distance)

        self._seen = True
        distance = self._distance.measure(box, cloud)
        command = self._controller.command(box, distance)
        if retreat:
            command = replace(retreat, yaw=command.yaw)  # keeps the target in view
            return State(Mode.AVOIDING, "something is too near", distance, nearest.distance, command)
        if cloud is None and self._p.distance == "stereo":
            return State(Mode.WAITING, "no fresh point cloud")
        reason = "no depth inside the box" if math.isnan(distance) else "the target is in view"
        return State(Mode.FOLLOWING, reason, distance, nearest.distance, self._held_up(command, nearest))

    def _held_up(self, command, nearest: Nearest):
        """Do not descend onto what is near: a target low in the image would lead into the ground."""
        if nearest.distance < self._p.minimum_distance + self._p.descent_margin:
            return replace(command, z=max(command.z, 0.0))
        return command
