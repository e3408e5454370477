"""Between ROS messages and arrays; every malformed message raises ValueError with what is wrong."""

import math

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.msg import BoundingBox

# encoding -> channels, and how to get grey from it (None: it is grey already)
_ENCODINGS = {
    "mono8": (1, None),
    "8UC1": (1, None),
    "rgb8": (3, cv2.COLOR_RGB2GRAY),
    "bgr8": (3, cv2.COLOR_BGR2GRAY),
    "8UC3": (3, cv2.COLOR_BGR2GRAY),
    "rgba8": (4, cv2.COLOR_RGBA2GRAY),
    "bgra8": (4, cv2.COLOR_BGRA2GRAY),
    # OpenCV names a Bayer pattern by its second row and column, ROS by its first.
    "bayer_rggb8": (1, cv2.COLOR_BayerBG2GRAY),
    "bayer_bggr8": (1, cv2.COLOR_BayerRG2GRAY),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGR2GRAY),
    "bayer_grbg8": (1, cv2.COLOR_BayerGB2GRAY),
}


def image_array(message):
    """View a sensor_msgs/Image as a read-only uint8 array of shape (height, width[, channels])."""
    if message.encoding not in _ENCODINGS:
        raise ValueError(
            f"image encoding {message.encoding!r} is not supported; supported: {', '.join(_ENCODINGS)}"
        )
    channels = _ENCODINGS[message.encoding][0]
    height, width, step = message.height, message.width, message.step
    if not height or not width:
        raise ValueError(f"empty image of {width}x{height} pixels")
    if step < width * channels or len(message.data) < height * step:
        raise ValueError(
            f"image of {width}x{height} {message.encoding} with step {step} holds {len(message.data)} bytes"
        )
    rows = np.frombuffer(message.data, np.uint8, height * step).reshape(height, step)
    pixels = rows[:, : width * channels]
    return pixels if channels == 1 else pixels.reshape(height, width, channels)


def grey_image(message):
    """Return a sensor_msgs/Image as a uint8 array of shape (height, width)."""
    pixels = image_array(message)
    conversion = _ENCODINGS[message.encoding][1]
    return pixels if conversion is None else cv2.cvtColor(pixels, conversion)


def cloud_points(message):
    """View an organised sensor_msgs/PointCloud2 as float32 points, shape (height, width, 3), in metres.

    Needs x, y, z as little-endian FLOAT32 that follow each other, as stereo_image_proc publishes them.
    """
    offsets = {field.name: field.offset for field in message.fields if field.datatype == field.FLOAT32}
    x = offsets.get("x")
    if x is None or offsets.get("y") != x + 4 or offsets.get("z") != x + 8:
        raise ValueError("point cloud without consecutive float32 fields x, y, z")
    height, width, step = message.height, message.width, message.point_step
    if not height or not width:
        raise ValueError("empty point cloud")
    if message.is_bigendian or step % 4 or x % 4 or message.row_step != width * step or step < x + 12:
        raise ValueError(
            f"point cloud layout is not supported: point_step {step}, row_step {message.row_step}"
        )
    if len(message.data) < height * message.row_step:
        raise ValueError(f"point cloud of {width}x{height} holds {len(message.data)} bytes")
    values = np.frombuffer(message.data, np.float32, height * width * step // 4)
    return values.reshape(height, width, step // 4)[:, :, x // 4 : x // 4 + 3]


def box_message(box, confidence, captured, target):
    """Make a BoundingBox; `box` is None while the target is not visible."""
    message = BoundingBox(captured=captured, target=target)
    if box is not None:
        message.x, message.y, message.width, message.height = box.x, box.y, box.width, box.height
        message.confidence = confidence
        message.visible = True
    return message


def message_box(message):
    """Return the Box of a BoundingBox message, or None if it is not visible."""
    if not message.visible:
        return None
    values = (message.x, message.y, message.width, message.height)
    if not all(map(math.isfinite, values)) or message.width <= 0 or message.height <= 0:
        raise ValueError(f"box {values} is not a box")
    return Box(*values)
