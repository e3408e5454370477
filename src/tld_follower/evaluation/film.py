# SPDX-License-Identifier: BSD-3-Clause
"""Films a flight: left images and the target's true boxes, as a sequence that `evaluate` reads."""

import cv2

from tld_follower.evaluation import sequences
from tld_follower.nodes.conversions import image_array, message_box


def picture(message):
    """Return a sensor_msgs/Image in rgb8 or bgr8 as an array of its own, uint8 (H, W, 3) BGR."""
    pixels = image_array(message)
    return cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR) if message.encoding == "rgb8" else pixels.copy()


class Film:
    """A sequence folder that a flight fills, from the frame on in which the target was boxed."""

    def __init__(self, folder):
        self._writer = sequences.Writer(folder)

    def add(self, frame, _):
        """Add one frame of a flight; `frame` holds its image and truth messages."""
        self._writer.add(picture(frame["image"]), message_box(frame["truth"].target_box))

    def close(self):
        """Finish the sequence."""
        self._writer.close()
