# SPDX-License-Identifier: BSD-3-Clause
"""A textured target that moves over a textured background."""

import cv2
import numpy as np

from tld_follower.box import Box


def texture(height, width, seed, grain=2.0):
    noise = np.random.default_rng(seed).integers(0, 256, (height, width), np.uint8)
    smooth = cv2.GaussianBlur(noise, (0, 0), grain).astype(np.float32)
    low, high = smooth.min(), smooth.max()
    return ((smooth - low) * (255.0 / (high - low))).astype(np.uint8)


class Scene:
    """Frames with the target drawn at a sub-pixel place, or without it."""

    def __init__(self, width=160, height=120, target=(32, 28), seed=0):
        self.background = (texture(height, width, seed, 3.0) // 2 + 40).astype(np.uint8)
        self.patch = texture(target[1], target[0], seed + 1, 2.0)

    def frame(self, box):
        """The scene with the target filling `box`, or nothing of it where `box` is None."""
        image = self.background.copy()
        if box is not None:
            height, width = self.patch.shape
            sx, sy = box.width / width, box.height / height
            matrix = np.array([[sx, 0, box.x + 0.5 * sx - 0.5], [0, sy, box.y + 0.5 * sy - 0.5]])
            size = image.shape[::-1]
            cv2.warpAffine(self.patch, matrix, size, dst=image, borderMode=cv2.BORDER_TRANSPARENT)
        return image


def moving_box(step, start=(40.0, 40.0), size=(32.0, 28.0), speed=(1.5, 0.8)):
    return Box(start[0] + speed[0] * step, start[1] + speed[1] * step, *size)
