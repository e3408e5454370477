#!/usr/bin/env python3
"""Learning is switched between frames, a saved model finds its target again, and one camera will do."""

import os
import sys
import tempfile
import threading
import unittest

import numpy as np
import rospy
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image, RegionOfInterest
from std_srvs.srv import SetBool

from tld_follower.box import Box
from tld_follower.evaluation.graph import wait_for_edges
from tld_follower.msg import BoundingBox
from tld_follower.nodes.conversions import message_box
from tld_follower.srv import ModelFile

WAIT = 60.0  # s of wall-clock time, a generous bound
WIDTH, HEIGHT = 320, 240
TARGET = Box(110, 80, 60, 50)


def speckle(height, width, seed):
    """Return blocks of random grey of 3 x 3 pixels."""
    coarse = np.random.default_rng(seed).integers(0, 256, (height // 3 + 1, width // 3 + 1))
    return np.kron(coarse, np.ones((3, 3)))[:height, :width].astype(np.uint8)


def scene(box, look=1, height=HEIGHT, width=WIDTH):
    """Show a target, of one of several looks, in front of a wall; None: the wall alone."""
    image = speckle(height, width, 0) // 3 + 60
    if box is not None:
        x, y, w, h = map(int, box.as_tuple())
        image[y : y + h, x : x + w] = speckle(h, w, 1) // 2 + speckle(h, w, look) // 2
    return image


class ModelTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("model_test")
        cls.changed, cls.boxes, cls.targets = threading.Condition(), {}, 0
        cls.stamp = rospy.Time(10)
        rospy.Subscriber("/pointA", BoundingBox, cls.note)
        rospy.Subscriber("/NODE/target", RegionOfInterest, cls.count)
        cls.warnings = []
        rospy.Subscriber("/rosout", Log, cls.read)
        cls.camera = rospy.Publisher("/stereo/left/image_raw", Image, queue_size=1)
        cls.right = rospy.Publisher("/stereo/right/image_raw", Image, queue_size=1)
        cls.init = rospy.Publisher("/NODE/init", RegionOfInterest, queue_size=1)
        me = rospy.get_name()
        wait_for_edges(
            {
                (me, "/stereo/left/image_raw", "/NODE"),
                (me, "/stereo/right/image_raw", "/NODE"),
                (me, "/NODE/init", "/NODE"),
                ("/NODE", "/pointA", me),
                ("/NODE", "/NODE/target", me),
            },
            timeout=WAIT,
        )
        for name in ("learning", "save_model", "load_model"):
            rospy.wait_for_service(f"/NODE/{name}", WAIT)
        cls.learning = rospy.ServiceProxy("/NODE/learning", SetBool)
        cls.save = rospy.ServiceProxy("/NODE/save_model", ModelFile)
        cls.load = rospy.ServiceProxy("/NODE/load_model", ModelFile)

    @classmethod
    def note(cls, box):
        with cls.changed:
            cls.boxes[box.captured] = box
            cls.changed.notify_all()

    @classmethod
    def count(cls, _):
        with cls.changed:
            cls.targets += 1
            cls.changed.notify_all()

    @classmethod
    def read(cls, log):
        with cls.changed:
            if log.name == "/NODE" and log.level >= Log.WARN:
                cls.warnings.append(log.msg)
                cls.changed.notify_all()

    def said(self, words):
        """Wait until the tracker has warned with these words."""
        with self.changed:
            said = self.changed.wait_for(lambda: any(words in text for text in self.warnings), WAIT)
        self.assertTrue(said, f"'{words}' not in {self.warnings}")

    def show(self, picture, right=None, late=0.0):
        """Publish an image, and one of the right camera that is `late` [s]; return the tracker's answer."""
        type(self).stamp += rospy.Duration(1, 0) / 30
        for camera, pixels, stamp in (
            (self.right, right, self.stamp + rospy.Duration.from_sec(late)),
            (self.camera, picture, self.stamp),
        ):
            if pixels is not None:
                message = Image(height=pixels.shape[0], width=pixels.shape[1], encoding="mono8")
                message.header.stamp, message.step, message.data = stamp, pixels.shape[1], pixels.tobytes()
                camera.publish(message)
        with self.changed:
            self.assertTrue(self.changed.wait_for(lambda: self.stamp in self.boxes, WAIT), "no box")
            return self.boxes[self.stamp]

    def setUp(self):
        self.assertTrue(self.learning(True).success)
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = os.path.join(self.folder.name, "target.npz")
        self.show(scene(TARGET))
        targets = self.targets
        self.init.publish(RegionOfInterest(x_offset=110, y_offset=80, width=60, height=50))
        with self.changed:
            self.assertTrue(self.changed.wait_for(lambda: self.targets > targets, WAIT), "not learnt")
        for _ in range(4):
            self.assertTrue(self.show(scene(TARGET)).visible)

    def counts(self):
        """Examples that the tracker was trained with so far, as its model says."""
        answer = self.save(self.path)
        self.assertTrue(answer.success, answer.message)
        with np.load(self.path) as model:
            return int(model["counts"].sum()), len(model["positives"]) + len(model["negatives"])

    def new_looks(self):
        for look in range(2, 8):
            for _ in range(3):
                self.show(scene(TARGET, look))

    def test_nothing_is_learnt_while_learning_is_off(self):
        before = self.counts()
        self.assertEqual(self.learning(False).message, "learning is off")
        self.new_looks()
        self.assertEqual(self.counts(), before)
        self.assertEqual(self.learning(True).message, "learning is on")
        for _ in range(4):
            self.show(scene(TARGET))
        self.new_looks()
        self.assertGreater(self.counts(), before)

    def test_a_saved_target_is_found_again_after_another_one(self):
        self.assertTrue(self.save(self.path).success)
        number = self.show(scene(TARGET)).target
        targets = self.targets
        self.init.publish(RegionOfInterest(x_offset=10, y_offset=10, width=50, height=50))
        with self.changed:
            self.assertTrue(self.changed.wait_for(lambda: self.targets > targets, WAIT), "not learnt")
        answer = self.load(self.path)
        self.assertTrue(answer.success, answer.message)
        elsewhere = Box(220, 150, 60, 50)
        self.assertFalse(self.show(scene(None)).visible)
        found = [self.show(scene(elsewhere)) for _ in range(3)][-1]
        self.assertGreater(message_box(found).overlap(elsewhere), 0.7)
        self.assertEqual(found.target, number + 2)

    def test_files_that_cannot_be(self):
        garbage = os.path.join(self.folder.name, "garbage.npz")
        with open(garbage, "wb") as file:
            file.write(b"PK\x03\x04 no model")
        for service, path, words in (
            (self.save, "target.npz", "absolute"),
            (self.save, os.path.join(self.folder.name, "none", "target.npz"), "No such file"),
            (self.load, "target.npz", "absolute"),
            (self.load, self.path, "No such file"),
            (self.load, self.folder.name, "directory"),
            (self.load, garbage, "no model"),
        ):
            answer = service(path)
            self.assertFalse(answer.success)
            self.assertIn(words, answer.message)
        self.assertEqual(os.listdir(self.folder.name), ["garbage.npz"])
        self.assertTrue(self.show(scene(TARGET)).visible)  # the old target is kept

    def test_a_model_of_another_camera(self):
        self.assertTrue(self.save(self.path).success)
        self.assertFalse(self.show(scene(TARGET, height=140, width=200)).visible)
        answer = self.load(self.path)
        self.assertFalse(answer.success)
        self.assertIn("320x240, the camera gives 200x140", answer.message)
        self.assertTrue(self.show(scene(TARGET)).visible)

    def test_a_right_camera_that_is_dead_late_or_broken(self):
        aside = Box(TARGET.x - 12, *TARGET.as_tuple()[1:])
        self.assertTrue(self.show(scene(TARGET), scene(aside)).visible)
        self.assertTrue(self.show(scene(TARGET)).visible)
        self.said("no right image for an image: going on without")
        late = self.show(scene(TARGET), scene(aside), 0.001)
        self.assertTrue(late.visible)
        self.assertTrue(self.show(scene(TARGET), scene(aside)[:100, :100]).visible)
        self.said("right image ignored: 100x100 pixels for an image of 320x240")
        for step in range(20):
            moved = Box(TARGET.x + 6 * step, *TARGET.as_tuple()[1:])
            box = self.show(scene(moved), scene(Box(moved.x - 12, *moved.as_tuple()[1:])))
            self.assertGreater(message_box(box).overlap(moved), 0.7)


if __name__ == "__main__":
    import rostest

    sys.exit(rostest.rosrun("tld_follower", "model", ModelTest, sys.argv))
