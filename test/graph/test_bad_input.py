#!/usr/bin/env python3
"""What a real graph does to its nodes: each gets a clear word, nothing crashes, and the drone hovers."""

import sys
import threading
import unittest

import numpy as np
import rosnode
import rospy
from geometry_msgs.msg import Twist
from rosgraph_msgs.msg import Clock, Log
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, RegionOfInterest

from tld_follower.evaluation.graph import wait_for_edges
from tld_follower.msg import BoundingBox, BoundingBoxStamped, FollowState

WIDTH, HEIGHT, FOCAL, BASELINE = 320, 240, 250.0, 0.05
WAIT = 60.0  # s of wall-clock time, a generous bound
NODES = ["/NODE", "/stamp", "/stereo/stereo_image_proc", "/pointsdepthA"]
TARGET = RegionOfInterest(x_offset=110, y_offset=80, width=100, height=80)
SIDES = ("left", "right")


def texture(height, width, seed=0):
    """Return speckle at several scales, as uint8."""
    rng = np.random.default_rng(seed)
    image = np.zeros((height, width))
    for scale in (1, 3, 9):
        coarse = rng.normal(size=(height // scale + 2, width // scale + 2))
        image += np.kron(coarse, np.ones((scale, scale)))[:height, :width]
    return np.uint8(np.clip(128 + 30 * image, 0, 255))


class Camera:
    """A stereo pair before a wall; pictures, camera_info and clock on command."""

    def __init__(self, distance):
        wall = texture(HEIGHT, WIDTH + 64)
        shift = round(FOCAL * BASELINE / distance)
        self.left, self.right = wall[:, :WIDTH], wall[:, shift : WIDTH + shift]
        self.time = 10.0
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10)
        self._images = [rospy.Publisher(f"/stereo/{side}/image_raw", Image, queue_size=10) for side in SIDES]
        self._infos = [
            rospy.Publisher(f"/stereo/{side}/camera_info", CameraInfo, queue_size=10) for side in SIDES
        ]

    def info(self, side, width=WIDTH, height=HEIGHT):
        message = CameraInfo(width=width, height=height, distortion_model="plumb_bob", D=[0.0] * 5)
        tx = -FOCAL * BASELINE if side == "right" else 0.0
        message.K = [FOCAL, 0, WIDTH / 2, 0, FOCAL, HEIGHT / 2, 0, 0, 1]
        message.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        message.P = [FOCAL, 0, WIDTH / 2, tx, 0, FOCAL, HEIGHT / 2, 0, 0, 0, 1, 0]
        return message

    def pass_time(self, dt):
        """Let the clock run on; returns the time."""
        self.time += dt
        now = rospy.Time.from_sec(round(self.time, 3))
        self._clock.publish(now)
        return now

    def shoot(self, pictures=None, infos=None, encoding="mono8", dt=1 / 30):
        """Publish a pair; returns its stamp."""
        stamp = self.pass_time(dt)
        for i, side in enumerate(SIDES):
            picture = (pictures or (self.left, self.right))[i]
            info = infos[i] if infos else self.info(side)
            message = Image(height=picture.shape[0], width=picture.shape[1], encoding=encoding)
            message.step, message.data = picture[:1].nbytes, picture.tobytes()
            for part in (message, info):
                part.header.stamp, part.header.frame_id = stamp, "stereo_left_optical_frame"
            self._infos[i].publish(info)
            self._images[i].publish(message)
        return stamp


class BadInputTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("bad_input_test")
        cls.changed = threading.Condition()
        cls.seen = {"box": {}, "state": {}, "log": [], "command": 0, "states": 0, "target": 0}
        cls.camera = Camera(distance=1.25)
        rospy.Subscriber("/pointA", BoundingBox, lambda m: cls.note("box", m.captured, m))
        rospy.Subscriber("/pointsdepthA/state", FollowState, lambda m: cls.note("state", m.header.stamp, m))
        rospy.Subscriber("/pointsdepthA/state", FollowState, lambda m: cls.count("states"))
        rospy.Subscriber("/NODE/target", RegionOfInterest, lambda m: cls.count("target"))
        rospy.Subscriber("/cmd_vel", Twist, lambda m: cls.count("command"))
        rospy.Subscriber("/NODE/view", Image)  # somebody looks, so that pictures are drawn as well
        rospy.Subscriber("/rosout", Log, cls.read)
        cls.init = rospy.Publisher("/NODE/init", RegionOfInterest, queue_size=1)
        cls.stamped = rospy.Publisher("/pointstampA", BoundingBoxStamped, queue_size=1)
        cls.cloud = rospy.Publisher("/stereo/points2", PointCloud2, queue_size=1)
        me = rospy.get_name()
        cameras = {
            (me, f"/stereo/{side}/{topic}", "/stereo/stereo_image_proc")
            for side in SIDES
            for topic in ("image_raw", "camera_info")
        }
        wait_for_edges(
            cameras
            | {
                (me, "/stereo/left/image_raw", "/NODE"),
                (me, "/NODE/init", "/NODE"),
                (me, "/pointstampA", "/pointsdepthA"),
                (me, "/stereo/points2", "/pointsdepthA"),
                ("/stereo/stereo_image_proc", "/stereo/points2", "/pointsdepthA"),
                ("/stamp", "/pointstampA", "/pointsdepthA"),
                ("/NODE", "/pointA", "/stamp"),
                ("/NODE", "/pointA", me),
                ("/NODE", "/NODE/target", me),
                ("/NODE", "/NODE/view", me),
                ("/pointsdepthA", "/pointsdepthA/state", me),
                ("/pointsdepthA", "/cmd_vel", me),
            }
            | {(me, "/clock", node) for node in NODES},
            timeout=WAIT,
        )

    @classmethod
    def note(cls, kind, stamp, message):
        with cls.changed:
            cls.seen[kind][stamp] = message
            cls.changed.notify_all()

    @classmethod
    def count(cls, kind):
        with cls.changed:
            cls.seen[kind] += 1
            cls.changed.notify_all()

    @classmethod
    def read(cls, log):
        with cls.changed:
            cls.seen["log"].append((log.name, log.level, log.msg))
            cls.changed.notify_all()

    def wait(self, condition, what):
        with self.changed:
            self.assertTrue(self.changed.wait_for(condition, WAIT), f"not within {WAIT:.0f} s: {what}")

    def said(self, node, words):
        """Wait until a node has warned, or worse, with these words."""

        def found():
            return any(
                name == node and level >= Log.WARN and words in text for name, level, text in self.seen["log"]
            )

        self.wait(found, f"{node} says '{words}'; heard: {self.seen['log'][-5:]}")

    def state(self, **shot):
        """Shoot a pair; return the follower's state for it."""
        return self.state_of(self.camera.shoot(**shot))

    def state_of(self, stamp):
        """Return the follower's state for a stamp; time passes while it waits for a cloud."""
        with self.changed:
            for _ in range(int(WAIT / 0.5)):
                if self.changed.wait_for(lambda: stamp in self.seen["state"], 0.5):
                    return self.seen["state"][stamp]
                self.camera.pass_time(0.05)
        self.fail(f"no state for {stamp.to_sec():.3f} within {WAIT:.0f} s")

    def setUp(self):
        """Show the target and see that all is well."""
        self.state()
        targets = self.seen["target"]
        self.init.publish(TARGET)
        self.wait(lambda: self.seen["target"] > targets, "the target is learnt")
        self.assert_follows()

    def tearDown(self):
        for node in NODES:
            self.assertTrue(rosnode.rosnode_ping(node, max_count=1, verbose=False), f"{node} is dead")

    def assert_follows(self):
        for _ in range(30):
            state = self.state()
            if state.mode == FollowState.FOLLOWING:
                break
        self.assertEqual(state.mode, FollowState.FOLLOWING, state.reason)
        if (
            rospy.get_param("/pointsdepthA/control") == "thesis"
        ):  # the other believes that it moves, and brakes
            self.assertGreater(state.command.linear.x, 0.2)  # the wall is at 1.25 m

    def assert_hovers(self, state):
        self.assertEqual(state.command, Twist(), state.reason)

    def test_images_that_the_tracker_cannot_use(self):
        small = self.camera.left[:100, :100]
        for shot, words in (
            (
                {"pictures": (small, small), "infos": [self.camera.info(s, 100, 100) for s in SIDES]},
                "chosen in 320x240",
            ),
            ({"encoding": "32FC1"}, "encoding"),
        ):
            self.assert_hovers(self.state(**shot))
            self.said("/NODE", words)
            self.assert_follows()

    def test_empty_image(self):
        empty = np.zeros((0, 0), np.uint8)
        stamp = self.camera.shoot(pictures=(empty, empty))
        self.assert_hovers(self.state_of(stamp))
        self.said("/NODE", "empty image")
        self.assert_follows()

    def test_box_partly_outside_is_cut_to_the_image(self):
        targets = self.seen["target"]
        self.init.publish(RegionOfInterest(x_offset=220, y_offset=140, width=300, height=300))
        self.wait(lambda: self.seen["target"] > targets, "the target is learnt")
        stamp = self.camera.shoot()
        self.wait(lambda: stamp in self.seen["box"], "a box")
        box = self.seen["box"][stamp]
        self.assertTrue(box.visible)
        self.assertLess(box.x + box.width, WIDTH + 15)

    def test_image_of_another_encoding_in_mid_flight_is_fine(self):
        colour = [np.dstack([picture] * 3) for picture in (self.camera.left, self.camera.right)]
        state = self.state(pictures=colour, encoding="rgb8")
        self.assertEqual(state.mode, FollowState.FOLLOWING)

    def test_camera_info_that_does_not_match_the_image(self):
        state = self.state(infos=[self.camera.info(side, 640, 480) for side in SIDES])
        self.said("/stereo/stereo_image_proc", "camera_info")
        # At most what the last cloud gives, while it is fresh; the predictive one believes that it moves.
        most = 0.85 if rospy.get_param("/pointsdepthA/control") == "thesis" else 1.0
        self.assertLessEqual(state.command.linear.x, most)
        for _ in range(12):
            state = self.state(infos=[self.camera.info(side, 640, 480) for side in SIDES])
        self.assert_hovers(state)
        self.assert_follows()

    def test_boxes_that_no_target_can_have(self):
        for region, words in (
            (RegionOfInterest(x_offset=900, y_offset=80, width=100, height=80), "outside"),
            (RegionOfInterest(x_offset=100, y_offset=80, width=3, height=3), "at least"),
        ):
            targets = self.seen["target"]
            self.init.publish(region)
            self.said("/NODE", "target refused")
            self.said("/NODE", words)
            self.assertEqual(self.seen["target"], targets)
            self.assert_follows()  # the old target is kept

    def test_clouds_without_depth(self):
        blank = np.full((HEIGHT, WIDTH), 90, np.uint8)
        for _ in range(12):  # longer than a distance is trusted
            state = self.state(pictures=(self.camera.left, blank))
        self.assertEqual(state.command.linear.x, 0)
        self.assert_follows()

    def test_clouds_that_are_none(self):
        empty = PointCloud2()
        empty.header.stamp = stamp = self.camera.pass_time(1 / 30)
        self.cloud.publish(empty)
        message = BoundingBoxStamped(box=BoundingBox(110, 80, 100, 80, 1.0, True, stamp, 1))
        message.header.stamp = stamp
        self.stamped.publish(message)
        self.assert_hovers(self.state_of(stamp))
        self.said("/pointsdepthA", "cloud ignored")
        self.assert_follows()

    def test_box_that_is_none(self):
        stamp = self.camera.pass_time(1 / 30)
        message = BoundingBoxStamped(box=BoundingBox(np.nan, 0, 10, 10, 1.0, True, stamp, 1))
        message.header.stamp = stamp
        self.stamped.publish(message)
        self.assert_hovers(self.state_of(stamp))
        self.said("/pointsdepthA", "not a box")
        self.assert_follows()

    def test_a_box_from_the_past_and_one_without_a_cloud(self):
        stamp = self.camera.pass_time(0.9)
        self.camera.pass_time(0.6)
        message = BoundingBoxStamped(box=BoundingBox(110, 80, 100, 80, 1.0, True, stamp, 1))
        message.header.stamp = stamp
        self.stamped.publish(message)
        self.assert_hovers(self.state_of(stamp))
        self.assert_follows()

    def test_clock_jumping_back(self):
        self.camera.time -= 5.0
        with self.changed:  # the stamps come again
            self.seen["state"].clear()
            self.seen["box"].clear()
        self.state()
        self.said("/pointsdepthA", "time jumped back")
        self.said("/NODE", "time jumped back")
        self.assert_follows()

    def test_one_command_for_every_box(self):
        states = self.seen["states"]
        for _ in range(30):
            self.state()
        self.wait(lambda: self.seen["states"] - states >= 30, "a state for every frame")
        self.assertEqual(self.seen["states"] - states, 30)
        self.wait(lambda: self.seen["command"] == self.seen["states"], "as many commands as boxes")


if __name__ == "__main__":
    import rostest

    sys.exit(rostest.rosrun("tld_follower", "bad_input", BadInputTest, sys.argv))
