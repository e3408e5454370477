import cv2
import numpy as np
import pytest
from sensor_msgs.msg import Image, PointCloud2, PointField

from tld_follower.box import Box
from tld_follower.msg import BoundingBox
from tld_follower.nodes import conversions


def image(pixels, encoding, padding=0):
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels).reshape(height, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)))
    return Image(height=height, width=width, encoding=encoding, step=rows.shape[1], data=rows.tobytes())


@pytest.fixture
def colour():
    return np.random.default_rng(0).integers(0, 256, (12, 17, 3), dtype=np.uint8)


@pytest.mark.parametrize("padding", [0, 5])
def test_grey_of_every_colour_order(colour, padding):
    grey = cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY)
    alpha = np.dstack([colour, np.zeros_like(grey)])
    for pixels, encoding in (
        (grey, "mono8"),
        (colour, "bgr8"),
        (colour[..., ::-1], "rgb8"),
        (alpha, "bgra8"),
        (alpha[..., [2, 1, 0, 3]], "rgba8"),
    ):
        assert np.array_equal(conversions.grey_image(image(pixels, encoding, padding)), grey), encoding


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
def test_bayer_patterns(pattern):
    flat = {"r": 200, "g": 100, "b": 20}  # one colour everywhere, as the sensor's mosaic sees it
    mosaic = np.zeros((12, 16), np.uint8)
    for i, name in enumerate(pattern):
        mosaic[i // 2 :: 2, i % 2 :: 2] = flat[name]
    grey = conversions.grey_image(image(mosaic, f"bayer_{pattern}8"))
    expected = 0.299 * 200 + 0.587 * 100 + 0.114 * 20
    assert np.abs(grey[2:-2, 2:-2] - expected).max() <= 1


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"encoding": "32FC1"}, "encoding"),
        ({"height": 0}, "empty"),
        ({"data": b"12"}, "holds 2 bytes"),
        ({"step": 3}, "step 3"),
    ],
)
def test_malformed_images_are_refused(colour, changes, reason):
    message = image(colour, "bgr8")
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(ValueError, match=reason):
        conversions.image_array(message)


def cloud(points, step=32):
    height, width = points.shape[:2]
    data = np.zeros((height, width, step // 4), np.float32)
    data[..., :3] = points
    fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate("xyz")]
    return PointCloud2(
        height=height, width=width, fields=fields, point_step=step, row_step=step * width, data=data.tobytes()
    )


@pytest.mark.parametrize("step", [12, 16, 32])
def test_points_of_a_cloud(step):
    points = np.random.default_rng(1).normal(size=(5, 7, 3)).astype(np.float32)
    points[2, 3] = np.nan
    assert np.array_equal(conversions.cloud_points(cloud(points, step)), points, equal_nan=True)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"fields": []}, "fields"),
        ({"width": 0}, "empty"),
        ({"data": b""}, "holds 0 bytes"),
        ({"is_bigendian": True}, "layout"),
        ({"point_step": 30}, "layout"),
        ({"row_step": 1}, "layout"),
    ],
)
def test_malformed_clouds_are_refused(changes, reason):
    message = cloud(np.zeros((5, 7, 3)))
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(ValueError, match=reason):
        conversions.cloud_points(message)


def test_boxes_there_and_back():
    box = Box(1.5, 2.5, 30, 40)
    message = conversions.box_message(box, 0.75, None, target=3)
    assert (message.visible, message.confidence, message.target) == (True, 0.75, 3)
    assert conversions.message_box(message) == box
    assert conversions.message_box(conversions.box_message(None, 0.9, None, 3)) is None


@pytest.mark.parametrize("values", [(np.nan, 0, 1, 1), (0, np.inf, 1, 1), (0, 0, 0, 5), (0, 0, 5, -1)])
def test_what_is_not_a_box_is_refused(values):
    with pytest.raises(ValueError, match="not a box"):
        conversions.message_box(BoundingBox(*values, 1.0, True, None, 1))
