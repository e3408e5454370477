#!/usr/bin/env python3
"""The tracker waits for the cloud of its image, believes it, and goes on without one."""

import sys
import threading
import unittest

import numpy as np
import rosnode
import rospy
from rosgraph_msgs.msg import Clock, Log
from sensor_msgs.msg import Image, PointCloud2, PointField, RegionOfInterest

from tld_follower.evaluation.graph import DEPTH_EDGE, wait_for_edges
from tld_follower.msg import BoundingBox

WAIT = 60.0  # s of wall-clock time, a generous bound
WIDTH, HEIGHT = 320, 240
TARGET = RegionOfInterest(x_offset=110, y_offset=80, width=60, height=50)
TARGET_DEPTH, WALL_DEPTH = 2.0, 5.0
PICTURE = np.random.default_rng(0).integers(0, 256, (HEIGHT // 3, WIDTH // 4)).repeat(3, 0).repeat(4, 1)


def cloud(depth, stamp, width=WIDTH, height=HEIGHT):
    """Make a cloud of a wall and the target at `depth` [m] before it; NaN or inf is the depth of both."""
    z = np.full((height, width), WALL_DEPTH if np.isfinite(depth) else depth, np.float32)
    z[80:130, 110:170] = depth
    points = np.stack([np.zeros_like(z), np.zeros_like(z), z], axis=-1)
    message = PointCloud2(height=height, width=width, point_step=12, row_step=12 * width)
    message.fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate("xyz")]
    message.data = points.tobytes()
    message.header.stamp = stamp
    return message


class DepthTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("depth_test")
        cls.changed, cls.boxes, cls.log, cls.targets = threading.Condition(), {}, [], 0
        cls.time = rospy.Time(10)
        rospy.Subscriber("/pointA", BoundingBox, cls.keep)
        rospy.Subscriber("/rosout", Log, lambda m: cls.note(lambda: cls.log.append(m.msg)))
        rospy.Subscriber("/NODE/target", RegionOfInterest, lambda m: cls.note(cls.count))
        cls.clock = rospy.Publisher("/clock", Clock, queue_size=10)
        cls.camera = rospy.Publisher("/stereo/left/image_raw", Image, queue_size=1)
        cls.clouds = rospy.Publisher("/stereo/points2", PointCloud2, queue_size=1)
        cls.init = rospy.Publisher("/NODE/init", RegionOfInterest, queue_size=1)
        me = rospy.get_name()
        _, topic, node = DEPTH_EDGE
        inputs = {(me, name, node) for name in ("/clock", "/stereo/left/image_raw", "/NODE/init", topic)}
        outputs = {(node, name, me) for name in ("/pointA", "/NODE/target")}
        wait_for_edges(inputs | outputs, timeout=WAIT)

    @classmethod
    def note(cls, change):
        with cls.changed:
            change()
            cls.changed.notify_all()

    @classmethod
    def keep(cls, box):
        cls.note(lambda: cls.boxes.update({box.captured: box}))

    @classmethod
    def count(cls):
        cls.targets += 1

    def wait(self, condition, what):
        with self.changed:
            self.assertTrue(self.changed.wait_for(condition, WAIT), f"not within {WAIT:.0f} s: {what}")

    def shoot(self):
        """Publish the picture of the next moment; returns its stamp."""
        type(self).time += rospy.Duration(0.033)
        self.clock.publish(self.time)
        message = Image(height=HEIGHT, width=WIDTH, step=WIDTH, encoding="mono8")
        message.data = PICTURE.astype(np.uint8).tobytes()
        message.header.stamp = self.time
        self.camera.publish(message)
        return self.time

    def box(self, stamp):
        self.wait(lambda: stamp in self.boxes, f"a box for {stamp.to_sec():.3f}")
        return self.boxes[stamp]

    def box_as_time_passes(self, stamp):
        with self.changed:
            for _ in range(int(WAIT / 0.2)):
                if self.changed.wait_for(lambda: stamp in self.boxes, 0.2):
                    return self.boxes[stamp]
                type(self).time += rospy.Duration(0.15)
                self.clock.publish(self.time)
        self.fail(f"no box for {stamp.to_sec():.3f} within {WAIT:.0f} s")

    def seen(self, depth):
        """Whether the target is seen where the cloud, which comes after the image, has it at a depth [m]."""
        stamp = self.shoot()
        self.clouds.publish(cloud(depth, stamp))
        return self.box(stamp).visible

    def setUp(self):
        """Show the target for long enough that its size is known."""
        self.seen(TARGET_DEPTH)
        targets = self.targets
        self.init.publish(TARGET)
        self.wait(lambda: self.targets > targets, "the target is learnt")
        for _ in range(15):
            self.assertTrue(self.seen(TARGET_DEPTH))

    def tearDown(self):
        self.assertTrue(rosnode.rosnode_ping("/NODE", max_count=1, verbose=False), "/NODE is dead")

    def test_what_stands_where_the_target_can_not_be_is_not_the_target(self):
        """The image alone would do; the box shows that its cloud was waited for, while time stood still."""
        self.assertFalse(self.seen(0.5 * TARGET_DEPTH))
        self.assertFalse(self.seen(0.5 * TARGET_DEPTH))
        self.assertTrue(any(self.seen(TARGET_DEPTH) for _ in range(10)))

    def test_clouds_without_depth_hold_nothing_up(self):
        for depth in (np.nan, np.inf, -np.inf, 0.0, -1.0):
            self.assertTrue(self.seen(depth), f"depth {depth}")

    def test_clouds_that_are_none_are_named_and_hold_nothing_up(self):
        for bad, reason in (
            (lambda stamp: cloud(1.0, stamp, 2 * WIDTH, HEIGHT), "640x240 pixels"),
            (lambda stamp: PointCloud2(header=cloud(1.0, stamp).header), "point cloud without"),
        ):
            stamp = self.shoot()
            self.clouds.publish(bad(stamp))
            self.assertTrue(self.box(stamp).visible)
            self.wait(lambda reason=reason: any(reason in line for line in self.log), reason)

    def test_without_clouds_it_goes_on(self):
        """One wait in ROS time, then none until a cloud comes: here time stands still."""
        stamp = self.shoot()
        self.assertTrue(self.box_as_time_passes(stamp).visible)
        self.wait(lambda: any("no point cloud for an image" in line for line in self.log), "a warning")
        for _ in range(3):
            self.assertTrue(self.box(self.shoot()).visible)
        self.clouds.publish(cloud(TARGET_DEPTH, self.time))
        self.wait_for_depth()

    def test_a_stale_cloud_is_not_taken(self):
        old = self.time - rospy.Duration(0.1)
        stamp = self.shoot()
        self.clouds.publish(cloud(0.5 * TARGET_DEPTH, old))
        self.assertTrue(self.box_as_time_passes(stamp).visible)
        self.wait_for_depth()

    def wait_for_depth(self):
        """See that clouds count again."""
        for _ in range(20):
            if not self.seen(0.25 * TARGET_DEPTH):
                return
        self.fail("clouds are not taken any more")


if __name__ == "__main__":
    import rostest

    sys.exit(rostest.rosrun("tld_follower", "depth", DepthTest, sys.argv))
