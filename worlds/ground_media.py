# SPDX-License-Identifier: BSD-3-Clause
"""Ground, its large-scale light map, and the sky."""

import cv2
import numpy as np
import paint


def gravel(size=1024):
    """Trodden earth with gravel; one repeat is 3 m, seamless. Mean about mid grey."""
    rng = np.random.default_rng(11)
    image = paint.flat(size, size, (98, 118, 134))
    noise = {256: 0.07, 90: 0.08, 34: 0.09, 12: 0.12, 5: 0.14, 2.5: 0.12}
    paint.tint(image, paint.fractal(rng, size, size, noise))
    paint.spots(rng, image, 500, (2, 22), (52, 66, 80), (0.15, 0.55))
    paint.spots(rng, image, 300, (2, 18), (150, 166, 176), (0.15, 0.5))
    paint.pebbles(rng, image, 2600, (1.0, 9.0))
    paint.cracks(rng, image, 14, 60, (36, 44, 52), 0.6)
    return image


def light_map(size=1024, extent=120.0):
    """Patches, grass, puddles and tracks over the whole ground; 0.5 is neutral.

    `extent` is the edge of the ground [m]. The image's x is the world's x, its top the largest y.
    """
    rng = np.random.default_rng(12)
    image = np.full((size, size, 3), 0.5, np.float32)
    paint.tint(
        image, paint.fractal(rng, size, size, {300: 0.06, 120: 0.09, 50: 0.1, 20: 0.09, 8: 0.08, 3: 0.05})
    )
    grass = paint.fractal(rng, size, size, {160: 0.6, 60: 0.5, 22: 0.35, 8: 0.3})
    row = (np.arange(size, dtype=np.float32) - size / 2) * extent / size
    away = np.clip((np.abs(row) - 3.2) / 3, -1, 1)[:, None]  # The lane along y = 0 is trodden bare.
    paint.blend(image, (66, 116, 92), 0.75 * np.clip(grass + 1.1 * away - 0.5, 0, 1))
    scale = size / extent
    for y in (-0.9, -0.32, 0.36, 0.98, 1.7):  # Tyre tracks along the lane.
        points = [(x, size / 2 - scale * (y + 0.25 * np.sin(0.013 * x + 9 * y))) for x in range(0, size, 6)]
        cv2.polylines(image, [np.int32(points)], False, (0.4, 0.4, 0.41), 2, cv2.LINE_AA)
    return image


def sky(width=2048, height=512):
    """Panorama from 0.1 rad below the horizon (bottom row) to the zenith (top row)."""
    rng = np.random.default_rng(13)
    elevation = np.linspace(np.pi / 2, -0.1, height, dtype=np.float32)[:, None]
    high = np.clip(elevation / 0.9, 0, 1)[..., None]
    image = (1 - high) * paint.flat(height, width, (236, 226, 214)) + high * paint.flat(
        height, width, (196, 140, 84)
    )
    clouds = paint.fractal(rng, height, width, {500: 0.5, 220: 0.45, 90: 0.35, 40: 0.22, 16: 0.12})
    paint.blend(
        image, (250, 249, 247), 0.85 * np.clip(0.7 * clouds + 0.05, 0, 1) * np.clip(3 * elevation, 0, 1)
    )
    columns = np.zeros((1, width), np.float32)
    hills = 0.045 + 0.018 * paint.band_noise(rng, 8, width, 700)[:1]
    trees = (
        0.022
        + 0.009 * paint.band_noise(rng, 8, width, 120)[:1]
        + 0.006 * paint.band_noise(rng, 8, width, 14)[:1]
    )
    soft = (np.pi / 2 + 0.1) / height
    for skyline, colour, speckle in ((hills, (150, 138, 122), 0.05), (trees, (46, 70, 58), 0.3)):
        paint.blend(image, colour, np.clip((skyline + columns - elevation) / soft, 0, 1))
        below = (elevation < skyline).astype(np.float32)
        paint.tint(image, below * paint.fractal(rng, height, width, {9: 1.0, 4: 0.7}), speckle)
    paint.blend(image, (92, 122, 112), np.clip((0.004 - elevation) / soft, 0, 1))
    return image


def write(directory):
    """Write ground.png, ground_map.png and sky.png."""
    paint.save(directory / "ground.png", gravel())
    paint.save(directory / "ground_map.png", light_map())
    paint.save(directory / "sky.png", sky())
