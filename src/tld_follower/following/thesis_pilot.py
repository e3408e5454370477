"""The thesis' follower: equation 3.10, back off from what is too near, hover when the target is lost."""

import math
from dataclasses import replace

from tld_follower.following.avoidance import Avoidance
from tld_follower.following.controller import ThesisController
from tld_follower.following.distance import make_distance
from tld_follower.following.state import Mode, State


class ThesisPilot:
    """Decides for one target after another as thesis section 3.3 does; it needs no odometry."""

    def __init__(self, parameters, _own_motion):
        self._p = parameters
        self._controller = ThesisController(parameters)
        self._avoidance = Avoidance(parameters)
        self.take_target()

    def take_target(self):
        """Start afresh for another target: the first box of it sets the scale of `distance: box`."""
        self._distance = make_distance(self._p)

    def decide(self, scene):
        """Return the `State` for one `Scene`."""
        nearest = self._avoidance.nearest(scene.cloud)
        retreat = self._avoidance.retreat(nearest)
        if scene.box is None:
            if retreat:
                return State(Mode.AVOIDING, "something is too near", math.nan, nearest.distance, retreat)
            return State(Mode.LOST, "the target is not in view", math.nan, nearest.distance)

        distance = self._distance.measure(scene.box, scene.cloud)
        command = self._controller.command(scene.box, distance)
        if retreat:
            command = replace(retreat, yaw=command.yaw)  # keeps the target in view
            return State(Mode.AVOIDING, "something is too near", distance, nearest.distance, command)
        if scene.cloud is None and self._p.distance == "stereo":
            return State(Mode.WAITING, "no fresh point cloud")
        reason = "no depth inside the box" if math.isnan(distance) else "the target is in view"
        return State(Mode.FOLLOWING, reason, distance, nearest.distance, self._held_up(command, nearest))

    def _held_up(self, command, nearest):
        """Do not descend onto what is near: a target low in the image would lead into the ground."""
        if nearest.distance < self._p.minimum_distance + self._p.descent_margin:
            return replace(command, z=max(command.z, 0.0))
        return command
