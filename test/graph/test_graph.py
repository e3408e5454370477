#!/usr/bin/env python3
"""The running graph against the table of nodes, topics and edges that the package promises."""

import sys
import threading
import time
import unittest

import rosgraph
import rosnode
import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Image, PointCloud2, RegionOfInterest

from tld_follower.evaluation.graph import DEPTH_EDGE, FLYING_EDGES, edges, wait_for_edges
from tld_follower.msg import BoundingBox, BoundingBoxStamped, FollowState, Truth

CAMERAS = [f"/stereo/{side}/{topic}" for side in ("left", "right") for topic in ("image_raw", "camera_info")]

# node -> (subscribes, publishes)
TABLE = {
    "/gazebo": (
        ["/cmd_vel", "/husky/cmd_vel"],
        [
            *CAMERAS,
            "/clock",
            "/husky/joint_states",
            "/husky/odom",
            "/raw_imu",
            "/range",
            "/spiri/odometry",
            "/ground_truth/state",
            "/husky/ground_truth/state",
            "/tf",
        ],
    ),
    "/NODE": (["/stereo/left/image_raw", "/NODE/init"], ["/pointA", "/NODE/view"]),
    "/stamp": (["/pointA"], ["/pointstampA"]),
    "/stereo/stereo_image_proc": (CAMERAS, ["/stereo/disparity", "/stereo/points2"]),
    "/pointsdepthA": (
        ["/pointstampA", "/stereo/points2", "/spiri/odometry"],
        ["/cmd_vel", "/pointsdepthA/state"],
    ),
    "/teleop_twist_keyboard": ([], ["/husky/cmd_vel"]),
    "/husky/robot_state_publisher": (["/husky/joint_states"], ["/tf"]),
}
TRUTH = ["/ground_truth/state", "/husky/ground_truth/state", "/gazebo/truth"]
WAIT = 60.0  # s of wall-clock time, a generous bound


class Collected:
    """The messages of a topic, and a wait for enough of them."""

    def __init__(self, topic, kind):
        self.messages = []
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, kind, self._store)

    def _store(self, message):
        with self._changed:
            self.messages.append(message)
            self._changed.notify_all()

    def wait(self, condition, timeout=WAIT):
        with self._changed:
            return self._changed.wait_for(lambda: condition(self.messages), timeout)


class GraphTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("graph_test")
        cls.wanted = FLYING_EDGES | ({DEPTH_EDGE} if rospy.get_param("/NODE/use_depth") else set())
        wait_for_edges(cls.wanted, timeout=WAIT)

    def tearDown(self):
        for node in TABLE:
            self.assertTrue(rosnode.rosnode_ping(node, max_count=1, verbose=False), f"{node} is dead")

    def test_nodes_and_topics(self):
        publishers, subscribers, _ = rosgraph.Master("/graph_test").getSystemState()
        nodes = {node for _, names in [*publishers, *subscribers] for node in names}
        self.assertEqual(nodes - {rospy.get_name(), "/rosout"}, set(TABLE))
        for node, (wanted_in, wanted_out) in TABLE.items():
            for wanted, state in ((wanted_in, subscribers), (wanted_out, publishers)):
                missing = set(wanted) - {topic for topic, names in state if node in names}
                self.assertFalse(missing, f"{node} lacks {missing}")

    def test_edges(self):
        unwatched = {(a, topic, b) for a, topic, b in edges() if rospy.get_name() not in (a, b)}
        found = {
            edge
            for edge in unwatched
            if edge[1] not in ("/rosout", "/rosout_agg", "/clock", "/tf", "/tf_static")
        }
        self.assertEqual(found, self.wanted)

    def test_no_node_reads_the_truth(self):
        _, subscribers, _ = rosgraph.Master("/graph_test").getSystemState()
        readers = {node for topic, names in subscribers if topic in TRUTH for node in names}
        self.assertLessEqual(readers, {rospy.get_name()})

    def test_from_image_to_command(self):
        truth, boxes = Collected("/gazebo/truth", Truth), Collected("/pointA", BoundingBox)
        stamped = Collected("/pointstampA", BoundingBoxStamped)
        commands, states = Collected("/cmd_vel", Twist), Collected("/pointsdepthA/state", FollowState)
        clouds = Collected("/stereo/points2", PointCloud2)

        # Nothing is shown yet: a box for every image, none visible, and the drone hovers.
        self.assertTrue(boxes.wait(lambda m: len(m) > 20) and commands.wait(lambda m: len(m) > 20))
        self.assertFalse(any(box.visible for box in boxes.messages))
        self.assertTrue(all(command == Twist() for command in commands.messages))
        self.assertTrue(all(state.mode == FollowState.WAITING for state in states.messages))

        self.assertTrue(truth.wait(lambda m: m and m[-1].target_box.visible), "Husky is not in view")
        init = rospy.Publisher("/NODE/init", RegionOfInterest, queue_size=1)
        wait_for_edges({(rospy.get_name(), "/NODE/init", "/NODE")}, timeout=WAIT)
        box = truth.messages[-1].target_box
        init.publish(RegionOfInterest(int(box.x), int(box.y), int(box.height), int(box.width), False))
        self.assertTrue(boxes.wait(lambda m: m[-1].visible), "the tracker gave no box")
        self.assertTrue(
            states.wait(lambda m: m[-1].mode == FollowState.FOLLOWING), "the follower does not follow"
        )
        # The drone stands well beyond the set distance: a distance that is not measured would show.
        first = next(state for state in states.messages if state.mode == FollowState.FOLLOWING)
        true = next(message for message in truth.messages if message.header.stamp == first.header.stamp)
        self.assertGreater(true.distance, 1.4)
        self.assertAlmostEqual(first.distance, true.distance, delta=0.15)

        # Box, its stamped form and its cloud carry the stamp of the image.
        images = {message.header.stamp for message in truth.messages}
        self.assertTrue({box.captured for box in boxes.messages[5:-5]} <= images)
        self.assertTrue(all(m.header.stamp == m.box.captured for m in stamped.messages))
        self.assertTrue({cloud.header.stamp for cloud in clouds.messages[5:-5]} <= images)

    def test_view_is_published_while_somebody_looks(self):
        view = Collected("/NODE/view", Image)
        self.assertTrue(view.wait(lambda m: m))
        self.assertEqual((view.messages[0].width, view.messages[0].height), (320, 240))

    def test_the_clock_runs(self):
        first = rospy.get_time()
        deadline = time.monotonic() + WAIT
        while rospy.get_time() <= first and time.monotonic() < deadline:
            time.sleep(0.01)
        self.assertGreater(rospy.get_time(), first)


if __name__ == "__main__":
    import rostest

    sys.exit(rostest.rosrun("tld_follower", "graph", GraphTest, sys.argv))
