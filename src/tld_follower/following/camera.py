"""The left camera: its rays, and where it sits on the drone."""

import math
from dataclasses import dataclass, field

import numpy as np

# From the optical frame (x right, y down, z ahead) to a level body frame (x ahead, y left, z up).
_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True)
class Camera:
    """A rectified pinhole camera with square pixels and its principal point in the image's middle."""

    width: int
    height: int
    hfov: float
    pitch: float
    position: tuple[float, float, float]
    focal_length: float = field(init=False)
    to_body: np.ndarray = field(init=False, repr=False)

    def __post_init__(self):
        object.__setattr__(self, "focal_length", self.width / 2 / math.tan(self.hfov / 2))
        c, s = math.cos(self.pitch), math.sin(self.pitch)
        nod = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        object.__setattr__(self, "to_body", nod @ _OPTICAL)

    @classmethod
    def of(cls, parameters):
        """Make the camera that the follower's parameters describe."""
        p = parameters
        return cls(
            p.image_width, p.image_height, p.hfov, p.camera_pitch, (p.camera_x, p.camera_y, p.camera_z)
        )

    def ray(self, u, v):
        """Return the unit vector of a pixel's ray in the body frame."""
        ray = np.array(
            [(u - self.width / 2) / self.focal_length, (v - self.height / 2) / self.focal_length, 1.0]
        )
        return self.to_body @ (ray / np.linalg.norm(ray))

    def centre(self, motion):
        """Where the camera is in the odom frame, given the drone's `Motion`."""
        return motion.position + motion.attitude @ np.array(self.position)
