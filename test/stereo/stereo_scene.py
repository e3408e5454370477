# SPDX-License-Identifier: BSD-3-Clause
"""A wall before a stereo pair, and what the node under test makes of it."""

import time
import unittest

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from stereo_msgs.msg import DisparityImage

WIDTH, HEIGHT = 320, 240
FOCAL, CX, CY, BASELINE = 250.0, 159.5, 119.5, 0.049
SHIFT = 12  # pixels, disparity of the wall in front of both cameras
SIDES = ("left", "right")
IMAGES = ("image_mono", "image_color", "image_rect", "image_rect_color")
TYPES = {
    "disparity": DisparityImage,
    "points2": PointCloud2,
    "points2_filtered": PointCloud2,
    **{f"{side}/{image}": Image for side in SIDES for image in IMAGES},
}
FRAME = "stereo_left_optical_frame"
DEADLINE = 30.0  # s, wall time; only a failure takes so long


def make_texture(seed):
    """Colour noise that blocks can be matched in: uint8, HEIGHT x WIDTH x 3, BGR."""
    noise = np.random.default_rng(seed).integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    return cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 1.2), None, 0, 255, cv2.NORM_MINMAX)


def to_encoding(bgr, encoding):
    """The pixels of a BGR image in a ROS encoding."""
    if encoding == "mono8":
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    if encoding == "mono16":
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY).astype(np.uint16) * 257
    if encoding == "rgb8":
        return np.ascontiguousarray(bgr[..., ::-1])
    if encoding.startswith("bayer"):
        raw = np.empty(bgr.shape[:2], np.uint8)
        for i, colour in enumerate(encoding[6:10]):
            raw[i // 2 :: 2, i % 2 :: 2] = bgr[i // 2 :: 2, i % 2 :: 2, "bgr".index(colour)]
        return raw
    return bgr


class Scene:
    """A wall at a known disparity: publishes pairs of it, as wrong as a test wants them."""

    def __init__(self, namespace):
        self.images = {s: rospy.Publisher(f"{namespace}/{s}/image_raw", Image, queue_size=5) for s in SIDES}
        self.infos = {
            s: rospy.Publisher(f"{namespace}/{s}/camera_info", CameraInfo, queue_size=5) for s in SIDES
        }
        self.left = make_texture(1)
        self.count = 0

    def connections(self):
        return [p.get_num_connections() for p in (*self.images.values(), *self.infos.values())]

    def publish(self, *, encoding="mono8", shift=SHIFT, change=None, late=0.0, infos=True):
        """Publishes one pair and returns the left stamp.

        `change(side, image, info)` may spoil a message before it goes out; `late` is by how many seconds the
        right camera's stamps are after the left's.
        """
        self.count += 1
        stamp = rospy.Time.from_sec(10000.0 + self.count)
        for side in SIDES:
            pixels = self.left if side == "left" else np.roll(self.left, -shift, axis=1)
            data = to_encoding(pixels, encoding)
            image = Image(height=HEIGHT, width=WIDTH, encoding=encoding)
            image.step, image.data = data.strides[0], data.tobytes()
            info = CameraInfo(height=HEIGHT, width=WIDTH, distortion_model="plumb_bob", D=[0.0] * 5)
            tx = 0.0 if side == "left" else -FOCAL * BASELINE
            info.K = [FOCAL, 0, CX, 0, FOCAL, CY, 0, 0, 1]
            info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
            info.P = [FOCAL, 0, CX, tx, 0, FOCAL, CY, 0, 0, 0, 1, 0]
            for message in (image, info):
                message.header.frame_id = FRAME
                message.header.stamp = stamp + rospy.Duration(late if side == "right" else 0.0)
            if change:
                change(side, image, info)
            self.images[side].publish(image)
            if infos:
                self.infos[side].publish(info)
        return stamp


class Results:
    """Subscribes to the results while the `with` block lasts."""

    def __init__(self, namespace, topics=("disparity", "points2")):
        self.namespace, self.topics = namespace, topics

    def __enter__(self):
        self.got = {topic: [] for topic in self.topics}
        self.subscribers = [
            rospy.Subscriber(f"{self.namespace}/{t}", TYPES[t], self.got[t].append) for t in self.topics
        ]
        return self

    def __exit__(self, *_):
        for subscriber in self.subscribers:
            subscriber.unregister()

    def of(self, stamps):
        """The messages, one a topic, of the newest stamp that every topic has; None if there is none."""
        for stamp in reversed(stamps):
            found = [
                next((m for m in list(self.got[t]) if m.header.stamp == stamp), None) for t in self.topics
            ]
            if None not in found:
                return found
        return None


def wait_for(condition, what):
    deadline = time.monotonic() + DEADLINE
    while time.monotonic() < deadline:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"after {DEADLINE:.0f} s still not: {what}")


def pixels_of(image):
    """uint8 height x width x channels of an 8-bit image message."""
    return np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, -1)


def points_of(cloud):
    """float32 height x width x 8 and uint8 height x width x 32 views of a cloud with point_step 32."""
    raw = np.frombuffer(cloud.data, np.uint8).reshape(cloud.height, cloud.width, 32)
    return raw.view(np.float32), raw


class StereoCase(unittest.TestCase):
    namespace = "/stereo"

    @classmethod
    def setUpClass(cls):
        cls.scene = Scene(cls.namespace)

    def connected(self):
        wait_for(lambda: all(self.scene.connections()), "inputs subscribed")

    def result(self, results, **pair):
        """Publishes pairs until each topic has answered one, and returns the answers."""
        stamps = []

        def step():
            stamps.append(self.scene.publish(**pair))
            time.sleep(0.2)
            return results.of(stamps)

        return wait_for(step, f"a result for {pair}")
