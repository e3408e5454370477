"""The predictive follower: keeps track of target and obstacles in the odom frame, seen or not."""

import math
from collections import deque

import numpy as np

from tld_follower.following.avoidance import Avoidance, Trend
from tld_follower.following.camera import Camera
from tld_follower.following.controller import Command
from tld_follower.following.distance import make_distance
from tld_follower.following.local_map import LocalMap
from tld_follower.following.own_motion import level
from tld_follower.following.predictive import PredictiveController
from tld_follower.following.safe_motion import SafeMotion, Way
from tld_follower.following.search import Search
from tld_follower.following.state import Mode, State
from tld_follower.following.target_filter import TargetFilter

_MAP_INTERVAL = 0.06  # s between clouds that are entered into the map
_RECKONED_MEMORY = 0.5  # s, of obstacles in a frame that drifts
_TRACK = 1.0  # s
_NEAR_FRAMES = 3  # a lone wrong match is not in three images


class PredictivePilot:
    """Follows by prediction, flies only where it is safe, and searches a lost target."""

    def __init__(self, parameters, own_motion):
        self._p = parameters
        self._own = own_motion
        self._camera = Camera.of(parameters)
        self._controller = PredictiveController(parameters)
        self._nearest = Avoidance(parameters).nearest
        self._trend = Trend(parameters.near_ahead)
        self._safe = SafeMotion(parameters)
        self._map = LocalMap(parameters)
        self._mapped = -math.inf
        self._near = 0  # images on end with something near
        self.take_target()

    def take_target(self):
        """Start afresh for another target."""
        self._distance = make_distance(self._p)
        self._filter = TargetFilter(self._p)
        self._ranged = -math.inf  # when the distance was measured last
        self._seen = -math.inf
        self._track = deque()  # of the last second that it was seen: s, m, m/s, m from the camera
        self._search = None
        self._gave_up = False

    def decide(self, scene):
        """Return the `State` for one `Scene`."""
        nearest = self._nearest(scene.cloud)
        obstacles = self._remember(scene)
        if self._p.distance == "stereo" and scene.cloud is None:
            return State(Mode.WAITING, "no fresh point cloud")
        if scene.box is not None:
            mode, reason, distance, velocity, yaw_rate, threatened = self._follow(scene)
        else:
            mode, reason, velocity, yaw_rate = self._recover(scene, obstacles)
            distance, threatened = math.nan, False
        command, way = self._fly(velocity, yaw_rate, scene, nearest, obstacles, threatened)
        if way.avoiding:
            mode = Mode.AVOIDING
        return State(
            mode, way.reason or reason, distance, nearest.distance, command, self._target_velocity(scene)
        )

    def _follow(self, scene):
        p = self._p
        if scene.stamp - self._seen > p.max_age:
            self._filter = TargetFilter(p)
            self._track.clear()
        self._seen, self._search, self._gave_up = scene.stamp, None, False
        box = scene.box
        centre = self._camera.centre(scene.then)
        ray = scene.then.attitude @ self._camera.ray(box.x + box.width / 2, box.y + box.height / 2)
        expected = math.nan
        if self._filter.started:
            expected = float(np.linalg.norm(self._filter.at(scene.stamp)[0] - centre))
        distance = self._distance.measure(box, scene.cloud, expected)
        if self._filter.update(scene.stamp, centre, ray, distance):
            self._ranged = scene.stamp
            self._note(scene.stamp, centre)
        if not self._filter.started or scene.now - self._ranged > p.max_age:
            turn = self._turn_to(ray, scene)
            return Mode.FOLLOWING, "no depth inside the box", distance, np.zeros(3), turn, False
        position, velocity = self._filter.at(scene.now)
        command = self._controller.command(
            position, velocity, scene.present, self._camera, self._own.measured
        )
        wanted = level(scene.present.yaw) @ [command.x, command.y, command.z]
        sight = position - self._camera.centre(scene.present)
        away = float(np.linalg.norm(sight))
        closing = -float((velocity - scene.present.velocity) @ sight) / max(away, 1e-3)
        threatened = away < p.set_distance and away - p.minimum_distance < closing * p.threat_time
        return Mode.FOLLOWING, "the target is in view", distance, wanted, command.yaw, threatened

    def _note(self, stamp, centre):
        """Keep how it was up to a second ago: what is being hidden seems to stop before it is lost."""
        position, velocity = self._filter.at(stamp)
        self._track.append((stamp, position, velocity, position - centre))
        while self._track[0][0] < stamp - _TRACK:
            self._track.popleft()

    def _turn_to(self, ray, scene):
        sight = level(scene.then.yaw).T @ ray
        rate = self._p.yaw_gain * math.atan2(sight[1], sight[0])
        return min(max(rate, -self._p.max_yaw_rate), self._p.max_yaw_rate)

    def _recover(self, scene, obstacles):
        still = (np.zeros(3), 0.0)
        if self._gave_up:
            return Mode.LOST, "the search has ended in vain", *still
        if not self._filter.started or self._p.search_time <= 0:
            return Mode.LOST, "the target is not in view", *still
        if scene.now - self._seen < self._p.lost_hover:
            return Mode.LOST, "the target has just been lost", *still
        if self._search is None:
            self._search = self._begin_search(scene)
        wish = self._search.step(scene.now, scene.present, self._camera, obstacles, self._safe)
        if wish is None:
            self._gave_up = True
            return self._recover(scene, obstacles)
        # Without a cloud nothing is known about the way: it turns and climbs only.
        velocity = wish.velocity if scene.cloud is not None else wish.velocity * [0.0, 0.0, 1.0]
        return Mode.SEARCHING, wish.phase.value, velocity, wish.yaw_rate

    def _begin_search(self, scene):
        stamp, position, velocity, sight = self._track[0]
        position = position + (self._seen - stamp) * velocity * np.array([1.0, 1.0, 0.0])
        heading = level(scene.present.yaw).T @ (position + velocity - self._camera.centre(scene.present))
        return Search(self._p, self._seen, position, velocity, sight, heading[1])

    def _remember(self, scene):
        """Enter the cloud into the map; return what is to be kept away from, ndarray (n, 3), odom frame."""
        memory = self._p.map_memory if self._own.measured else _RECKONED_MEMORY
        self._map.move(scene.present.position)
        self._map.pass_through(scene.present)
        if scene.cloud is None:
            return self._map.obstacles(scene.now, memory)
        if scene.cloud_stamp - self._mapped > _MAP_INTERVAL or scene.cloud_stamp < self._mapped:
            self._mapped = scene.cloud_stamp
            self._map.add(scene.cloud, self._camera, scene.cloud_then, self._body(scene))
        return self._map.obstacles(scene.now, memory)

    def _body(self, scene):
        """Return the place of the target's near surface, and the radius of what belongs to it."""
        if scene.box is None or not self._filter.started:
            return None
        surface = self._filter.at(scene.cloud_stamp)[0]
        sight = surface - self._camera.centre(scene.cloud_then)
        distance = float(np.linalg.norm(sight))
        radius = self._p.target_radius * math.hypot(scene.box.width, scene.box.height) / 2
        radius *= distance / self._camera.focal_length
        return surface, radius

    def _fly(self, velocity, yaw_rate, scene, nearest, obstacles, threatened):
        """Make a wanted velocity (odom frame) safe; return the command and the `Way` that was chosen."""
        present = scene.present
        way = Way(velocity)
        if scene.cloud is not None:
            soon = self._trend.ahead(scene.cloud_stamp, nearest.distance)
            near = soon < self._p.minimum_distance + self._p.near_margin
            self._near = self._near + 1 if near else 0
            if self._near >= _NEAR_FRAMES:
                obstacles = np.vstack([obstacles, self._place(nearest, soon, scene)])
            heading = level(present.yaw)[:, 0]
            way = self._safe.choose(velocity, present.position, heading, self._map, obstacles, threatened)
        x, y, z = level(present.yaw).T @ way.velocity
        return Command(float(x), float(y), float(z), float(yaw_rate)), way

    def _place(self, nearest, soon, scene):
        """Return the place of the nearest thing, odom frame; inside the free zone if it must be left."""
        then = scene.cloud_then
        place = self._camera.centre(then) + then.attitude @ (self._camera.to_body @ nearest.point)
        if soon >= self._p.minimum_distance:
            return place
        return scene.present.position + self._safe.into_zone(place - scene.present.position)

    def _target_velocity(self, scene):
        if not self._filter.started or scene.now - self._seen > self._p.max_age:
            return (math.nan,) * 3
        return tuple(map(float, level(scene.present.yaw).T @ self._filter.at(scene.now)[1]))
