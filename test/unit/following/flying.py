"""A drone and a target without ROS or images: what the tests of the predictive follower fly."""

import math

import numpy as np

from tld_follower.box import Box
from tld_follower.following.camera import Camera
from tld_follower.following.follower import Follower
from tld_follower.following.own_motion import level
from tld_follower.following.parameters import Parameters

RATE = 30.0
PARAMETERS = Parameters(image_width=160, image_height=120, max_speed=1.5)
_STEP = 0.01


class World:
    """Upright boxes before a drone that obeys velocities with Spiri's lags; the first one is the target.

    The cloud is exact: rays of the left camera against the boxes and the ground.
    """

    def __init__(self, parameters=PARAMETERS, target=(1.6, 0.0, 0.2), size=(0.8, 0.5, 0.4)):
        self.parameters = parameters
        self.follower = Follower(parameters)
        self.camera = Camera.of(parameters)
        self.time = 100.0
        self.position, self.velocity = np.array([0.0, 0.0, 0.65]), np.zeros(3)
        self.acceleration, self.yaw, self.yaw_rate = np.zeros(3), 0.0, 0.0
        self.target, self.target_velocity = np.array(target, float), np.zeros(3)
        self.size = np.array(size)
        self.obstacles = []  # (middle, size)
        self.command = None
        v, u = np.mgrid[: parameters.image_height, : parameters.image_width]
        focal = self.camera.focal_length
        self._rays = np.dstack(
            [(u + 0.5 - parameters.image_width / 2) / focal, (v + 0.5 - parameters.image_height / 2) / focal,
             np.ones(u.shape)]
        )  # fmt: skip

    @property
    def attitude(self):
        """Body to world, tilted as its acceleration wants."""
        lean = level(self.yaw).T @ self.acceleration / 9.81
        up = np.array([lean[0], lean[1], 1.0])
        up /= np.linalg.norm(up)
        ahead = np.array([1.0, 0.0, 0.0]) - up * up[0]
        ahead /= np.linalg.norm(ahead)
        return level(self.yaw) @ np.column_stack([ahead, np.cross(up, ahead), up])

    def centre(self):
        """Where the camera is."""
        return self.position + self.attitude @ np.array(self.camera.position)

    def distance(self):
        """From the camera to the nearest point of the target."""
        low, high = self.target - self.size / 2, self.target + self.size / 2
        return float(np.linalg.norm(np.clip(self.centre(), low, high) - self.centre()))

    def clearance(self):
        """From the drone's middle to the nearest obstacle."""
        return min(
            (float(np.linalg.norm(np.clip(self.position, m - s / 2, m + s / 2) - self.position))
             for m, s in self.obstacles),
            default=math.inf,
        )  # fmt: skip

    def see(self):
        """Return cloud and box (None if less than a fifth of the target shows)."""
        turn = self.attitude @ self.camera.to_body
        rays = self._rays @ turn.T
        centre = self.centre()
        depth = np.where(rays[..., 2] < -1e-3, -centre[2] / np.minimum(rays[..., 2], -1e-3), np.inf)
        shows = np.zeros(depth.shape, bool)
        whole = 0
        for n, (middle, size) in enumerate([(self.target, self.size), *self.obstacles]):
            hit = _hit(centre, rays, middle - np.asarray(size) / 2, middle + np.asarray(size) / 2)
            nearer = hit < depth
            depth = np.where(nearer, hit, depth)
            shows = nearer if n == 0 else shows & ~nearer
            whole = whole or int(np.isfinite(hit).sum())
        cloud = (self._rays * depth[..., None]).astype(np.float32)
        cloud[~np.isfinite(depth) | (depth > 10) | (depth < 0.25)] = np.nan
        rows, columns = np.nonzero(shows)
        if rows.size < max(12, whole // 5):
            return cloud, None
        return cloud, Box(
            float(columns.min()), float(rows.min()), float(np.ptp(columns) + 1), float(np.ptp(rows) + 1)
        )

    def frame(self, target=1):
        """Show the follower one frame and fly until the next; return its state."""
        cloud, box = self.see()
        state = self.follower.update(box, target, self.time, self.time, cloud, self.time)
        self.fly(state.command)
        return state

    def fly(self, command, seconds=1 / RATE):
        """Obey a command; odometry is exact."""
        p = self.parameters
        for _ in range(max(1, round(seconds / _STEP))):
            step = seconds / max(1, round(seconds / _STEP))
            wanted = level(self.yaw) @ [command.x, command.y, command.z]
            pull = (wanted - self.velocity) / p.velocity_lag
            size = float(np.hypot(*pull[:2]))
            pull[:2] *= min(1.0, p.max_acceleration / max(size, 1e-9))
            self.acceleration = self.acceleration + (pull - self.acceleration) * (step / p.tilt_lag)
            self.velocity = self.velocity + step * self.acceleration
            self.position = self.position + step * self.velocity
            self.yaw_rate += (command.yaw - self.yaw_rate) * step / 0.2
            self.yaw += step * self.yaw_rate
            self.target = self.target + step * self.target_velocity
            self.time += step
            self.tell()

    def tell(self):
        """Publish the odometry of this moment."""
        turn = self.attitude
        self.follower.add_odometry(self.time, self.position, _quaternion(turn), turn.T @ self.velocity)


def _hit(centre, rays, low, high):
    """Distance along each ray to an upright box, inf where it misses."""
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = (low - centre) / rays, (high - centre) / rays
    entry = np.nanmax(np.minimum(near, far), axis=-1)
    leave = np.nanmin(np.maximum(near, far), axis=-1)
    return np.where((entry < leave) & (entry > 0), entry, np.inf)


def _quaternion(turn):
    """x, y, z, w of a rotation matrix whose angle is below 180 degrees."""
    w = math.sqrt(max(1e-12, 1 + np.trace(turn))) / 2
    x, y, z = (turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
    return (x / (4 * w), y / (4 * w), z / (4 * w), w)
