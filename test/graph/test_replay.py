#!/usr/bin/env python3
"""Record a flight, replay it with --clock on a graph of its own, and compare the boxes."""

import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import rosbag
import rospy
from geometry_msgs.msg import Twist
from std_srvs.srv import Empty

from tld_follower.evaluation.graph import (
    FLYING_EDGES,
    edges,
    launched,
    private_master,
    stop,
    wait_for_edges,
)
from tld_follower.msg import BoundingBox, Truth
from tld_follower.srv import Step

TAKE_OFF = 120  # frames
SECONDS = 5.0  # of flight that is recorded
WAIT = 120.0  # s of wall-clock time, a generous bound
RECORDED = ["/stereo/left/image_raw", "/pointA", "/stereo/left/camera_info", "/stereo/right/image_raw"]


def boxes_of(bag):
    with rosbag.Bag(str(bag)) as recording:
        return {
            message.captured: (
                message.visible,
                message.x,
                message.y,
                message.width,
                message.height,
                message.confidence,
            )
            for _, message, _ in recording.read_messages("/pointA")
        }


def wait_for(condition, what):
    deadline = time.monotonic() + WAIT
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {WAIT:.0f} s: {what}")
        time.sleep(0.05)


class ReplayTest(unittest.TestCase):
    def setUp(self):
        rospy.init_node("replay_test")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def record(self):
        """Fly for some seconds, recorded from the tracker's first frame on; return the bag."""
        truths, newest = [], []
        rospy.Subscriber("/gazebo/truth", Truth, truths.append)
        rospy.Subscriber("/pointA", BoundingBox, newest.append)
        wait_for_edges({("/gazebo", "/gazebo/truth", rospy.get_name())}, timeout=WAIT)
        # Take-off without the tracker; where the target then stands is what it is shown.
        hover = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
        answer = rospy.Subscriber("/gazebo/truth", Truth, lambda _: hover.publish(Twist()))
        wait_for_edges({(rospy.get_name(), "/cmd_vel", "/gazebo")}, timeout=WAIT)
        rospy.wait_for_service("/gazebo/step", timeout=WAIT)
        self.assertTrue(rospy.ServiceProxy("/gazebo/step", Step)(TAKE_OFF).success)
        wait_for(lambda: len(truths) == TAKE_OFF, "the take-off")
        answer.unregister()
        hover.unregister()
        box = truths[-1].target_box
        self.assertTrue(box.visible)

        bag = self.folder / "flight.bag"
        tracking = {
            "resolution": "320x240",
            "init_box": f"{box.x},{box.y},{box.width},{box.height}",
            "tracker": "tld_sift",
            "use_depth": "false",
        }
        unused = {("/teleop_twist_keyboard", "/husky/cmd_vel", "/gazebo")}
        with launched("tracking.launch", tracking, self.folder / "tracking.log") as alive:
            with launched("record.launch", {"bag": bag}, self.folder / "record.log") as recording:
                wait_for_edges(FLYING_EDGES - unused, timeout=WAIT, alive=alive)
                wait_for(
                    lambda: set(RECORDED) <= {t for _, t, node in edges() if node == "/recorder"},
                    "the recorder",
                )
                rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
                wait_for(lambda: newest and len(newest) > SECONDS * 30, "the flight")
                rospy.ServiceProxy("/gazebo/pause_physics", Empty)()
                recording()
            alive()
        return bag, tracking

    def replay(self, bag, tracking):
        """Replay a bag on a master of its own; return the bag with the boxes of the replay."""
        boxes = self.folder / "boxes.bag"
        with private_master(self.folder):
            recorder = subprocess.Popen(
                ["rosbag", "record", "--quiet", "-O", str(boxes), "/pointA"], start_new_session=True
            )
            try:
                arguments = {"bag": bag, "rate": 0.5, **tracking}
                with launched("replay.launch", arguments, self.folder / "replay.log") as alive:
                    ended = False
                    deadline = time.monotonic() + WAIT
                    while not ended and time.monotonic() < deadline:
                        try:
                            alive()
                            time.sleep(0.2)
                        except RuntimeError:
                            ended = True  # the player is required: the graph ends with it
            finally:
                stop(recorder)
        self.assertTrue(ended, "the replay did not end")
        return boxes

    def test_replay_gives_the_same_boxes(self):
        bag, tracking = self.record()
        flown = boxes_of(bag)
        self.assertGreater(len(flown), 0.9 * SECONDS * 30)
        self.assertGreater(sum(visible for visible, *_ in flown.values()), 0.9 * len(flown))
        replayed = boxes_of(self.replay(bag, tracking))
        # The end of the replay stops the graph: the last frames may be missing.
        self.assertGreater(len(replayed), len(flown) - 10)
        for stamp, box in replayed.items():
            self.assertEqual(box, flown[stamp], f"at {stamp.to_sec():.3f} s")


if __name__ == "__main__":
    import rostest

    sys.exit(rostest.rosrun("tld_follower", "replay", ReplayTest, sys.argv))
