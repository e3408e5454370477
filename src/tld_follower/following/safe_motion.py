"""Checks a wanted velocity against what is known about the space around, and finds a way that is free."""

import itertools
from dataclasses import dataclass

import numpy as np

_STEP = 0.1  # m, between the places of a path that are looked up
_HEADROOM = 1.0  # m, above a ground vehicle's base: higher things are no obstacle to it
_INSIDE = 0.9  # of the free zone's radius
_CHANGED = 0.1  # m/s, a smaller change of the wanted velocity is none
_DETOUR = 0.5  # of the wanted speed: below this a way around is looked for
_DIRECTIONS = np.array([d for d in itertools.product((-1, 0, 1), repeat=3) if any(d)], dtype=float)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1, keepdims=True)
_NOT_DOWN = _DIRECTIONS[_DIRECTIONS[:, 2] >= 0]  # a way around does not lead to the ground


@dataclass(frozen=True)
class Way:
    """A velocity that may be flown, m/s in the odom frame, and why it is not the wanted one ("" if it is).

    `avoiding` tells an obstacle from mere caution.
    """

    velocity: np.ndarray
    reason: str = ""
    avoiding: bool = False


class SafeMotion:
    """Keeps an ellipsoid about the vehicle free of obstacles, and speed low enough to stop in free space.

    About a ground vehicle it is a cylinder that stands on the ground, and the ways are ahead and back.

    The drone stops from v within v t + v^2 / (2 a), with t = `reaction_time` and a = `braking`. Into space
    that was never seen it flies at `unknown_speed` at most, unless something known is coming at it.
    """

    def __init__(self, parameters):
        self._p = parameters
        self._grounded = parameters.vehicle == "ugv"
        keep = parameters.body_radius + parameters.clearance
        upright = 1e-3 if self._grounded else keep / (parameters.body_height + parameters.clearance_below)
        self._keep = keep
        self._scale = np.array([1.0, 1.0, upright])

    def choose(self, wanted, position, heading, local_map, obstacles, threatened):
        """Find the velocity nearest to the wanted one that is safe.

        Parameters
        ----------
        wanted : ndarray, shape (3,)
            m/s, odom frame.
        position : ndarray, shape (3,)
            Of the vehicle's middle, metres, odom frame.
        heading : ndarray, shape (3,)
            Unit vector ahead, odom frame.
        local_map : LocalMap
        obstacles : ndarray, shape (n, 3)
            Places to keep away from, metres, odom frame.
        threatened : bool
            Something known is coming: unknown space is the lesser danger.

        Returns
        -------
        Way
        """
        relative = self._relative(obstacles, position)
        distances = np.linalg.norm(relative, axis=1)
        if distances.size and distances.min() < self._keep:
            return self._leave(relative, distances, position, local_map, heading)
        speed = float(np.linalg.norm(wanted))
        if speed < 1e-6:
            return Way(wanted)
        directions = np.vstack([wanted / speed, [heading] if self._grounded else _NOT_DOWN])
        free = self._free(relative, directions)
        stop = self._stopping_speed(free)
        if not threatened:
            stop = np.minimum(stop, self._known_speed(position, directions, local_map))
        stop = np.minimum(stop, speed)
        if stop[0] > speed - _CHANGED:
            return Way(wanted * (stop[0] / speed))
        hindered = bool(self._stopping_speed(free[:1])[0] < speed - _CHANGED)
        best = 0
        if hindered and stop[0] < _DETOUR * speed:
            progress = stop * (directions @ directions[0])
            best = int(np.argmax(progress))
            if progress[best] < 1.2 * stop[0] + _CHANGED:
                best = 0
        reason = "something is in the way" if hindered else "space ahead was not seen yet"
        return Way(directions[best] * stop[best], reason, hindered)

    def _relative(self, obstacles, position):
        """Obstacles about the vehicle, in the frame in which its free zone is a ball."""
        relative = obstacles - position
        if self._grounded:
            relative = relative[(relative[:, 2] > -self._p.body_height) & (relative[:, 2] < _HEADROOM)]
        return relative * self._scale

    def _leave(self, relative, distances, position, local_map, heading):
        """Move away from what is within the ellipsoid, by the way that is freest and leads away most."""
        inside = distances < self._keep
        depth = self._keep - distances[inside]
        away = -(relative[inside] / np.maximum(distances[inside], 1e-3)[:, None] * depth[:, None]).sum(axis=0)
        length = float(np.linalg.norm(away))
        if length < 1e-6:
            return Way(np.zeros(3), "something is too near", True)
        away /= length
        directions = np.vstack([away * self._scale, _DIRECTIONS])
        if self._grounded:
            directions = np.vstack([heading, -heading])
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        free = self._free(relative[~inside], directions)
        known = self._known_speed(position, directions, local_map) > self._p.unknown_speed
        speed = min(self._p.max_speed, self._p.leave_gain * float(depth.max()) + _CHANGED)
        usable = np.minimum(self._stopping_speed(free), speed)
        score = usable * ((directions * self._scale) @ away) * np.where(known, 1.0, 0.7)
        best = int(np.argmax(score))
        if score[best] <= 0:
            return Way(np.zeros(3), "something is too near", True)
        return Way(directions[best] * usable[best], "something is too near", True)

    def _free(self, relative, directions):
        """How far the drone can go in each direction before an obstacle enters the ellipsoid, metres."""
        scaled = directions * self._scale
        lengths = np.linalg.norm(scaled, axis=1)
        if not relative.size:
            return np.full(len(directions), np.inf)
        along = relative @ (scaled / lengths[:, None]).T
        square = np.einsum("ij,ij->i", relative, relative)[:, None] - along**2
        hit = (along > 0) & (square < self._keep**2)
        reach = along - np.sqrt(np.maximum(self._keep**2 - square, 0.0))
        return np.where(hit, np.maximum(reach, 0.0), np.inf).min(axis=0) / lengths

    def _known_speed(self, position, directions, local_map):
        """Speed in each direction from which the drone stops before it enters unknown space, m/s.

        Only the horizontal part of a direction counts: the camera sees little above the drone, and climbing
        is slow.
        """
        flat = directions * [1.0, 1.0, 0.0]
        share = np.linalg.norm(flat, axis=1)
        flat /= np.maximum(share, 1e-9)[:, None]
        steps = np.arange(_STEP, self._p.body_radius + 2.0, _STEP)
        places = (position + steps[None, :, None] * flat[:, None, :]).reshape(-1, 3)
        # Near the vehicle, the camera sees what is a little lower than a drone, or higher than an axle.
        shift = self._p.camera_z / 2 if self._grounded else -1.5 * self._p.body_height
        known = local_map.known(places) | local_map.known(places + np.array([0.0, 0.0, shift]))
        known = known.reshape(len(directions), -1)
        first = np.where(known.all(axis=1), np.inf, steps[np.argmin(known, axis=1)] - self._p.body_radius)
        speed = np.maximum(self._stopping_speed(np.maximum(first, 0.0)), self._p.unknown_speed)
        return speed / np.maximum(share, 0.1)

    def _stopping_speed(self, free):
        a, t = self._p.braking, self._p.reaction_time
        return a * (np.sqrt(t * t + 2 * np.minimum(free, 1e3) / a) - t)

    def into_zone(self, offset):
        """Return an offset from the vehicle, shortened so far that it lies well inside the free zone."""
        length = float(np.linalg.norm(offset * self._scale))
        return offset * min(1.0, _INSIDE * self._keep / max(length, 1e-6))

    def reaches(self, position, spot, obstacles):
        """Whether the straight way between two places is free of obstacles."""
        way = spot - position
        length = float(np.linalg.norm(way))
        if length < _STEP:
            return True
        relative = self._relative(obstacles, position)
        relative = relative[np.linalg.norm(relative, axis=1) >= self._keep]
        return bool(self._free(relative, (way / length)[None])[0] >= length)
