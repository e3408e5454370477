"""Synthetic scenes: a textured target that moves over a textured background."""

import cv2
import numpy as np

from tld_follower.box import Box

TARGET = (34, 40)


def texture(height, width, seed, grain=2.0):
    """Smooth noise of full contrast, (height, width) uint8."""
    noise = np.random.default_rng(seed).standard_normal((height, width)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), grain)
    return np.clip(128.0 + 50.0 * (smooth - smooth.mean()) / smooth.std(), 0, 255).astype(np.uint8)


def scene(position, size=(120, 160), seed=0, background=True):
    """A background with the target's top-left corner at `position` (x, y), or without it for None."""
    height, width = size
    # The background is softer than the target, as it is behind a focused camera.
    image = texture(height, width, 1000 + seed, 4.0) // 2 + 40 if background else np.full(size, 90, np.uint8)
    if position is not None:
        paste(image, texture(*TARGET, seed), position)
    return image


def paste(image, patch, position):
    """Draw a patch with its top-left corner at (x, y), cut at the image's edges."""
    x, y = position
    height, width = patch.shape
    x0, y0 = max(x, 0), max(y, 0)
    x1, y1 = min(x + width, image.shape[1]), min(y + height, image.shape[0])
    if x0 < x1 and y0 < y1:
        image[y0:y1, x0:x1] = patch[y0 - y : y1 - y, x0 - x : x1 - x]


def target_box(position):
    """The target's box for its corner (x, y)."""
    return Box(float(position[0]), float(position[1]), float(TARGET[1]), float(TARGET[0]))


def moved(image, dx, dy, scale=1.0):
    """The image shifted, and scaled about its centre."""
    height, width = image.shape
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, scale)
    matrix[:, 2] += dx, dy
    return cv2.warpAffine(image, matrix, (width, height), borderMode=cv2.BORDER_REFLECT)
