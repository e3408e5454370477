"""The thesis' controller: pixel displacement and distance error mapped to velocities by eq. 3.10."""

import math
from dataclasses import dataclass

from tld_follower.following.mapping import to_velocity


@dataclass(frozen=True)
class Command:
    """Velocities in the drone's yaw frame (REP-103): x forward, y left, z up in m/s, yaw left in rad/s."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0


HOVER = Command()


class ThesisController:
    """Keep the box's centre on the image's centre and the target at the set distance (thesis section 3.3)."""

    def __init__(self, parameters):
        self._p = parameters

    def command(self, box, distance):
        """Return the `Command` for a box in pixels and a distance in metres (NaN: no forward motion)."""
        p = self._p
        half_width, half_height = p.image_width / 2, p.image_height / 2
        right = box.x + box.width / 2 - half_width
        down = box.y + box.height / 2 - half_height
        forward = 0.0 if math.isnan(distance) else distance - p.set_distance
        return Command(
            x=to_velocity(forward, p.distance_range, p.max_speed),
            y=-to_velocity(right, half_width, p.max_speed) if p.lateral != "yaw" else 0.0,
            z=-to_velocity(down, half_height, p.max_climb_rate),
            yaw=-to_velocity(right, half_width, p.max_yaw_rate) if p.lateral != "strafe" else 0.0,
        )
