# SPDX-License-Identifier: BSD-3-Clause
"""The axis-aligned box that the tracker, the follower and the scoring share."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Box:
    """An axis-aligned box in image coordinates.

    Attributes
    ----------
    x, y : float
        Top-left corner [pixel]; the centre of the image's first pixel is at (0.5, 0.5).
    width, height : float
        Size [pixel].
    """

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """The right edge, x [pixel]."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """The lower edge, y [pixel]."""
        return self.y + self.height

    @property
    def center(self) -> tuple[float, float]:
        """The centre, x and y [pixel]."""
        return self.x + 0.5 * self.width, self.y + 0.5 * self.height

    @property
    def area(self) -> float:
        """Area [pixel^2]."""
        return self.width * self.height

    @property
    def finite(self) -> bool:
        """True if every coordinate is a finite number."""
        return all(math.isfinite(v) for v in (self.x, self.y, self.width, self.height))

    def as_tuple(self) -> tuple[float, float, float, float]:
        """Return x, y, width, height."""
        return self.x, self.y, self.width, self.height

    def intersection(self, other: Box) -> float:
        """Area [pixel^2] that both boxes cover."""
        width = min(self.right, other.right) - max(self.x, other.x)
        height = min(self.bottom, other.bottom) - max(self.y, other.y)
        return width * height if width > 0.0 and height > 0.0 else 0.0

    def overlap(self, other: Box) -> float:
        """Intersection over union, 0..1; 0 where both boxes are empty."""
        intersection = self.intersection(other)
        union = self.area + other.area - intersection
        return intersection / union if union > 0.0 else 0.0

    def clip(self, width: float, height: float) -> Box:
        """Return the part inside an image of `width` x `height` pixels; its size is 0 if there is none."""
        left, right = (min(max(v, 0.0), float(width)) for v in (self.x, self.right))
        top, bottom = (min(max(v, 0.0), float(height)) for v in (self.y, self.bottom))
        return Box(left, top, right - left, bottom - top)

    def inside_fraction(self, width: float, height: float) -> float:
        """Share of the box's area that lies inside an image of `width` x `height` pixels, 0..1."""
        return self.clip(width, height).area / self.area if self.area > 0.0 else 0.0

    def scale(self, factor: float) -> Box:
        """Return the box scaled by `factor` about its centre."""
        x, y = self.center
        return Box.from_center(x, y, self.width * factor, self.height * factor)

    @classmethod
    def from_center(cls, x: float, y: float, width: float, height: float) -> Box:
        """Build from the centre and the size [pixel]."""
        return cls(x - 0.5 * width, y - 0.5 * height, width, height)
