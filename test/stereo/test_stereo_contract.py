#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a user of stereo_image_proc relies on, asked of the node that the launch file started.

`Contract` and `Approximate` hold for Debian's stereo_image_proc and for stereo_cloud; `Beyond` is asked of
stereo_cloud alone: it is where stereo_image_proc is wrong or silent.
"""

import time
import unittest

import cv2
import numpy as np
import rospy
import rostest
from dynamic_reconfigure.client import Client
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField, RegionOfInterest
from stereo_msgs.msg import DisparityImage

WIDTH, HEIGHT = 320, 240
FOCAL, CX, CY, BASELINE = 250.0, 159.5, 119.5, 0.049
SHIFT = 12  # pixels, disparity of the wall in front of both cameras
TYPES = {"disparity": DisparityImage, "points2": PointCloud2}
SIDES = ("left", "right")
FRAME = "stereo_left_optical_frame"
DEFAULTS = {
    "stereo_algorithm": 0,
    "prefilter_size": 9,
    "prefilter_cap": 31,
    "correlation_window_size": 15,
    "min_disparity": 0,
    "disparity_range": 64,
    "uniqueness_ratio": 15.0,
    "texture_threshold": 10,
    "speckle_size": 100,
    "speckle_range": 4,
    "fullDP": False,
    "P1": 200.0,
    "P2": 400.0,
    "disp12MaxDiff": 0,
}
DEADLINE = 30.0  # s, wall time; only a failure takes so long


def make_texture(seed):
    """Colour noise that blocks can be matched in: uint8, HEIGHT x WIDTH x 3, BGR."""
    noise = np.random.default_rng(seed).integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    return cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 1.2), None, 0, 255, cv2.NORM_MINMAX)


def to_encoding(bgr, encoding):
    """The pixels of a BGR image in a ROS encoding."""
    if encoding == "mono8":
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
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
        """The messages, one a topic, that belong to one of the stamps; None while one is missing."""
        found = []
        for topic in self.topics:
            match = [m for m in list(self.got[topic]) if m.header.stamp in stamps]
            if not match:
                return None
            found.append(match[-1])
        return found


def wait_for(condition, what):
    deadline = time.monotonic() + DEADLINE
    while time.monotonic() < deadline:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"after {DEADLINE:.0f} s still not: {what}")


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
        self.connected()
        stamps = []

        def step():
            stamps.append(self.scene.publish(**pair))
            time.sleep(0.2)
            return results.of(stamps)

        return wait_for(step, f"a result for {pair}")


class Contract(StereoCase):
    def test_subscribes_only_while_subscribed_to(self):
        for topic in ("points2", "disparity"):
            wait_for(lambda: not any(self.scene.connections()), "inputs released")
            with Results(self.namespace, (topic,)) as results:
                self.result(results)
        wait_for(lambda: not any(self.scene.connections()), "inputs released again")

    def test_disparity_message(self):
        with Results(self.namespace, ("disparity",)) as results:
            (message,) = self.result(results)
        self.assertEqual(message.header.frame_id, FRAME)
        self.assertEqual(message.image.header.frame_id, FRAME)
        self.assertEqual(message.image.header.stamp, message.header.stamp)
        self.assertEqual((message.image.height, message.image.width), (HEIGHT, WIDTH))
        self.assertEqual((message.image.encoding, message.image.step), ("32FC1", 4 * WIDTH))
        self.assertAlmostEqual(message.f, FOCAL, places=4)
        self.assertAlmostEqual(message.T, BASELINE, places=6)
        self.assertEqual((message.min_disparity, message.max_disparity), (0, 63))
        self.assertEqual(message.delta_d, 1 / 16)
        values = np.frombuffer(message.image.data, np.float32).reshape(HEIGHT, WIDTH)
        self.assertTrue(np.all(values[:, :40] == -1.0))  # outside of the search
        inner = values[20:-20, 90:-20]
        self.assertGreater(np.mean(np.abs(inner - SHIFT) < 0.5), 0.99)

    def test_cloud_layout_and_values(self):
        with Results(self.namespace, ("points2",)) as results:
            (cloud,) = self.result(results)
        self.assertEqual(cloud.header.frame_id, FRAME)
        self.assertEqual((cloud.height, cloud.width), (HEIGHT, WIDTH))
        self.assertEqual((cloud.point_step, cloud.row_step), (32, 32 * WIDTH))
        self.assertEqual((cloud.is_dense, cloud.is_bigendian), (False, False))
        self.assertEqual(len(cloud.data), 32 * WIDTH * HEIGHT)
        self.assertEqual(
            [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields],
            [(n, o, PointField.FLOAT32, 1) for n, o in (("x", 0), ("y", 4), ("z", 8), ("rgb", 16))],
        )
        points, raw = points_of(cloud)
        bad = np.isnan(points[..., :3])
        self.assertTrue(np.array_equal(bad.any(axis=2), bad.all(axis=2)))
        self.assertTrue(bad[:, :40].all())
        z = points[20:-20, 90:-20, 2]
        self.assertGreater(np.mean(np.abs(z * SHIFT / (FOCAL * BASELINE) - 1) < 0.05), 0.99)
        v, u = np.mgrid[:HEIGHT, :WIDTH]
        good = ~bad[..., 2]
        x, y, z = (points[..., i][good].astype(float) for i in range(3))
        np.testing.assert_allclose(x, (u[good] - CX) * z / FOCAL, rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(y, (v[good] - CY) * z / FOCAL, rtol=1e-4, atol=1e-6)
        grey = cv2.cvtColor(self.scene.left, cv2.COLOR_BGR2GRAY)
        for byte in (16, 17, 18):
            np.testing.assert_array_equal(raw[..., byte], grey)
        self.assertFalse(raw[..., 19].any())

    def test_both_results_agree(self):
        with Results(self.namespace) as results:
            disparity, cloud = self.result(results)
        d = np.frombuffer(disparity.image.data, np.float32).reshape(HEIGHT, WIDTH)
        z = points_of(cloud)[0][..., 2]
        good = np.isfinite(z)
        np.testing.assert_allclose(z[good], FOCAL * BASELINE / d[good], rtol=1e-4)
        self.assertFalse(np.any(d[good] < 0))

    def test_colour_encodings(self):
        for encoding in ("bgr8", "rgb8", "bayer_rggb8", "bayer_grbg8"):
            with self.subTest(encoding), Results(self.namespace, ("points2",)) as results:
                (cloud,) = self.result(results, encoding=encoding)
                points, raw = points_of(cloud)
                self.assertGreater(np.mean(np.isfinite(points[20:-20, 90:-20, 2])), 0.95)
                error = np.abs(raw[2:-2, 2:-2, 16:19].astype(int) - self.scene.left[2:-2, 2:-2])
                self.assertLessEqual(np.median(error), 25 if encoding.startswith("bayer") else 0)

    def test_parameters_change_while_it_runs(self):
        client = Client(f"{self.namespace}/stereo_image_proc", timeout=DEADLINE)
        before = {k: v for k, v in client.get_configuration(timeout=DEADLINE).items() if k != "groups"}
        self.assertEqual(before, DEFAULTS)
        try:
            after = client.update_configuration({"disparity_range": 47, "correlation_window_size": 10})
            self.assertEqual((after["disparity_range"], after["correlation_window_size"]), (32, 11))
            with Results(self.namespace, ("disparity",)) as results:
                (message,) = self.result(results)
            self.assertEqual(message.max_disparity, 31)
            client.update_configuration({**before, "stereo_algorithm": 1})
            with Results(self.namespace, ("disparity",)) as results:
                (message,) = self.result(results)
            inner = np.frombuffer(message.image.data, np.float32).reshape(HEIGHT, WIDTH)[20:-20, 90:-20]
            self.assertGreater(np.mean(np.abs(inner - SHIFT) < 0.5), 0.99)
        finally:
            client.update_configuration(before)

    def test_binning_and_region_of_interest(self):
        def change(_, image, info):
            info.width, info.height = 2 * WIDTH + 40, 2 * HEIGHT + 40
            info.binning_x = info.binning_y = 2
            info.roi = RegionOfInterest(x_offset=16, y_offset=8, width=2 * WIDTH, height=2 * HEIGHT)
            tx = 2 * info.P[3]
            info.K = [2 * FOCAL, 0, 2 * CX + 16, 0, 2 * FOCAL, 2 * CY + 8, 0, 0, 1]
            info.P = [2 * FOCAL, 0, 2 * CX + 16, tx, 0, 2 * FOCAL, 2 * CY + 8, 0, 0, 0, 1, 0]

        with Results(self.namespace) as results:
            disparity, cloud = self.result(results, change=change)
        self.assertAlmostEqual(disparity.f, FOCAL, places=4)
        self.assertAlmostEqual(disparity.T, BASELINE, places=6)
        points = points_of(cloud)[0].astype(float)
        u, v = 200, 60
        x, y, z = points[v, u, :3]
        self.assertAlmostEqual(z, FOCAL * BASELINE / SHIFT, delta=0.05)
        np.testing.assert_allclose([x, y], [(u - CX) * z / FOCAL, (v - CY) * z / FOCAL], rtol=1e-4)


class Approximate(StereoCase):
    namespace = "/approximate"

    def test_pairs_the_nearest_stamps(self):
        with Results(self.namespace) as results:
            disparity, cloud = self.result(results, late=0.004)
        self.assertEqual(disparity.header.stamp, cloud.header.stamp)


class Beyond(StereoCase):
    """Asked of stereo_cloud alone."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.log = []
        listener = rospy.Subscriber("/rosout", Log, cls.log.append)
        wait_for(lambda: listener.get_num_connections() == 3, "log of both nodes and of this one connected")

    def said(self, text):
        node = f"{self.namespace}/stereo_image_proc"
        return [m for m in list(self.log) if m.level == Log.WARN and m.name == node and text in m.msg]

    def test_principal_points_that_differ(self):
        def change(side, _, info):
            if side == "right":
                info.P[2] = CX - 5
                info.K[2] = CX - 5

        with Results(self.namespace) as results:
            disparity, cloud = self.result(results, change=change)
        d = np.frombuffer(disparity.image.data, np.float32).reshape(HEIGHT, WIDTH)[20:-20, 90:-20]
        self.assertAlmostEqual(float(np.median(d)), SHIFT - 5, delta=0.07)
        self.assertEqual(disparity.min_disparity, -5)
        z = points_of(cloud)[0][20:-20, 90:-20, 2]
        self.assertAlmostEqual(float(np.nanmedian(z)), FOCAL * BASELINE / (SHIFT - 5), delta=0.03)

    def test_valid_window(self):
        with Results(self.namespace, ("disparity",)) as results:
            (message,) = self.result(results)
        window = message.valid_window
        self.assertEqual((window.x_offset, window.y_offset), (63 + 7, 7))
        self.assertEqual((window.width, window.height), (WIDTH - 63 - 14, HEIGHT - 14))

    def test_minimum_disparity_is_kept(self):
        client = Client(f"{self.namespace}/stereo_image_proc", timeout=DEADLINE)
        client.update_configuration({"min_disparity": 16})
        try:
            with Results(self.namespace, ("points2",)) as results:
                (cloud,) = self.result(results, shift=16)
        finally:
            client.update_configuration({"min_disparity": 0})
        z = points_of(cloud)[0][20:-20, 90:-20, 2]
        self.assertGreater(np.mean(np.abs(z * 16 / (FOCAL * BASELINE) - 1) < 0.05), 0.99)

    def test_bad_pairs_are_refused_with_one_warning(self):
        def right(part, name, value):
            def change(side, image, info):
                if side == "right":
                    setattr(info if part == "info" else image, name, value)

            return change

        def empty(side, image, _):
            image.width = image.height = image.step = 0
            image.data = b""

        def short(side, image, _):
            image.data = image.data[:-1]

        def smaller(side, image, info):
            if side == "right":
                image.height = info.height = HEIGHT - 2

        def uncalibrated(side, _, info):
            info.P, info.K = [0.0] * 12, [0.0] * 9

        p = [FOCAL, 0, CX, 0, 0, FOCAL, CY, 0, 0, 0, 1, 0]
        for change, warning in (
            (right("info", "width", WIDTH - 1), "camera_info is of an image of"),
            (smaller, "differ in size"),
            (right("image", "encoding", "32FC3"), "encoding '32FC3'"),
            (uncalibrated, "uncalibrated"),
            (right("info", "P", p), "no baseline"),
            (right("info", "D", [0.1, 0.2, 0.3]), "3 distortion coefficients"),
            (empty, "empty"),
            (short, "fewer bytes"),
        ):
            with self.subTest(warning), Results(self.namespace) as results:
                self.result(results)
                self.log.clear()
                stamps = [self.scene.publish(change=change) for _ in range(3)]
                wait_for(lambda w=warning: self.said(w), f"a warning: {warning}")
                self.result(results)  # it recovers, and had the bad pairs before this one
                self.assertEqual(len(self.said(warning)), 1)
                self.assertEqual(
                    [m for got in results.got.values() for m in got if m.header.stamp in stamps], []
                )

    def test_another_encoding_and_size_in_mid_flight(self):
        def half(_, image, info):
            image.height = info.height = HEIGHT // 2
            image.data = image.data[: len(image.data) // 2]

        with Results(self.namespace, ("points2",)) as results:
            for pair in ({}, {"encoding": "rgb8"}, {"encoding": "bgr8", "change": half}, {}):
                (cloud,) = self.result(results, **pair)
                self.assertEqual(cloud.height, HEIGHT // 2 if "change" in pair else HEIGHT)
                self.assertGreater(np.mean(np.isfinite(points_of(cloud)[0][20:-20, 90:-20, 2])), 0.95)

    def test_time_that_jumps_back(self):
        with Results(self.namespace) as results:
            self.result(results)
            for _ in range(6):
                self.scene.publish(infos=False)  # never completed
            self.scene.count -= 500
            self.result(results)

    def test_says_what_is_missing(self):
        for pair, warning in (
            ({"infos": False}, "/stereo/left/camera_info, /stereo/right/camera_info"),
            ({"late": 0.004}, "set approximate_sync"),
        ):
            with self.subTest(warning), Results(self.namespace) as results:
                self.connected()
                self.log.clear()

                def step(pair=pair, warning=warning):
                    self.scene.publish(**pair)
                    time.sleep(0.1)
                    return self.said(warning)

                wait_for(step, f"a warning: {warning}")
                self.assertIsNone(results.of([rospy.Time.from_sec(10000.0 + self.scene.count)]))


def suite():
    cases = [Contract, Approximate]
    if rospy.get_param("~node_package") == "tld_follower":
        cases.append(Beyond)
    return unittest.TestSuite(unittest.defaultTestLoader.loadTestsFromTestCase(case) for case in cases)


if __name__ == "__main__":
    rospy.init_node("stereo_contract")
    rostest.rosrun("tld_follower", "stereo_contract", "__main__.suite")
