#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a user of stereo_image_proc relies on, asked of the node that the launch file started.

`Contract` and `Approximate` hold for Debian's stereo_image_proc and for stereo_cloud, as node and as nodelet;
`Beyond` is asked of stereo_cloud alone: it is where stereo_image_proc is wrong or silent.
"""

import unittest

import cv2
import numpy as np
import rospy
import rostest
from dynamic_reconfigure.client import Client
from sensor_msgs.msg import PointField, RegionOfInterest
from stereo_beyond import Beyond
from stereo_scene import (
    BASELINE,
    CX,
    CY,
    DEADLINE,
    FOCAL,
    FRAME,
    HEIGHT,
    IMAGES,
    SHIFT,
    WIDTH,
    Results,
    StereoCase,
    pixels_of,
    points_of,
    wait_for,
)

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
        for encoding in ("bgr8", "rgb8", *(f"bayer_{p}8" for p in ("rggb", "bggr", "gbrg", "grbg"))):
            with self.subTest(encoding), Results(self.namespace, ("points2",)) as results:
                (cloud,) = self.result(results, encoding=encoding)
                points, raw = points_of(cloud)
                self.assertGreater(np.mean(np.isfinite(points[20:-20, 90:-20, 2])), 0.95)
                error = np.abs(raw[2:-2, 2:-2, 16:19].astype(int) - self.scene.left[2:-2, 2:-2])
                self.assertLessEqual(np.median(error), 25 if encoding.startswith("bayer") else 0)

    def test_sixteen_bit_images_are_matched(self):
        with Results(self.namespace, ("disparity",)) as results:
            (message,) = self.result(results, encoding="mono16")
        inner = np.frombuffer(message.image.data, np.float32).reshape(HEIGHT, WIDTH)[20:-20, 90:-20]
        self.assertGreater(np.mean(np.abs(inner - SHIFT) < 0.5), 0.99)

    def test_images(self):
        grey = cv2.cvtColor(self.scene.left, cv2.COLOR_BGR2GRAY)[..., None]
        for encoding, colour_as in (("mono8", "mono8"), ("rgb8", "rgb8"), ("bayer_gbrg8", "bgr8")):
            with self.subTest(encoding), Results(self.namespace, [f"left/{i}" for i in IMAGES]) as results:
                mono, colour, rect, rect_colour = self.result(results, encoding=encoding)
                found = [message.encoding for message in (mono, colour, rect, rect_colour)]
                self.assertEqual(found, ["mono8", colour_as, "mono8", colour_as])
                wanted = {"mono8": grey, "rgb8": self.scene.left[..., ::-1], "bgr8": self.scene.left}
                bound = 25 if encoding.startswith("bayer") else 1
                for message, pixels in ((mono, grey), (colour, wanted[colour_as])):
                    error = np.abs(pixels_of(message)[2:-2, 2:-2].astype(int) - pixels[2:-2, 2:-2])
                    self.assertLessEqual(np.median(error), bound)
                # This camera is rectified.
                self.assertEqual(mono.data, rect.data)
                self.assertEqual(colour.data, rect_colour.data)

    def test_images_of_the_right_camera(self):
        with Results(self.namespace, ("right/image_rect",)) as results:
            (message,) = self.result(results)
        self.assertEqual(message.header.frame_id, FRAME)
        wanted = cv2.cvtColor(np.roll(self.scene.left, -SHIFT, axis=1), cv2.COLOR_BGR2GRAY)
        np.testing.assert_array_equal(pixels_of(message)[..., 0], wanted)

    def test_distortion_is_taken_out(self):
        lens = np.array([-0.3, 0.1, 0.002, -0.001, 0.0])

        def change(_, __, info):
            info.D = lens.tolist()

        with Results(self.namespace, ("left/image_rect", "disparity")) as results:
            image, disparity = self.result(results, change=change)
        k = np.array([[FOCAL, 0, CX], [0, FOCAL, CY], [0, 0, 1]])
        wanted = cv2.undistort(cv2.cvtColor(self.scene.left, cv2.COLOR_BGR2GRAY), k, lens)
        error = np.abs(pixels_of(image)[4:-4, 4:-4, 0].astype(int) - wanted[4:-4, 4:-4])
        self.assertLess(np.mean(error > 4), 0.01)
        # Both images bend alike: in the middle, where the lens does least, the wall stays where it was.
        d = np.frombuffer(disparity.image.data, np.float32).reshape(HEIGHT, WIDTH)[100:140, 140:180]
        self.assertAlmostEqual(float(np.median(d[d >= 0])), SHIFT, delta=0.5)

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


def suite():
    cases = [Contract, Approximate]
    if rospy.get_param("~beyond"):
        cases.append(Beyond)
    return unittest.TestSuite(unittest.defaultTestLoader.loadTestsFromTestCase(case) for case in cases)


if __name__ == "__main__":
    rospy.init_node("stereo_contract")
    rostest.rosrun("tld_follower", "stereo_contract", "__main__.suite")
