"""What is known about the space around the vehicle, also about what has left the view."""

import math

import numpy as np
from numba import njit

CELL = 0.1  # m
_CELLS = np.array([80, 80, 28])  # 4 m about the drone, 1.4 m above and below
_ACROSS = 160  # points of a row that are entered
_NEVER = -1e9
_SIGHTINGS = 2
_BEFORE = 0.15  # m, nearer than the target's near surface by this: not the target
# Things have moved if columns of so many cells were left that were seen so lately [s]; then what was seen
# in so long [s] is forgotten within so many cells of them.
_UPRIGHT, _LATELY, _PASSED, _ABOUT = 3, 1.0, 3.0, 8


class LocalMap:
    """A grid of cells about the drone in the odom frame, moved along by whole cells.

    A cell is an obstacle where enough points of a cloud fall into it, in two clouds at least since the camera
    last looked through it to something farther off: wrong matches are seldom in one place twice. It is
    remembered for `map_memory` seconds; but where things are seen to have moved away, what was seen beside
    them just before is forgotten out of view, too: it has moved with them. A cell is known once the camera
    has looked there and saw nothing nearer: also where no depth is measured, as in the sky.
    """

    def __init__(self, parameters):
        self._p = parameters
        self._origin = None
        self._occupied = np.full(_CELLS, _NEVER, np.float32)
        self._sightings = np.zeros(_CELLS, np.int8)
        self._known = np.zeros(_CELLS, np.bool_)
        self._start = 0.0

    def move(self, position):
        """Keep the grid about a place: ndarray (3,), metres, odom frame."""
        origin = np.floor(position / CELL).astype(np.int64) - _CELLS // 2
        if self._origin is None:
            self._origin = origin
            return
        shift = origin - self._origin
        if not shift.any():
            return
        for grid, nothing in ((self._occupied, _NEVER), (self._sightings, 0), (self._known, False)):
            grid[:] = np.roll(grid, tuple(-shift), axis=(0, 1, 2))
            for axis, cells in enumerate(shift):
                at = [slice(None)] * 3
                at[axis] = slice(-cells, None) if cells > 0 else slice(0, -cells)
                if cells:
                    grid[tuple(at)] = nothing
        self._origin = origin

    def add(self, cloud, camera, motion, target=None):
        """Enter a cloud.

        Parameters
        ----------
        cloud : ndarray, shape (height, width, 3)
            Points in metres in the camera's optical frame; NaN where there is no depth.
        camera : Camera
        motion : Motion
            The drone's own, at the cloud's time.
        target : tuple of ndarray (3,) and float, or None
            The middle of the target's near surface in the odom frame, and its radius, metres: what is within
            it and not before that surface is not entered.
        """
        if not self._start:
            self._start = motion.stamp
        now = np.float32(motion.stamp - self._start)
        turn = motion.attitude @ camera.to_body
        centre = camera.centre(motion)
        corner = self._origin * CELL
        middle, radius = target or (corner, 0.0)
        to_optical = np.ascontiguousarray(turn.T)
        sight = to_optical @ (corner - centre)
        earlier = self._sightings.copy()
        _clear(self._sightings, self._known, cloud, sight, to_optical, camera.focal_length, self._p.map_range)
        reach = (camera.focal_length, self._p.map_range, now)
        place = to_optical @ (middle - centre)
        before = float(np.linalg.norm(place)) - _BEFORE
        _enter(self._occupied, self._sightings, cloud, turn, centre - corner, reach, place, (radius, before))
        self._forget_moved(earlier, now)

    def _forget_moved(self, earlier, now):
        """Forget what was lately seen about places that upright things have just left."""
        left = (earlier >= _SIGHTINGS) & (self._sightings == 0) & (self._occupied > now - _LATELY)
        columns = np.argwhere(left.sum(axis=2) >= _UPRIGHT)
        if len(columns) < 2:
            return
        low, high = np.maximum(columns.min(axis=0) - _ABOUT, 0), columns.max(axis=0) + _ABOUT + 1
        about = (slice(low[0], high[0]), slice(low[1], high[1]))
        seen = self._occupied[about]
        self._sightings[about][(seen > now - _PASSED) & (seen < now)] = 0

    def pass_through(self, motion):
        """Note that nothing else is where the vehicle itself is."""
        index = np.floor(motion.position / CELL).astype(np.int64) - self._origin
        reach = int(self._p.body_radius / CELL)
        low, high = np.maximum(index - reach, 0), index + reach + 1
        at = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        self._sightings[at] = 0
        self._known[at] = True

    def obstacles(self, now, longest):
        """Return the middles of the cells that are obstacles, (n, 3) metres, odom frame; `longest` in s."""
        if self._origin is None:
            return np.empty((0, 3))
        age = now - self._start - self._occupied
        found = np.argwhere((self._sightings >= _SIGHTINGS) & (age < longest))
        return (found + self._origin + 0.5) * CELL

    def known(self, points):
        """Return whether the camera ever looked at places: bool (n,), for (n, 3) metres, odom frame."""
        if self._origin is None:
            return np.zeros(len(points), bool)
        index = np.floor(points / CELL).astype(np.int64) - self._origin
        inside = ((index >= 0) & (index < _CELLS)).all(axis=1)
        i, j, k = np.where(inside[:, None], index, 0).T
        return inside & self._known[i, j, k]


@njit(cache=True)
def _clear(sightings, known, cloud, corner, to_optical, focal, far):
    """Mark cells that the camera looks through: nothing in their picture is as near as they are."""
    height, width = cloud.shape[:2]
    u0, v0 = width / 2, height / 2
    for i in range(known.shape[0]):
        for j in range(known.shape[1]):
            for k in range(known.shape[2]):
                a, b, c = (i + 0.5) * CELL, (j + 0.5) * CELL, (k + 0.5) * CELL
                z = corner[2] + to_optical[2, 0] * a + to_optical[2, 1] * b + to_optical[2, 2] * c
                if z < 0.15 or z > far:
                    continue
                x = corner[0] + to_optical[0, 0] * a + to_optical[0, 1] * b + to_optical[0, 2] * c
                y = corner[1] + to_optical[1, 0] * a + to_optical[1, 1] * b + to_optical[1, 2] * c
                u, v, half = u0 + focal * x / z, v0 + focal * y / z, 0.4 * CELL * focal / z
                if u - half < 0 or v - half < 0 or u + half > width - 1 or v + half > height - 1:
                    continue
                seen = 0
                for s in range(5):
                    du = 0.0 if s == 0 else (half if s % 2 else -half)
                    dv = 0.0 if s == 0 else (half if s > 2 else -half)
                    depth = cloud[int(v + dv), int(u + du), 2]
                    if math.isfinite(depth):
                        if depth < z + CELL:
                            seen = -9
                            break
                        seen += 1
                if seen >= 0:
                    known[i, j, k] = True
                if seen >= 3:
                    sightings[i, j, k] = 0


@njit(cache=True)
def _enter(occupied, sightings, cloud, turn, centre, reach, target, extent):
    """Mark cells that hold a quarter of the points that a filled one would, and three at least."""
    focal, far, now = reach
    radius, before = extent
    counts = np.zeros(occupied.shape, np.int32)
    depths = np.zeros(occupied.shape, np.float32)
    stride = max(1, cloud.shape[1] // _ACROSS)
    for v in range(0, cloud.shape[0], stride):
        for u in range(0, cloud.shape[1], stride):
            x, y, z = cloud[v, u, 0], cloud[v, u, 1], cloud[v, u, 2]
            if not (math.isfinite(x) and math.isfinite(y) and 0 < z < far):
                continue
            off = (x - target[0]) ** 2 + (y - target[1]) ** 2 + (z - target[2]) ** 2
            if off < radius * radius and x * x + y * y + z * z > before * before:
                continue
            i = math.floor((centre[0] + turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z) / CELL)
            j = math.floor((centre[1] + turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z) / CELL)
            k = math.floor((centre[2] + turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z) / CELL)
            if 0 <= i < counts.shape[0] and 0 <= j < counts.shape[1] and 0 <= k < counts.shape[2]:
                counts[i, j, k] += 1
                depths[i, j, k] = z
    for i in range(counts.shape[0]):
        for j in range(counts.shape[1]):
            for k in range(counts.shape[2]):
                if counts[i, j, k] >= 3:
                    edge = CELL * focal / depths[i, j, k] / stride
                    if counts[i, j, k] >= 0.25 * edge * edge:
                        occupied[i, j, k] = now
                        sightings[i, j, k] = min(sightings[i, j, k] + 1, 120)


def warm_up():
    """Compile the kernels before time matters."""
    cloud = np.full((8, 8, 3), np.nan, np.float32)
    grid = np.full((2, 2, 2), _NEVER, np.float32)
    sightings, known = np.zeros(grid.shape, np.int8), np.zeros(grid.shape, np.bool_)
    turn, place = np.eye(3), np.zeros(3)
    _clear(sightings, known, cloud, place, turn, 1.0, 1.0)
    _enter(grid, sightings, cloud, turn, place, (1.0, 1.0, np.float32(0)), place, (0.0, 0.0))
