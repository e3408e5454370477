# SPDX-License-Identifier: BSD-3-Clause
"""What one update of the tracker costs, by the sizes of image and target, on a film made of noise."""

import math
import time

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.tracker import Tracker, warm_up

RESOLUTIONS = ((320, 240), (640, 480), (1280, 720))
TARGET_WIDTHS = (32, 64, 128)  # pixels; the height is three quarters of it
_MARGIN = 40  # pixels that the background goes on beyond the image, for the camera to pan over


def _texture(width, height, random):
    """Grey noise with structure from 4 to 64 pixels, uint8 of shape (height, width)."""
    total = np.zeros((height, width), np.float32)
    for grain in (4, 8, 16, 32, 64):
        small = random.uniform(-1, 1, (height // grain + 2, width // grain + 2)).astype(np.float32)
        total += cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.clip(128 + 45 * total, 0, 255).astype(np.uint8)


class Film:
    """A target that sways, comes nearer and goes, before a background over which the camera pans.

    Parameters
    ----------
    size : (int, int)
        Width and height of the image, pixels.
    target_width : int
        Pixels, at the start.
    """

    def __init__(self, size, target_width):
        random = np.random.default_rng(0)
        width, height = size
        self._size = size
        self._background = _texture(width + 2 * _MARGIN, height + 2 * _MARGIN, random)
        self._target = _texture(target_width, 3 * target_width // 4, random)
        self._noise = random.normal(0, 1, (height + 64, width + 64)).round().astype(np.int16)
        self._random = random

    def box(self, index):
        """Return the target's true box in the frame of this index."""
        (width, height), phase = self._size, 2 * math.pi * index / 150
        scale = 1 + 0.15 * math.sin(2 * phase)
        target_height, target_width = self._target.shape
        x = 0.5 * width * (1 + 0.3 * math.sin(phase))
        y = 0.5 * height * (1 + 0.2 * math.sin(1.7 * phase))
        return Box(
            x - 0.5 * scale * target_width,
            y - 0.5 * scale * target_height,
            scale * target_width,
            scale * target_height,
        )

    def frame(self, index):
        """Draw the image of this index, uint8 of shape (height, width); each call has its own noise."""
        (width, height), phase = self._size, 2 * math.pi * index / 240
        x, y = round(_MARGIN * (1 + math.sin(phase))), round(_MARGIN * (1 + math.cos(phase)))
        image = self._background[y : y + height, x : x + width].copy()
        box = self.box(index)
        scale = box.width / self._target.shape[1]
        cv2.warpAffine(
            self._target,
            np.array([[scale, 0, box.x], [0, scale, box.y]]),
            self._size,
            dst=image,
            borderMode=cv2.BORDER_TRANSPARENT,
        )
        x, y = self._random.integers(0, 64, 2)
        return np.clip(image + self._noise[y : y + height, x : x + width], 0, 255).astype(np.uint8)


def measure_one(size, target_width, name, frames):
    """Track the target through a film.

    Parameters
    ----------
    size : (int, int)
        Width and height of the image, pixels.
    target_width : int
        Pixels.
    name : str
        tld or tld_sift.
    frames : int

    Returns
    -------
    cpu_ms : float
        Mean CPU time of update(), all threads.
    tracked : float
        Share of the frames in which the box overlaps the true one by more than 0.25. A tracker that has lost
        its target does other work; its figure says little.
    """
    film = Film(size, target_width)
    tracker = Tracker(Parameters.from_dict({"tracker": name}))
    tracker.init(film.frame(0), film.box(0))
    seconds, tracked = 0.0, 0
    for index in range(1, frames + 1):
        image = film.frame(index)
        start = time.process_time()
        box = tracker.update(image).box
        seconds += time.process_time() - start
        tracked += box is not None and box.overlap(film.box(index)) > 0.25
    return 1e3 * seconds / frames, tracked / frames


def measure(name, frames, tell):
    """Measure every resolution and target size; returns the list for the JSON."""
    cv2.setNumThreads(1)
    warm_up()
    measure_one(RESOLUTIONS[0], TARGET_WIDTHS[0], name, 5)  # what runs for the first time is slow
    results = []
    for size in RESOLUTIONS:
        for target_width in TARGET_WIDTHS:
            resolution = f"{size[0]}x{size[1]}"
            tell(f"tracker, {resolution}, target {target_width} pixels wide")
            cpu_ms, tracked = measure_one(size, target_width, name, frames)
            results.append(
                {
                    "tracker": name,
                    "resolution": resolution,
                    "target_px": target_width,
                    "cpu_ms": cpu_ms,
                    "tracked_fraction": tracked,
                }
            )
    return results
