#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The ROS side of the simulator: services, clock, messages, lockstep, bad input."""

import hashlib
import subprocess
import time
import unittest

import numpy as np
import rospy
import rostest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock, Log
from sensor_msgs.msg import BatteryState, CameraInfo, Image, Imu, JointState, Range
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from tld_follower.msg import Truth
from tld_follower.srv import Step

TOPICS = {
    "/clock": Clock,
    "/stereo/left/image_raw": Image,
    "/stereo/right/image_raw": Image,
    "/stereo/left/camera_info": CameraInfo,
    "/stereo/right/camera_info": CameraInfo,
    "/husky/joint_states": JointState,
    "/husky/odom": Odometry,
    "/husky/ground_truth/state": Odometry,
    "/raw_imu": Imu,
    "/range": Range,
    "/spiri/odometry": Odometry,
    "/ground_truth/state": Odometry,
    "/tf": TFMessage,
    "/tf_static": TFMessage,
    "/gazebo/truth": Truth,
    "/spiri/battery_state": BatteryState,
    "/diagnostics": DiagnosticArray,
}
DEADLINE = 20.0  # Wall-clock seconds; only a fault reaches it.


def wait_for(condition, what):
    """Poll until the condition holds."""
    end = time.monotonic() + DEADLINE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"never happened: {what}")
        time.sleep(0.002)


class SimulatorNodeTest(unittest.TestCase):
    """Each test starts from a simulation that was reset to time zero and is paused."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_simulator_node", disable_rostime=True)
        cls.got = {topic: [] for topic in TOPICS}
        cls.answer = None
        cls.cmd_vel = rospy.Publisher("/cmd_vel", Twist, queue_size=10, tcp_nodelay=True)
        cls.husky_cmd_vel = rospy.Publisher("/husky/cmd_vel", Twist, queue_size=10)
        cls.subscribers = [
            rospy.Subscriber(topic, kind, cls.receive, topic, queue_size=1000, tcp_nodelay=True)
            for topic, kind in TOPICS.items()
        ]
        services = {"pause_physics": Empty, "unpause_physics": Empty, "reset_world": Empty}
        services |= {"reset_simulation": Empty, "step": Step}
        cls.call = {}
        for name, kind in services.items():
            rospy.wait_for_service(f"/gazebo/{name}", DEADLINE)
            cls.call[name] = rospy.ServiceProxy(f"/gazebo/{name}", kind)
        wait_for(lambda: all(s.get_num_connections() for s in cls.subscribers), "all topics connected")
        wait_for(lambda: cls.cmd_vel.get_num_connections(), "/cmd_vel connected")

    @classmethod
    def receive(cls, message, topic):
        """Keep every message, and answer left images with a command."""
        cls.got[topic].append(message)
        if topic == "/stereo/left/image_raw" and cls.answer is not None:
            cls.cmd_vel.publish(cls.answer(message))

    def setUp(self):
        type(self).answer = lambda image: Twist()
        self.call["pause_physics"]()
        self.call["reset_simulation"]()
        wait_for(lambda: self.got["/clock"] and self.got["/clock"][-1].clock.to_nsec() == 0, "clock at zero")
        time.sleep(0.2)  # What was on its way before the reset.
        for messages in self.got.values():
            messages.clear()

    def step(self, frames):
        """Advance, and wait until the last frame has arrived here."""
        response = self.call["step"](frames)
        self.assertTrue(response.success, response.message)

        frame_topics = [topic for topic in TOPICS if topic.startswith("/stereo/")] + [
            "/range",
            "/gazebo/truth",
        ]

        def arrived():
            stamps = [self.got[topic][-1].header.stamp for topic in frame_topics if self.got[topic]]
            stamps += [message.clock for message in self.got["/clock"][-1:]]
            return stamps == [response.stamp] * (len(frame_topics) + 1)

        wait_for(arrived, "the last frame")
        return response

    def test_steps_while_paused_and_stamps_pairs_alike(self):
        self.step(7)
        left = [m.header.stamp.to_nsec() for m in self.got["/stereo/left/image_raw"]]
        right = [m.header.stamp.to_nsec() for m in self.got["/stereo/right/image_raw"]]
        infos = [m.header.stamp.to_nsec() for m in self.got["/stereo/left/camera_info"]]
        self.assertEqual(len(left), 7)
        self.assertEqual(left, right)
        self.assertEqual(left, infos)
        nearest = [2_000_000 * round(500 * k / 30) for k in range(1, 8)]
        self.assertEqual(left, nearest)
        clock = [m.clock.to_nsec() for m in self.got["/clock"]]
        self.assertEqual(clock, sorted(set(range(10_000_000, left[-1], 10_000_000)) | set(left)))
        time.sleep(0.3)
        self.assertEqual(len(self.got["/stereo/left/image_raw"]), 7, "it did not stay paused")

    def test_publishes_what_a_robot_would(self):
        self.step(60)
        wait_for(lambda: len(self.got["/raw_imu"]) >= 199, "IMU at 100 Hz")
        wait_for(lambda: len(self.got["/husky/joint_states"]) >= 99, "joint states at 50 Hz")
        self.assertEqual(len(self.got["/range"]), 60)
        self.assertCountEqual(
            self.got["/husky/joint_states"][-1].name,
            ["front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel"],
        )
        left, right = self.got["/stereo/left/camera_info"][-1], self.got["/stereo/right/camera_info"][-1]
        focal = 160 / np.tan(np.radians(65) / 2)
        np.testing.assert_allclose(left.P, [focal, 0, 159.5, 0, 0, focal, 119.5, 0, 0, 0, 1, 0], atol=1e-4)
        self.assertAlmostEqual(right.P[3], -focal * 0.049, places=4)
        self.assertEqual({left.header.frame_id, right.header.frame_id}, {"stereo_left_optical_frame"})
        image = self.got["/stereo/left/image_raw"][-1]
        self.assertEqual((image.width, image.height, image.encoding, image.step), (320, 240, "rgb8", 960))
        frames = {(t.header.frame_id, t.child_frame_id) for m in self.got["/tf"] for t in m.transforms}
        self.assertEqual(frames, {("odom", "base_link"), ("husky_odom", "husky_base_link")})
        truth = self.got["/gazebo/truth"][-1]
        self.assertTrue(truth.target_box.visible)
        self.assertEqual(truth.target_box.captured, image.header.stamp)
        self.assertAlmostEqual(truth.drone_pose.position.z, self.got["/range"][-1].range, delta=0.06)
        state = self.got["/spiri/odometry"][-1].pose.pose.position
        self.assertAlmostEqual(state.z + 0.04, truth.drone_pose.position.z, delta=0.03)

    def test_tells_of_its_battery_and_its_pace_every_second(self):
        self.step(95)
        wait_for(lambda: len(self.got["/spiri/battery_state"]) >= 3, "the battery's state")
        wait_for(lambda: len(self.got["/diagnostics"]) >= 3, "diagnostics")
        battery = self.got["/spiri/battery_state"][2]
        self.assertEqual(battery.header.stamp.to_nsec(), 3_000_000_000)
        self.assertAlmostEqual(battery.percentage, 1.0, delta=0.01)
        self.assertAlmostEqual(battery.charge, 1.3 * battery.percentage, delta=1e-3)
        self.assertLess(battery.current, -1.0)
        self.assertLess(battery.voltage, 12.6)
        status = {status.name: status for status in self.got["/diagnostics"][2].status}
        self.assertEqual(set(status), {"gazebo: pace", "gazebo: battery"})
        pace = {value.key: value.value for value in status["gazebo: pace"].values}
        self.assertEqual(pace["frames"], "90")
        self.assertEqual(pace["skipped frames"], "0")
        self.assertGreater(float(pace["real-time factor"]), 0)

    def test_depth_and_labels_come_only_while_subscribed(self):
        self.step(3)
        got = {}
        subscribers = [
            rospy.Subscriber(f"/gazebo/{kind}", Image, lambda m, kind=kind: got.update({kind: m}))
            for kind in ("depth", "labels")
        ]
        wait_for(lambda: all(s.get_num_connections() for s in subscribers), "connected")
        response = self.step(120)
        wait_for(
            lambda: len(got) == 2 and all(m.header.stamp == response.stamp for m in got.values()), "both"
        )
        for subscriber in subscribers:
            subscriber.unregister()
        self.assertEqual((got["depth"].encoding, got["labels"].encoding), ("32FC1", "mono8"))
        depth = np.frombuffer(got["depth"].data, np.float32).reshape(240, 320)
        labels = np.frombuffer(got["labels"].data, np.uint8).reshape(240, 320)
        truth = self.got["/gazebo/truth"][-1]
        self.assertEqual(np.count_nonzero(labels == 1), truth.target_pixels)
        # The nearest point of the target is on the way down: less deep than far.
        self.assertLess(depth[labels == 1].min(), truth.distance)
        self.assertGreater(depth[labels == 1].min(), 0.8 * truth.distance)
        self.assertTrue(np.isinf(depth[labels == 0]).all())
        self.assertTrue(np.isfinite(depth[labels != 0]).all())

    def test_wind_blows_and_is_refused_if_not_finite(self):
        self.step(150)
        wind = rospy.Publisher("/wind", Vector3, queue_size=10, latch=True)
        wind.publish(Vector3(0, 2, 0))
        wait_for(lambda: wind.get_num_connections(), "/wind connected")
        time.sleep(0.2)
        wind.publish(Vector3(0, float("nan"), 0))  # Leaves it as it was.
        self.step(60)
        self.assertGreater(self.got["/gazebo/truth"][-1].drone_pose.position.y, 0.1)
        wind.unregister()

    def test_step_is_refused_while_running(self):
        self.call["unpause_physics"]()
        response = self.call["step"](1)
        self.assertFalse(response.success)
        self.assertIn("pause_physics", response.message)
        wait_for(lambda: len(self.got["/stereo/left/image_raw"]) > 5, "running after unpause")

    def test_clock_goes_on_after_reset_world(self):
        self.step(10)
        before = self.got["/clock"][-1].clock
        self.call["reset_world"]()
        self.step(1)
        stamps = [m.clock.to_nsec() for m in self.got["/clock"]]
        self.assertEqual(stamps, sorted(stamps))
        self.assertEqual(self.got["/clock"][-1].clock.to_nsec(), before.to_nsec() + 34_000_000)
        self.assertLess(self.got["/gazebo/truth"][-1].drone_pose.position.z, 0.06, "the drone is back")

    def closed_loop_run(self, frames=150):
        """Fly by the brightness of the image for some seconds; return a digest of all that was seen."""

        def steer(image):
            row = np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3).mean(axis=(0, 2))
            twist = Twist()
            twist.linear.x = float(row.mean() / 400)
            twist.angular.z = float(row[:160].mean() - row[160:].mean()) / 40
            return twist

        type(self).answer = lambda image: steer(image)
        self.step(frames)
        digest = hashlib.sha256()
        for topic in ("/stereo/left/image_raw", "/stereo/right/image_raw"):
            self.assertEqual(len(self.got[topic]), frames)
            for message in self.got[topic]:
                digest.update(message.data)
        return digest.hexdigest(), self.got["/gazebo/truth"][-1].drone_pose

    def test_lockstep_runs_are_bit_identical(self):
        first, pose = self.closed_loop_run()
        self.assertGreater(pose.position.x, -1.4, "it flew")
        self.setUp()
        second, _ = self.closed_loop_run()
        self.assertEqual(first, second)

    def test_lockstep_goes_on_when_no_command_comes(self):
        type(self).answer = None
        log = []
        listener = rospy.Subscriber("/rosout", Log, log.append)
        wait_for(lambda: listener.get_num_connections() >= 2, "log connected")
        start = time.monotonic()
        self.step(3)
        self.assertGreater(time.monotonic() - start, 1.9, "it did not wait for commands")
        wait_for(lambda: any("lockstep" in m.msg for m in log), "the warning")
        warning = next(m.msg for m in log if "lockstep" in m.msg)
        self.assertIn("no /cmd_vel answered", warning)
        self.assertIn("who publishes it is silent", warning)
        listener.unregister()

    def test_commands_that_are_not_finite_make_it_hover(self):
        self.step(150)
        twist = Twist()
        twist.linear.x = float("nan")
        type(self).answer = lambda image: twist
        self.husky_cmd_vel.publish(twist)
        self.step(60)
        truth = self.got["/gazebo/truth"][-1]
        self.assertAlmostEqual(truth.drone_pose.position.x, -1.5, delta=0.02)
        self.assertAlmostEqual(truth.drone_pose.position.z, 0.65, delta=0.02)
        self.assertAlmostEqual(truth.distance, 1.0, delta=0.02)

    def test_bad_commands_in_between_are_one_warning(self):
        bad = Twist()
        bad.linear.x = float("nan")
        huge = Twist()
        huge.linear.z = -1e300  # Absurd, but a number.
        log = []
        listener = rospy.Subscriber("/rosout", Log, log.append)
        wait_for(lambda: listener.get_num_connections() >= 2, "log connected")
        time.sleep(5.1)  # Earlier warnings do not count any more.
        type(self).answer = lambda image: bad if image.header.stamp.nsecs % 4_000_000 else huge
        self.step(60)
        wait_for(lambda: any("cmd_vel" in m.msg for m in log), "the warning")
        self.assertEqual([m.msg for m in log if "cmd_vel" in m.msg], ["/cmd_vel is not finite; hovering"])
        listener.unregister()

    def test_bad_parameters_are_one_message_and_a_failure(self):
        for name, value in {
            "world": "/no/such.world",
            "camera_position": "[.nan, 0, 0]",
            "spiri/max_tilt": "1.6",
            "vehicle_pose": "[20000.0, 0.0, 0.0]",
            "target_pose": "[0.0, .inf, 0.0]",
            "seed": "-1",
            "width": "640.5",
        }.items():
            with self.subTest(name):
                rospy.set_param("/other", {"world": "/no/such.world"})
                rospy.set_param(f"/other/{name}", yaml.safe_load(value))
                command = ["rosrun", "tld_follower", "bullet_sim", "__name:=other"]
                run = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE, check=False)
                self.assertEqual(run.returncode, 1)
                lines = [line for line in (run.stdout + run.stderr).splitlines() if "[" in line]
                self.assertEqual(len(lines), 1, lines)
                self.assertIn("/no/such.world" if name == "world" else f"~{name}", lines[0])
        rospy.delete_param("/other")


if __name__ == "__main__":
    rostest.rosrun("tld_follower", "simulator_node", SimulatorNodeTest)
