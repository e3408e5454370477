"""The follower: one command for every box, and hover wherever it can't know better."""

import math
from dataclasses import dataclass
from enum import IntEnum

from tld_follower.following.avoidance import Avoidance
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
        self._distance = (StereoDistance if parameters.distance == "stereo" else BoxDistance)(parameters)
        self._controller = ThesisController(parameters)
        self._avoidance = Avoidance(parameters)
        self._seen = False

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
        if cloud is not None and (not -self._p.max_age <= cloud_age <= self._p.max_age):
            cloud = None
        if not -self._p.max_age <= box_age <= self._p.max_age:
            return State(Mode.LOST if self._seen else Mode.WAITING, f"the newest box is {box_age:.2f} s old")
        if box is None and not self._seen:
            return State(Mode.WAITING, "no target was shown yet")

        nearest = self._avoidance.nearest(cloud)
        retreat = self._avoidance.retreat(nearest)
        if box is None:
            if retreat:
                return State(Mode.AVOIDING, "something is too near", math.nan, nearest, Command(x=retreat))
            return State(Mode.LOST, "the target is not in view", math.nan, nearest)

        self._seen = True
        distance = self._distance.measure(box, target, cloud)
        command = self._controller.command(box, distance)
        if retreat:
            # Altitude is held: what is too near may be above or below. Yaw keeps the target in view.
            command = Command(x=retreat, yaw=command.yaw)
            return State(Mode.AVOIDING, "something is too near", distance, nearest, command)
        if cloud is None and self._p.distance == "stereo":
            return State(Mode.WAITING, "no fresh point cloud")
        if math.isnan(distance):
            return State(Mode.FOLLOWING, "no depth inside the box", distance, nearest, command)
        return State(Mode.FOLLOWING, "the target is in view", distance, nearest, command)
