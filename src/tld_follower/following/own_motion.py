"""The drone's own motion from its odometry: where it was when an image was taken, and where it is now."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

GRAVITY = 9.81  # m/s^2
_KEPT = 2.0  # s of history
_SILENT = 0.5  # s without odometry: it has failed or there is none
_VELOCITY_GAIN = 10.0  # 1/s, how fast the estimate follows the measured velocity
_BIAS_GAIN = 10.0  # 1/s^2, how fast what the tilt does not explain (drag, wind) is learnt
_LONGEST_STEP = 0.2  # s; after a longer gap the estimate starts afresh


@dataclass(frozen=True)
class Motion:
    """Position [m], attitude (body to odom), velocity [m/s] and acceleration [m/s^2] in the odom frame."""

    stamp: float
    position: np.ndarray
    attitude: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray

    @property
    def yaw(self):
        """Heading in the odom frame, rad."""
        return math.atan2(self.attitude[1, 0], self.attitude[0, 0])

    def at(self, stamp):
        """Return the motion at another time: moved on evenly, turned not."""
        ahead = stamp - self.stamp
        return Motion(
            stamp,
            self.position + ahead * self.velocity,
            self.attitude,
            self.velocity + ahead * self.acceleration,
            self.acceleration,
        )


def level(yaw):
    """Rotation from the yaw frame (x forward, y left, z up) to the odom frame, shape (3, 3)."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation(x, y, z, w):
    """Rotation matrix of a unit quaternion."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


class OwnMotion:
    """Filters odometry, and stands in for it by dead reckoning where a drone has none.

    A multirotor's tilt is its horizontal acceleration: a = g (R e_z)_xy / (R e_z)_z. That, less a slowly
    learnt bias (drag, wind), predicts the velocity; the measured one corrects it. So the estimate has neither
    the noise of optical flow nor the lag of a low-pass filter.
    """

    def __init__(self, parameters):
        self._tilts = parameters.vehicle == "uav"
        self._lag, self._tilt_lag = parameters.velocity_lag, parameters.tilt_lag
        self._history = deque()
        self._bias = np.zeros(3)
        self._heard = -math.inf

    @property
    def measured(self):
        """Whether there is odometry; else positions are reckoned, and good for a short time only."""
        return bool(self._history) and self._history[-1].stamp - self._heard <= _SILENT

    def add(self, stamp, position, quaternion, velocity):
        """Take a measurement.

        Parameters
        ----------
        stamp : float
            Seconds; one before the last is dropped.
        position : sequence of 3
            Metres, odom frame.
        quaternion : sequence of 4
            x, y, z, w of the body in the odom frame.
        velocity : sequence of 3
            m/s in the body frame.

        Raises
        ------
        ValueError
            If a number is not finite or the quaternion has no length.
        """
        numbers = np.array([*position, *quaternion, *velocity], dtype=float)
        length = np.linalg.norm(numbers[3:7])
        if not np.isfinite(numbers).all() or not length > 0.1:
            raise ValueError("odometry is not finite or has no attitude")
        attitude = rotation(*(numbers[3:7] / length))
        measured = attitude @ numbers[7:]
        self._heard = stamp
        last = self._history[-1] if self._history else None
        if last is not None and stamp <= last.stamp:
            return
        tilt = np.zeros(3)
        if self._tilts:
            up = attitude[:, 2]
            tilt[:2] = GRAVITY * up[:2] / max(up[2], 0.3)
        if last is None or stamp - last.stamp > _LONGEST_STEP:
            self._bias = np.zeros(3)
            self._keep(Motion(stamp, numbers[:3], attitude, measured, tilt))
            return
        step = stamp - last.stamp
        acceleration = tilt + self._bias
        predicted = last.velocity + step * acceleration
        error = measured - predicted
        velocity = predicted + min(1.0, _VELOCITY_GAIN * step) * error
        self._bias = self._bias + min(1.0, _BIAS_GAIN * step) * error
        self._keep(Motion(stamp, numbers[:3], attitude, velocity, tilt + self._bias))

    def reckon(self, now, command):
        """Without odometry, assume that the drone answers `command` (yaw frame) with its lags."""
        if now - self._heard <= _SILENT:
            return
        last = self._history[-1] if self._history else None
        if last is None or not 0 < now - last.stamp <= _LONGEST_STEP:
            zero = np.zeros(3)
            position = zero if last is None else last.position
            attitude = np.eye(3) if last is None else level(last.yaw)
            if last is None or now > last.stamp:
                self._keep(Motion(now, position, attitude, zero, zero))
            return
        step = now - last.stamp
        yaw = last.yaw + step * command.yaw
        wanted = level(yaw) @ np.array([command.x, command.y, command.z])
        answer = 1 - math.exp(-step / self._tilt_lag)
        acceleration = last.acceleration + answer * ((wanted - last.velocity) / self._lag - last.acceleration)
        velocity = last.velocity + step * acceleration
        self._keep(Motion(now, last.position + step * velocity, level(yaw), velocity, acceleration))

    def at(self, stamp):
        """Return the `Motion` at a time: between two samples, or on from the last; None without any."""
        if not self._history:
            return None
        later = None
        for sample in reversed(self._history):
            if sample.stamp <= stamp:
                if later is None:
                    return sample.at(min(stamp, sample.stamp + _LONGEST_STEP))
                share = (stamp - sample.stamp) / (later.stamp - sample.stamp)
                nearer = later if share > 0.5 else sample
                return Motion(
                    stamp,
                    sample.position + share * (later.position - sample.position),
                    nearer.attitude,
                    sample.velocity + share * (later.velocity - sample.velocity),
                    sample.acceleration + share * (later.acceleration - sample.acceleration),
                )
            later = sample
        return later

    def _keep(self, motion):
        self._history.append(motion)
        while self._history[0].stamp < motion.stamp - _KEPT:
            self._history.popleft()
