#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of stereo_cloud at its start: what cannot work ends it, what is not in force is said."""

import signal
import subprocess
import time
import unittest

import rospy
import rostest

DEADLINE = 30.0  # s, wall time; only a failure takes so long


class ParametersTest(unittest.TestCase):
    name = "/wrong/stereo_image_proc"
    command = ("rosrun", "tld_follower", "stereo_cloud", "__ns:=wrong")

    def tearDown(self):
        rospy.delete_param(self.name)

    def test_unusable_ones_are_one_message_and_a_failure(self):
        for name, value in (
            ("image_transport", "no_such_transport"),
            ("image_transport", 5),
            ("queue_size", 0),
            ("queue_size", 2.5),
            ("queue_size", "many"),
            ("approximate_sync", "perhaps"),
        ):
            with self.subTest(f"{name}: {value}"):
                rospy.set_param(self.name, {name: value})
                streams = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
                run = subprocess.run(self.command, **streams, timeout=DEADLINE, check=False)
                self.assertEqual(run.returncode, 1)
                lines = run.stdout.strip().splitlines()
                self.assertEqual(len(lines), 1, lines)
                self.assertIn("FATAL", lines[0])
                self.assertIn(f"~{name}", lines[0])

    def warnings_at_start(self, **parameters):
        rospy.set_param(self.name, parameters)
        node = subprocess.Popen(self.command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.addCleanup(node.kill)
        # Advertised after the warning.
        published = f"{self.name.rpartition('/')[0]}/points2"
        end = time.monotonic() + DEADLINE
        while published not in (topic for topic, _ in rospy.get_published_topics()):
            self.assertLess(time.monotonic(), end, "the node did not start")
            time.sleep(0.05)
        node.send_signal(signal.SIGINT)
        return [line for line in node.communicate(timeout=DEADLINE)[1].splitlines() if "WARN" in line]

    def test_values_that_are_not_in_force_are_one_warning(self):
        wrong = {"disparity_range": 47, "P1": "much", "speckle_range": 99, "fullDP": 1}
        (warning,) = self.warnings_at_start(**wrong, uniqueness_ratio=10)
        for name in ("~disparity_range 32", "~P1 200", "~speckle_range 31", "~fullDP 0"):
            self.assertIn(name, warning)
        self.assertNotIn("uniqueness_ratio", warning)

    def test_values_in_force_are_no_warning(self):
        right = {"disparity_range": 128, "P1": 100, "P2": 500.0, "fullDP": True}
        self.assertEqual(self.warnings_at_start(**right, queue_size=3, image_transport="raw"), [])


if __name__ == "__main__":
    rospy.init_node("stereo_parameters")
    rostest.rosrun("tld_follower", "stereo_parameters", ParametersTest)
