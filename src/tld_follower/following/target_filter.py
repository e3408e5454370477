"""Where the target is and how it moves, in the odom frame: a Kalman filter over box and range."""

import numpy as np

_BEARING_SIGMA = 0.01  # rad, of the box's centre
_UNKNOWN_RANGE_SIGMA = 0.5  # m, along the ray while only the bearing is measured
_LONE = 6.0  # of `range_sigma`: a range so far off is weighed less unless the one before was off likewise
_MANOEUVRE = 8  # frames
_START_SPEED_SIGMA = 1.0  # m/s


class TargetFilter:
    """Constant velocity with white acceleration; state: position and velocity, shape (6,).

    The acceleration is `target_acceleration` while the target moves evenly, so that commands are calm. Two
    ranges on end that are off to the same side by more than they should mean that it speeds up or brakes: it
    is `manoeuvre_acceleration` for the next frames.

    Each measurement belongs to the stamp of its image, and the filter is asked for the state now: that is how
    delay is accounted for. A range that disagrees with the prediction by more than `range_gate` is not taken
    (an occluder, a wrong match), unless it does so `gate_frames` times on end: then the target starts afresh.
    """

    def __init__(self, parameters):
        self._p = parameters
        self._state = None
        self._refused = 0
        self._surprise = 0
        self._manoeuvre = 0

    @property
    def started(self):
        """Whether the target has been measured at all."""
        return self._state is not None

    def update(self, stamp, camera, ray, distance):
        """Take the measurement of one image.

        Parameters
        ----------
        stamp : float
            Seconds, of the image.
        camera : ndarray, shape (3,)
            The camera's centre at that time, odom frame, metres.
        ray : ndarray, shape (3,)
            Unit vector to the middle of the box, odom frame.
        distance : float
            To the target's near surface, metres; NaN if not measured.

        Returns
        -------
        bool
            Whether the distance was taken.
        """
        if self._state is None:
            return self._start(stamp, camera, ray, distance)
        self._predict(stamp)
        expected = float(np.linalg.norm(self._state[:3] - camera))
        taken = bool(np.isfinite(distance))
        if taken and abs(distance - expected) > self._p.range_gate:
            self._refused += 1
            if self._refused >= self._p.gate_frames:
                return self._start(stamp, camera, ray, distance)
            taken = False
        elif taken:
            self._refused = 0
        along = _UNKNOWN_RANGE_SIGMA
        if taken:
            along = self._watch((distance - expected) / max(1.0, distance)) * max(1.0, distance)
        self._correct(camera + ray * (distance if taken else expected), ray, expected, along)
        return taken

    def at(self, stamp):
        """Return position [m] and velocity [m/s] at a time, both ndarrays of shape (3,)."""
        ahead = stamp - self._stamp
        return self._state[:3] + ahead * self._state[3:], self._state[3:].copy()

    def _watch(self, surprise):
        """Notice a manoeuvre; tell a lone wrong range. `surprise` is measured less expected distance, metres.

        Returns
        -------
        float
            Standard deviation of this range, metres.
        """
        sigma = self._p.range_sigma
        side = int(np.sign(surprise)) if abs(surprise) > sigma else 0
        agrees = side != 0 and side == self._surprise
        self._surprise = side
        if agrees:
            self._manoeuvre = _MANOEUVRE
        return sigma if agrees or abs(surprise) < _LONE * sigma else abs(surprise)

    def _start(self, stamp, camera, ray, distance):
        if not np.isfinite(distance):
            return False
        self._stamp, self._refused = stamp, 0
        self._state = np.concatenate([camera + distance * ray, np.zeros(3)])
        self._covariance = np.diag([0.05**2] * 3 + [_START_SPEED_SIGMA**2] * 3)
        return True

    def _predict(self, stamp):
        step = stamp - self._stamp
        self._stamp = stamp
        transition = np.eye(6)
        transition[:3, 3:] = step * np.eye(3)
        self._manoeuvre = max(0, self._manoeuvre - 1)
        level = self._p.manoeuvre_acceleration if self._manoeuvre else self._p.target_acceleration
        power = np.array([level, level, self._p.target_climb]) ** 2
        noise = np.zeros((6, 6))
        noise[:3, :3] = np.diag(power * step**4 / 4)
        noise[:3, 3:] = noise[3:, :3] = np.diag(power * step**3 / 2)
        noise[3:, 3:] = np.diag(power * step**2)
        self._state = transition @ self._state
        self._covariance = transition @ self._covariance @ transition.T + noise

    def _correct(self, measured, ray, distance, along):
        across = _BEARING_SIGMA * distance
        spread = across**2 * np.eye(3) + (along**2 - across**2) * np.outer(ray, ray)
        gain = np.linalg.solve(self._covariance[:3, :3] + spread, self._covariance[:3, :]).T
        self._state = self._state + gain @ (measured - self._state[:3])
        covariance = self._covariance - gain @ self._covariance[:3, :]
        self._covariance = (covariance + covariance.T) / 2
