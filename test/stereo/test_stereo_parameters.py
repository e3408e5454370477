#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of stereo_cloud at its start: what cannot work ends it, what is not in force is said."""

import signal
import subprocess
import tempfile
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

    def test_a_manager_refuses_the_nodelet_and_goes_on(self):
        output = self.enterContext(tempfile.TemporaryFile("w+"))
        streams = {"stdout": output, "stderr": subprocess.STDOUT}
        manager = subprocess.Popen(("rosrun", "nodelet", "nodelet", "manager", "__name:=manager"), **streams)
        self.addCleanup(manager.wait, DEADLINE)
        self.addCleanup(manager.terminate)
        load = ("rosrun", "nodelet", "nodelet", "load", "tld_follower/StereoCloud", "/manager")
        load += ("__ns:=wrong", "__name:=stereo_image_proc")
        rospy.set_param(self.name, {"queue_size": 0})
        # The loader waits for the manager.
        run = subprocess.run(load, capture_output=True, timeout=DEADLINE, check=False)
        self.assertNotEqual(run.returncode, 0)
        self.assertIsNone(manager.poll())
        output.seek(0)
        self.assertIn("~queue_size must be", output.read())

        rospy.set_param(self.name, {"queue_size": 5})
        loader = subprocess.Popen(load)
        self.addCleanup(loader.wait, DEADLINE)
        self.addCleanup(loader.send_signal, signal.SIGINT)
        self.wait_until_advertised(loader)

    def wait_until_advertised(self, process):
        """Waits for points2, which comes last."""
        published = f"{self.name.rpartition('/')[0]}/points2"
        end = time.monotonic() + DEADLINE
        while published not in (topic for topic, _ in rospy.get_published_topics()):
            self.assertIsNone(process.poll())
            self.assertLess(time.monotonic(), end, "the node did not start")
            time.sleep(0.05)

    def warnings_at_start(self, **parameters):
        rospy.set_param(self.name, parameters)
        node = subprocess.Popen(self.command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.addCleanup(node.kill)
        self.wait_until_advertised(node)
        node.send_signal(signal.SIGINT)
        return [line for line in node.communicate(timeout=DEADLINE)[1].splitlines() if "WARN" in line]

    def test_values_of_the_filter_that_are_not_in_force_are_one_warning(self):
        (warning,) = self.warnings_at_start(filter={"voxel_size": -1, "mean_k": 30})
        self.assertIn("~voxel_size 0", warning)
        self.assertNotIn("mean_k", warning)

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
