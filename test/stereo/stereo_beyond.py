# SPDX-License-Identifier: BSD-3-Clause
"""What is asked of stereo_cloud alone: where stereo_image_proc is wrong or silent, and points2_filtered."""

import time

import numpy as np
import rosgraph
import rospy
from dynamic_reconfigure.client import Client
from rosgraph_msgs.msg import Log
from stereo_scene import (
    BASELINE,
    CX,
    CY,
    DEADLINE,
    FOCAL,
    FRAME,
    HEIGHT,
    SHIFT,
    WIDTH,
    Results,
    StereoCase,
    points_of,
    wait_for,
)


class Beyond(StereoCase):
    """Asked of stereo_cloud alone."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.log = []
        listener = rospy.Subscriber("/rosout", Log, cls.log.append)
        speakers = rosgraph.Master(rospy.get_name()).getSystemState()[0]
        count = len(next(nodes for topic, nodes in speakers if topic == "/rosout"))
        wait_for(lambda: listener.get_num_connections() >= count, "every node's log connected")

    def said(self, text):
        speaker = rospy.get_param("~speaker")
        return [m for m in list(self.log) if m.level == Log.WARN and m.name == speaker and text in m.msg]

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

    def test_filtered_cloud(self):
        client = Client(f"{self.namespace}/stereo_image_proc/filter", timeout=DEADLINE)
        z = FOCAL * BASELINE / SHIFT
        try:
            client.update_configuration({"voxel_size": 0.05, "outlier_removal": 1, "crop_max_x": 0.3})
            with Results(self.namespace, ("points2_filtered",)) as results:
                (cloud,) = self.result(results)
            self.assertEqual(cloud.header.frame_id, FRAME)
            self.assertEqual((cloud.height, cloud.point_step, cloud.is_dense), (1, 32, True))
            points = points_of(cloud)[0][0]
            self.assertEqual(len(points), cloud.width)
            np.testing.assert_allclose(points[:, 2], z, rtol=0.05)
            self.assertLessEqual(points[:, 0].max(), 0.3)
            # Of 1.3 m x 1 m of wall, less what is cropped and never matched: about 20 x 20 voxels.
            self.assertTrue(200 < len(points) < 1200, len(points))
            client.update_configuration({"crop_max_x": -20.0})
            self.log.clear()
            with Results(self.namespace, ("points2_filtered", "points2")) as results:
                self.connected()

                def step():
                    self.scene.publish()
                    time.sleep(0.1)
                    return self.said("no filtered cloud: the crop box is empty")

                wait_for(step, "a warning of the empty box")
                wait_for(lambda: results.got["points2"], "the cloud itself")
                self.assertEqual(results.got["points2_filtered"], [])
        finally:
            client.update_configuration({"crop_max_x": 10.0})

    def test_images_alone_need_no_stereo_calibration(self):
        def change(_, __, info):
            info.P, info.K = [0.0] * 12, [0.0] * 9

        with Results(self.namespace, ("left/image_mono", "right/image_mono")) as results:
            left, _ = self.result(results, change=change)
        self.assertEqual(left.encoding, "mono8")

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
