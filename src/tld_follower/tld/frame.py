# SPDX-License-Identifier: BSD-3-Clause
"""One grey image as an octave pyramid with integral images, and the patches read from it."""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

PATCH_SIDE = 15
PATCH_SIZE = PATCH_SIDE * PATCH_SIDE

FloatArray = NDArray[np.float32]


def to_gray(image: np.ndarray) -> NDArray[np.uint8]:
    """Return a contiguous grey copy of an image.

    Parameters
    ----------
    image : uint8 or uint16 array, (H, W) grey or (H, W, 3) BGR, any strides; of 16 bits the upper 8 count.

    Raises
    ------
    ValueError
        If the image is empty or of another type or shape.
    """
    if not isinstance(image, np.ndarray) or image.dtype not in (np.uint8, np.uint16):
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        raise ValueError(f"the image must be an array of uint8 or uint16, got {kind}")
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise ValueError(f"the image must be HxW grey or HxWx3 BGR, got shape {image.shape}")
    if image.size == 0:
        raise ValueError(f"the image is empty, shape {image.shape}")
    if image.dtype == np.uint16:
        image = (image >> 8).astype(np.uint8)
    if image.ndim == 2:
        return np.array(image, order="C")
    return cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_BGR2GRAY)


class Level:
    """One octave: the grey image, its blurred copy and its integral images, each made when first used."""

    def __init__(self, gray: NDArray[np.uint8], blur: float) -> None:
        self.gray = gray
        self._blur = blur

    @cached_property
    def blurred(self) -> NDArray[np.uint8]:
        """The blurred copy (H, W): to a grey level cv2.GaussianBlur's, in less than half the time."""
        kernel = cv2.getGaussianKernel(2 * round(3.0 * self._blur) + 1, self._blur)
        return cv2.sepFilter2D(self.gray, -1, kernel, kernel)

    @cached_property
    def integrals(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Integral images of the values and of their squares, (H + 1, W + 1) each."""
        return cv2.integral2(self.gray, sdepth=cv2.CV_32S, sqdepth=cv2.CV_64F)


class Frame:
    """A grey image and its octaves; level k has 1 / 2^k of the size, by exact 2x2 means.

    Parameters
    ----------
    image : uint8 or uint16, (H, W) or (H, W, 3) BGR; see `to_gray`.
    blur : standard deviation of the blurred copies [pixel of the level].
    """

    def __init__(self, image: np.ndarray, blur: float) -> None:
        self.gray = to_gray(image)
        self._blur = blur
        self._levels = [Level(self.gray, blur)]

    @property
    def width(self) -> int:
        """Width [pixel]."""
        return self.gray.shape[1]

    @property
    def height(self) -> int:
        """Height [pixel]."""
        return self.gray.shape[0]

    def level(self, index: int) -> Level:
        """Return octave `index`, or the coarsest that still has pixels."""
        while len(self._levels) <= index:
            gray = self._levels[-1].gray
            height, width = gray.shape[0] // 2 * 2, gray.shape[1] // 2 * 2
            if min(height, width) < 4:
                break
            half = cv2.resize(gray[:height, :width], (width // 2, height // 2), interpolation=cv2.INTER_AREA)
            self._levels.append(Level(half, self._blur))
        return self._levels[min(index, len(self._levels) - 1)]

    def patches(self, boxes: np.ndarray) -> FloatArray:
        """Sample one normalised 15x15 patch a box; see `sample_patches`.

        Parameters
        ----------
        boxes : (N, 4) float, x, y, width, height in pixels.

        Returns
        -------
        (N, 225) float32
        """
        return sample_patches(self.level(0).integrals[0], np.ascontiguousarray(boxes, np.float64))

    def variance(self, box: np.ndarray) -> float:
        """Variance of the grey values inside a box (x, y, width, height), clipped and rounded to pixels.

        It is the mean of squares less the square of the mean; thesis eq. 3.4 has the sign the other way.
        """
        x0, x1 = (min(max(round(v), 0), self.width) for v in (box[0], box[0] + box[2]))
        y0, y1 = (min(max(round(v), 0), self.height) for v in (box[1], box[1] + box[3]))
        if x1 <= x0 or y1 <= y0:
            return 0.0
        return float(self.gray[y0:y1, x0:x1].astype(np.float64).var())


@njit(cache=True)
def _interpolate(integral, y, x):
    """Read an integral image at a fractional corner inside it."""
    row = min(int(y), integral.shape[0] - 2)
    col = min(int(x), integral.shape[1] - 2)
    fy = y - row
    fx = x - col
    top = integral[row, col] * (1.0 - fx) + integral[row, col + 1] * fx
    bottom = integral[row + 1, col] * (1.0 - fx) + integral[row + 1, col + 1] * fx
    return top * (1.0 - fy) + bottom * fy


@njit(cache=True)
def sample_patches(integral, boxes):
    """Sample 15x15 patches as exact area means, each less its mean and scaled to unit norm.

    Cells outside the image repeat the nearest cell inside; a patch without contrast, or wholly outside, is 0.

    Parameters
    ----------
    integral : (H + 1, W + 1) int32
    boxes : (N, 4) float64, x, y, width, height in pixels.

    Returns
    -------
    (N, 225) float32; the dot product of two rows is their NCC (thesis eq. 3.3).
    """
    count = boxes.shape[0]
    height = integral.shape[0] - 1
    width = integral.shape[1] - 1
    patches = np.zeros((count, PATCH_SIZE), np.float32)
    xs = np.empty(PATCH_SIDE + 1)
    ys = np.empty(PATCH_SIDE + 1)
    corners = np.empty((PATCH_SIDE + 1, PATCH_SIDE + 1))
    values = np.empty((PATCH_SIDE, PATCH_SIDE))
    for n in range(count):
        for i in range(PATCH_SIDE + 1):
            xs[i] = min(max(boxes[n, 0] + boxes[n, 2] * i / PATCH_SIDE, 0.0), width)
            ys[i] = min(max(boxes[n, 1] + boxes[n, 3] * i / PATCH_SIDE, 0.0), height)
        first_col, last_col, first_row, last_row = PATCH_SIDE, -1, PATCH_SIDE, -1
        for i in range(PATCH_SIDE):
            if xs[i + 1] - xs[i] > 1e-3:
                first_col = min(first_col, i)
                last_col = i
            if ys[i + 1] - ys[i] > 1e-3:
                first_row = min(first_row, i)
                last_row = i
        if last_col < 0 or last_row < 0:
            continue
        for i in range(PATCH_SIDE + 1):
            for j in range(PATCH_SIDE + 1):
                corners[i, j] = _interpolate(integral, ys[i], xs[j])
        mean = 0.0
        for i in range(PATCH_SIDE):
            row = min(max(i, first_row), last_row)
            for j in range(PATCH_SIDE):
                col = min(max(j, first_col), last_col)
                area = (xs[col + 1] - xs[col]) * (ys[row + 1] - ys[row])
                total = (
                    corners[row + 1, col + 1]
                    - corners[row, col + 1]
                    - corners[row + 1, col]
                    + corners[row, col]
                )
                values[i, j] = total / area
                mean += values[i, j]
        mean /= PATCH_SIZE
        square = 0.0
        for i in range(PATCH_SIDE):
            for j in range(PATCH_SIDE):
                values[i, j] -= mean
                square += values[i, j] * values[i, j]
        if square < 1e-3 * PATCH_SIZE:
            continue
        scale = 1.0 / np.sqrt(square)
        for i in range(PATCH_SIDE):
            for j in range(PATCH_SIDE):
                patches[n, i * PATCH_SIDE + j] = values[i, j] * scale
    return patches
