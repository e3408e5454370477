# SPDX-License-Identifier: BSD-3-Clause
"""The scanning windows: sizes, octaves and shifts (thesis section 3.1.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tld_follower.box import Box
from tld_follower.tld.ferns import pixel_offsets
from tld_follower.tld.parameters import Parameters


@dataclass(frozen=True)
class WindowSize:
    """Windows of one size.

    Attributes
    ----------
    width, height : size in the image [pixel].
    octave : the level that they are scanned on; one pixel of it is `factor` pixels of the image.
    grid : (width, height, step x, step y) [pixel of the level]; step x is whole, as `scan_windows` wants it.
    offsets : (ferns, comparisons, 4) int32, the fern comparisons in such a window.
    """

    width: float
    height: float
    octave: int
    factor: int
    grid: tuple[float, float, float, float]
    offsets: np.ndarray

    def boxes(self, corners: np.ndarray) -> np.ndarray:
        """Return (N, 4) float64 boxes in the image for corners (N, 2) in the level."""
        boxes = np.empty((len(corners), 4))
        boxes[:, :2] = corners * self.factor
        boxes[:, 2:] = self.width, self.height
        return boxes

    def count(self, image_width: int, image_height: int) -> int:
        """Return the number of windows in an image of this size [pixel]."""
        width, height, step_x, step_y = self.grid
        across = (image_width // self.factor - width) / step_x
        down = (image_height // self.factor - height) / step_y
        return (int(across) + 1) * (int(down) + 1) if across >= 0 and down >= 0 else 0


def window_sizes(box: Box, comparisons: np.ndarray, parameters: Parameters) -> list[WindowSize]:
    """Return the window sizes about that of the initial box, smallest first.

    They differ by `scale_step`, `scales` of them to either side; those with a side under `min_side` are left
    out. Each is scanned on the octave where its side (root of the area) is `window_side` to twice that, so
    that the blur is in proportion and large windows cost no more than small ones. Sideways they step by the
    whole number of pixels nearest to the shift: with more windows than it asks for, detections are too dense,
    which makes for more false ones.
    """
    sizes = []
    for exponent in range(-parameters.scales, parameters.scales + 1):
        scale = parameters.scale_step**exponent
        width, height = box.width * scale, box.height * scale
        if exponent != 0 and min(width, height) < parameters.min_side:
            continue
        octave = max(0, int(np.floor(np.log2(np.sqrt(width * height) / parameters.window_side))))
        factor = 1 << octave
        level_w, level_h = max(width / factor, 2.0), max(height / factor, 2.0)
        steps = float(max(round(parameters.shift * level_w), 1)), max(parameters.shift * level_h, 1.0)
        grid = (level_w, level_h, *steps)
        offsets = pixel_offsets(comparisons, round(level_w), round(level_h))
        sizes.append(WindowSize(width, height, octave, factor, grid, offsets))
    return sizes
