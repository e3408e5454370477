#!/usr/bin/env python3
"""What the right camera gains while the target leaves the left image at its right side and comes back."""

import json
import math
import sys
import threading
import unittest

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import RegionOfInterest
from std_srvs.srv import Empty

from tld_follower.box import Box
from tld_follower.evaluation.graph import wait_for_edges
from tld_follower.msg import BoundingBox, Truth
from tld_follower.nodes.conversions import message_box

WAIT = 60.0  # s of wall-clock time, a generous bound
RATE = 30.0  # frames a second
BOXED = 4.0  # s, when the target is shown to both trackers
WIDTH, HEIGHT, FOCAL = 640, 480, 320 / math.tan(1.1344640138 / 2)
PITCH, CAMERA = 0.34, np.array([0.080, 0.005, -0.0165])  # config/simulator.yaml
# Husky's corners in its own frame [m].
CORNERS = np.array([(x, y, z) for x in (-0.49, 0.49) for y in (-0.33, 0.33) for z in (-0.13, 0.25)])
NODES = {"both": ("/NODE", "/pointA"), "one": ("/one_camera", "/one_camera/pointA")}


def rotation(q):
    """Matrix (3, 3) of a geometry_msgs/Quaternion."""
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def place(point):
    return np.array([point.x, point.y, point.z])


def projected(truth, side):
    """The target's box in the plane of a camera's image, which may lie outside the image.

    `side` is the camera's place on the drone's y axis from the middle of the pair [m].
    """
    target, drone = truth.target_pose, truth.drone_pose
    world = CORNERS @ rotation(target.orientation).T + place(target.position)
    body = (world - place(drone.position)) @ rotation(drone.orientation) - CAMERA
    cos, sin = math.cos(PITCH), math.sin(PITCH)
    x, z = cos * body[:, 0] - sin * body[:, 2], sin * body[:, 0] + cos * body[:, 2]
    u, v = WIDTH / 2 - FOCAL * (body[:, 1] - side) / x, HEIGHT / 2 - FOCAL * z / x
    return Box(u.min(), v.min(), np.ptp(u), np.ptp(v))


class WiderViewTest(unittest.TestCase):
    def setUp(self):
        rospy.init_node("wider_view_test")
        self.changed, self.frames, self.targets = threading.Condition(), {}, {}
        self.baseline, self.seed = rospy.get_param("~baseline"), rospy.get_param("~seed")
        self.drive = rospy.Publisher("/husky/cmd_vel", Twist, queue_size=1)
        self.hover = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
        self.init = {
            name: rospy.Publisher(f"{node}/init", RegionOfInterest, queue_size=1)
            for name, (node, _) in NODES.items()
        }
        rospy.Subscriber("/gazebo/truth", Truth, lambda m: self.note(m.header.stamp, "truth", m))
        me = rospy.get_name()
        edges = {("/gazebo", "/gazebo/truth", me)}
        edges |= {(me, topic, "/gazebo") for topic in ("/husky/cmd_vel", "/cmd_vel")}
        edges |= {("/gazebo", "/stereo/right/image_raw", "/NODE")}
        for name, (node, topic) in NODES.items():
            rospy.Subscriber(topic, BoundingBox, lambda m, name=name: self.note(m.captured, name, m))
            rospy.Subscriber(f"{node}/target", RegionOfInterest, self.learnt, name)
            edges |= {(node, topic, me), (node, f"{node}/target", me), (me, f"{node}/init", node)}
            edges |= {("/gazebo", "/stereo/left/image_raw", node)}
        wait_for_edges(edges, timeout=WAIT)

    def note(self, stamp, kind, message):
        with self.changed:
            self.frames.setdefault(stamp, {})[kind] = message
            self.changed.notify_all()

    def learnt(self, _, name):
        with self.changed:
            self.targets[name] = True
            self.changed.notify_all()

    def play(self, end, script):
        """Yield time and messages of each frame; Husky drives at `script(t)` m/s, the drone hovers."""
        rospy.wait_for_service("/gazebo/unpause_physics", WAIT)
        rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
        done = rospy.Time()

        def whole():
            return [s for s in sorted(self.frames) if s > done and len(self.frames[s]) == 1 + len(NODES)]

        while done.to_sec() < end:
            with self.changed:
                self.assertTrue(self.changed.wait_for(whole, WAIT), f"no frame after {done.to_sec():.3f} s")
                done = whole()[0]
                frame = self.frames.pop(done)
            yield done.to_sec(), frame
            command = Twist()
            command.linear.x = script(done.to_sec())
            self.drive.publish(command)
            self.hover.publish(Twist())

    def show(self, box):
        x, y, width, height = map(round, box.as_tuple())
        for publisher in self.init.values():
            publisher.publish(RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height))
        with self.changed:
            learnt = self.changed.wait_for(lambda: len(self.targets) == len(NODES), WAIT)
        self.assertTrue(learnt, "the target was not learnt")

    def test_the_right_camera_keeps_the_target_longer(self):
        random = np.random.default_rng(self.seed)
        speed, rest = random.uniform(0.3, 0.8), random.uniform(0.5, 2.0)
        # Out until the whole target has left the left image, and somewhat more.
        distance = rospy.get_param("/gazebo/target_pose")[0] - CAMERA[0]
        drive_s = (distance * 0.66 + 0.75 + random.uniform(0.0, 0.3)) / speed
        start = BOXED + 1.0
        turn = start + drive_s + rest

        def script(t):
            return speed * ((start <= t < start + drive_s) - 1.0 * (turn <= t < turn + drive_s))

        records = []
        for t, frame in self.play(turn + drive_s + 0.5, script):
            truth = frame["truth"]
            if t < BOXED:
                continue
            if not self.targets:
                self.show(message_box(truth.target_box))
                continue
            expected = projected(truth, self.baseline / 2)
            right = projected(truth, -self.baseline / 2).clip(WIDTH, HEIGHT)
            record = {"t": t, "left": truth.target_box.visible, "right": bool(right.width > 1.0)}
            if truth.target_box.visible:
                record["fit"] = message_box(truth.target_box).overlap(expected.clip(WIDTH, HEIGHT))
            for name in NODES:
                box = message_box(frame[name])
                record[name] = None if box is None else float(box.overlap(expected))
            records.append(record)
        figures = self.figures(records)
        figures["baseline"], figures["seed"] = self.baseline, self.seed
        figures["distance_m"], figures["speed"] = distance - 0.33, speed
        rospy.loginfo(json.dumps(figures))
        if rospy.get_param("~json", ""):
            with open(rospy.get_param("~json"), "w") as file:
                json.dump({**figures, "records": records}, file)
        both, one = figures["both"], figures["one"]
        self.assertGreater(both["kept_s"], one["kept_s"])
        self.assertGreaterEqual(both["boxed"], one["boxed"])
        self.assertLessEqual(both["wrong"], 0.02 * len(records))
        self.assertIsNotNone(both["found_s"])

    def figures(self, records):
        """Count frames; times are from the first frame without the target on the left, and its return."""
        gone = [i for i, record in enumerate(records) if not record["left"]]
        self.assertTrue(gone, "the target did not leave the left image")
        leaves, returns = records[gone[0]]["t"], records[gone[-1]]["t"] + 1.0 / RATE
        result = {
            "frames": len(records),
            "visible": sum(record["left"] or record["right"] for record in records),
            "visible_left": sum(record["left"] for record in records),
            "fit": float(np.mean([record["fit"] for record in records if record["left"]])),
        }
        middle = 0.5 * (leaves + returns)
        for name in NODES:
            right = [r["t"] for r in records if r[name] is not None and r[name] > 0.25]
            before, after = [t for t in right if t < middle], [t for t in right if t > middle]
            result[name] = {
                "boxed": len(right),
                "wrong": sum(r[name] is not None and r[name] <= 0.25 for r in records),
                "kept_s": round(max(before) - leaves, 3) if before else None,
                "found_s": round(min(after) - returns, 3) if after else None,
            }
        return result


if __name__ == "__main__":
    import rostest

    sys.exit(rostest.rosrun("tld_follower", "wider_view", WiderViewTest, sys.argv))
