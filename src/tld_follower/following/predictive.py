"""The predictive controller: leads with the target's velocity, brakes in time for the drone's limits."""

import math

import numpy as np

from tld_follower.following.controller import Command
from tld_follower.following.own_motion import level

_RECKONED_POLE = 2.0  # 1/s
_FACING = math.radians(60)  # a target farther to the side than this is turned to before it is flown to


class PredictiveController:
    """Keeps the distance e = d - d_set at zero while the target moves.

    The drone answers a velocity command u as v' = a, a' = (K (u - v) - a) / T, with K = 1 / `velocity_lag`
    and T = `tilt_lag`. Taking the target's velocity v_t as given, the command that puts all three poles of e
    at -p is u = v + a* / K with

        a* = T p^3 e + 3 T p^2 (v_t - v) - (3 T p - 1) a.

    a* is held within the drone's acceleration. p is larger while the target comes nearer (`near_pole`) than
    while it draws away (`far_pole`): being late to brake is worse than being late to start.
    """

    def __init__(self, parameters):
        self._p = parameters

    def command(self, position, velocity, motion, camera, measured):
        """Compute the command of this moment.

        Parameters
        ----------
        position, velocity : ndarray, shape (3,)
            The target's near surface, m and m/s in the odom frame.
        motion : Motion
            The drone's own.
        camera : Camera
        measured : bool
            Whether the drone's motion is; where it is reckoned, the law is slow: the tilt is not known.

        Returns
        -------
        Command
        """
        to_yaw_frame = level(motion.yaw).T
        sight = to_yaw_frame @ (position - camera.centre(motion))
        target, own = to_yaw_frame @ velocity, to_yaw_frame @ motion.velocity
        bearing = math.atan2(sight[1], sight[0])
        along = self._along(sight, target, own, to_yaw_frame @ motion.acceleration, measured)
        if abs(bearing) > _FACING:
            along = np.minimum(along, 0.0)
        horizontal = self._lateral(along, sight, target, bearing)
        return Command(
            x=float(horizontal[0]),
            y=float(horizontal[1]),
            z=self._climb(sight, target, own, motion, camera),
            yaw=self._turn(sight, target - own, bearing),
        )

    def _along(self, sight, target, own, acceleration, measured):
        """Horizontal velocity along the line of sight, yaw frame, shape (2,)."""
        p = self._p
        distance = float(np.linalg.norm(sight))
        direction = sight[:2] / max(float(np.hypot(*sight[:2])), 1e-6)
        error = distance - p.set_distance
        opening = float((target - own)[:2] @ direction)
        near = error + p.anticipation * opening < 0
        pole = _RECKONED_POLE if not measured else p.near_pole if near else p.far_pole
        wanted = (
            p.tilt_lag * pole**3 * error
            + 3 * p.tilt_lag * pole**2 * opening
            - (3 * p.tilt_lag * pole - 1) * float(acceleration[:2] @ direction)
        )
        wanted = min(max(wanted, -p.max_acceleration), p.max_acceleration)
        speed = float(own[:2] @ direction) + wanted * p.velocity_lag
        return min(max(speed, -p.max_speed), p.max_speed) * direction

    def _lateral(self, along, sight, target, bearing):
        """Undo a displacement to the side by turning (yaw), by flying sideways (strafe), or both."""
        p = self._p
        if p.lateral == "yaw":
            return np.array([along[0], 0.0])
        if p.lateral == "both":
            side = np.array([-math.sin(bearing), math.cos(bearing)])
            return along + float(target[:2] @ side) * side
        return np.array([along[0], target[1] + p.strafe_gain * sight[1]])

    def _turn(self, sight, relative, bearing):
        if self._p.lateral == "strafe":
            return 0.0
        distance = max(float(np.hypot(*sight[:2])), 0.3)
        sweep = (relative[1] * math.cos(bearing) - relative[0] * math.sin(bearing)) / distance
        rate = sweep + self._p.yaw_gain * bearing
        return min(max(rate, -self._p.max_yaw_rate), self._p.max_yaw_rate)

    def _give_way(self, sight, relative):
        """Climb from a target that comes too near, faster than the drone can brake [m/s]."""
        p = self._p
        distance = float(np.linalg.norm(sight))
        if sight[2] > 0:
            return 0.0
        short = p.set_distance - distance - p.anticipation * float(relative @ sight) / distance
        return min(1.0, max(0.0, short) / p.give_way_range) * p.max_climb_rate

    def _climb(self, sight, target, own, motion, camera):
        """Keep the target on the camera's axis; rise while the drone leans forward, not to lose it above."""
        if self._p.vehicle == "ugv":
            return 0.0
        nose_down = max(0.0, -math.asin(max(-1.0, min(1.0, float(motion.attitude[2, 0])))))
        slope = math.tan(min(camera.pitch + nose_down, math.radians(60)))
        error = float(np.hypot(*sight[:2])) * slope + sight[2]
        rate = target[2] + self._p.climb_gain * error + self._give_way(sight, target - own)
        return min(max(rate, -self._p.max_climb_rate), self._p.max_climb_rate)
