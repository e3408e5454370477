#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The ROS side of the worlds with another vehicle or target: topics, frames, commands."""

import threading
import unittest

import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from tld_follower.msg import Truth
from tld_follower.srv import Step

TIMEOUT = 20.0  # Wall-clock seconds; only a fault reaches it.


class CastsTest(unittest.TestCase):
    """Both robots drive forward; what is published tells of it."""

    def test_both_are_led_and_tell_where_they_are(self):
        rospy.init_node("test_casts_node", disable_rostime=True)
        with_ugv = rospy.get_param("/gazebo/world").endswith("ugv.world")
        vehicle, target = ("ugv", "husky") if with_ugv else ("spiri", "target")
        got, frames, changed = {}, set(), threading.Condition()
        forward = Twist()
        forward.linear.x = 0.5
        commands = [
            rospy.Publisher(topic, Twist, queue_size=10, tcp_nodelay=True)
            for topic in ("/cmd_vel", f"/{target}/cmd_vel")
        ]

        def on_truth(message):
            for publisher in commands:
                publisher.publish(forward)
            store("truth", message)

        def store(name, message):
            with changed:
                got[name] = message
                changed.notify_all()

        rospy.Subscriber("/gazebo/truth", Truth, on_truth, queue_size=100, tcp_nodelay=True)
        topics = {
            "odometry": f"/{vehicle}/odometry",
            "state": "/ground_truth/state",
            "target_odometry": f"/{target}/odom",
            "target_state": f"/{target}/ground_truth/state",
        }
        for name, topic in topics.items():
            rospy.Subscriber(topic, Odometry, lambda m, name=name: store(name, m), queue_size=100)
        rospy.Subscriber(
            "/tf",
            TFMessage,
            lambda m: frames.update((t.header.frame_id, t.child_frame_id) for t in m.transforms),
            queue_size=100,
        )
        step = rospy.ServiceProxy("/gazebo/step", Step)
        step.wait_for_service(TIMEOUT)
        while any(publisher.get_num_connections() == 0 for publisher in commands):
            rospy.rostime.wallsleep(0.02)
        rospy.rostime.wallsleep(1.0)  # The other connections.
        end = step(150).stamp
        with changed:
            arrived = changed.wait_for(
                lambda: (
                    len(got) == 5 and all(abs((m.header.stamp - end).to_sec()) < 0.05 for m in got.values())
                ),
                timeout=TIMEOUT,
            )
        self.assertTrue(arrived, f"only {sorted(got)} arrived")

        truth = got["truth"]
        self.assertTrue(truth.target_box.visible)
        self.assertEqual(truth.collisions, 0)
        self.assertGreater(truth.target_pose.position.x, 1.5)
        self.assertGreater(truth.drone_pose.position.x, -1.2)
        self.assertAlmostEqual(
            got["target_odometry"].pose.pose.position.x, truth.target_pose.position.x, delta=0.1
        )
        self.assertEqual(got["target_state"].child_frame_id, f"{target}_base_link")
        self.assertEqual(got["odometry"].child_frame_id, "base_link")
        self.assertGreater(got["odometry"].pose.covariance[0], 0)
        self.assertEqual(
            frames - {(f"{target}_base_link", f) for _, f in frames},
            {
                ("odom", "base_link"),
                (f"{target}_odom", f"{target}_base_link"),
            },
        )
        published = {topic for topic, _ in rospy.get_published_topics()}
        self.assertEqual("/range" in published, not with_ugv)
        self.assertEqual(f"/{target}/joint_states" in published, with_ugv)


if __name__ == "__main__":
    rostest.rosrun("tld_follower", "casts_node", CastsTest)
