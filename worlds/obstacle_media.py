# SPDX-License-Identifier: BSD-3-Clause
"""Walls, crates, containers, barrels and posts; each is one seamless repeat."""

import cv2
import numpy as np
import paint


def brick(size=512):
    """Draw running bond, 8 courses of 4 bricks; one repeat is 1 m."""
    rng = np.random.default_rng(21)
    image = paint.flat(size, size, (140, 146, 150))
    tall, wide = size // 8, size // 4
    for course in range(8):
        for column in range(5):
            x = column * wide - (course % 2) * wide // 2
            colour = np.array((58, 78, 142)) * rng.uniform(0.65, 1.25) + rng.uniform(-10, 10, 3)
            corner = (x + 3, course * tall + 3)
            opposite = (x + wide - 4, (course + 1) * tall - 4)
            cv2.rectangle(image, corner, opposite, tuple(float(c) for c in np.clip(colour / 255, 0, 1)), -1)
    image[:, -wide // 2 :] = np.where(  # The half bricks at both edges are one brick.
        (np.arange(size) // tall % 2 == 1)[:, None, None],
        np.roll(image, wide // 2, 1)[:, -wide // 2 :],
        image[:, -wide // 2 :],
    )
    paint.tint(image, paint.fractal(rng, size, size, {120: 0.08, 40: 0.08, 14: 0.1, 5: 0.12, 2.5: 0.08}))
    paint.spots(rng, image, 160, (1, 9), (46, 52, 60))
    return image


def concrete(size=512):
    """Cast concrete with form joints and anchor holes; one repeat is 1.5 m."""
    rng = np.random.default_rng(22)
    image = paint.flat(size, size, (150, 156, 158))
    paint.tint(image, paint.fractal(rng, size, size, {200: 0.07, 70: 0.08, 24: 0.07, 8: 0.07, 3: 0.09}))
    paint.spots(rng, image, 260, (1, 7), (70, 76, 80))
    paint.cracks(rng, image, 5, 40, (60, 64, 68), 0.7)
    image[:3] *= 0.6
    image[:, :3] *= 0.6
    for x in (128, 384):
        for y in (128, 384):
            cv2.circle(image, (x, y), 9, (0.25, 0.26, 0.27), -1, cv2.LINE_AA)
    paint.grime(rng, image, (70, 84, 92), 0.25)
    return image


def crate(size=512):
    """Planks with a frame and stencilled letters; one repeat is one face of 1 m."""
    rng = np.random.default_rng(23)
    image = paint.flat(size, size, (86, 138, 184))
    grain = paint.fractal(rng, size, size // 8, {60: 0.4, 16: 0.4, 6: 0.4})
    paint.tint(image, cv2.resize(grain, (size, size), interpolation=cv2.INTER_CUBIC), 0.22)
    for plank in range(0, size, 64):
        image[plank : plank + 64] *= rng.uniform(0.75, 1.12)
        image[plank : plank + 3] *= 0.35
    for edge in (slice(0, 54), slice(size - 54, size)):
        image[edge] *= 0.8
        image[:, edge] *= 0.8
    for line in (54, size - 57):
        image[line : line + 3] *= 0.3
        image[:, line : line + 3] *= 0.3
    for x in range(27, size, 76):
        for y in (27, size - 27):
            paint.bolt(image, x, y, 4)
            paint.bolt(image, y, x, 4)
    paint.label(image, "TLD 21", 120, 230, 56, (30, 34, 40), 5)
    paint.label(image, "FRAGILE", 126, 330, 44, (30, 30, 150), 4)
    paint.scratches(rng, image, 140, (8, 70), (150, 190, 220), 0.5)
    paint.tint(image, paint.fractal(rng, size, size, {30: 0.06, 5: 0.08, 2.5: 0.06}))
    paint.grime(rng, image, (46, 58, 66), 0.4)
    return image


def container(size=512):
    """Corrugated painted steel with rust; one repeat is 1.6 m."""
    rng = np.random.default_rng(24)
    image = paint.flat(size, size, (132, 92, 38))
    ridge = 0.22 * np.sign(np.sin(np.arange(size) * 2 * np.pi * 8 / size)).astype(np.float32)
    paint.tint(image, np.repeat(cv2.GaussianBlur(ridge[None], (9, 1), 0), size, 0))
    paint.tint(image, paint.fractal(rng, size, size, {90: 0.07, 30: 0.06, 6: 0.07, 2.5: 0.06}))
    rust = paint.fractal(rng, size, size, {120: 0.6, 40: 0.5, 12: 0.4, 5: 0.3})
    paint.blend(image, (34, 64, 128), 0.85 * np.clip(2 * (rust - 0.9), 0, 1))
    paint.scratches(rng, image, 120, (6, 50), (190, 180, 160), 0.5)
    paint.grime(rng, image, (50, 62, 70), 0.4)
    return image


def barrel(size=512):
    """Painted steel drum: two hoops, a worn label; one repeat is 0.9 m."""
    rng = np.random.default_rng(25)
    image = paint.flat(size, size, (40, 50, 176))
    for hoop in (165, 340):
        image[hoop : hoop + 12] *= 1.5
        image[hoop + 12 : hoop + 20] *= 0.45
    image[195:310, 60:260] = np.array((0.82, 0.84, 0.85))
    paint.label(image, "OIL", 84, 280, 62, (40, 40, 40), 6)
    paint.stripes(image, 300, 215, 190, 60, 22, ((20, 190, 235), (25, 25, 25)))
    paint.tint(image, paint.fractal(rng, size, size, {80: 0.08, 26: 0.08, 8: 0.08, 3: 0.08}))
    paint.spots(rng, image, 120, (2, 16), (38, 66, 110))
    paint.scratches(rng, image, 120, (6, 50), (180, 180, 190), 0.5)
    paint.grime(rng, image, (40, 52, 60), 0.45)
    return image


def post(size=256):
    """Red and white bands; one repeat is 0.5 m."""
    rng = np.random.default_rng(26)
    image = paint.flat(size, size, (215, 220, 222))
    image[: size // 2] = np.array((38, 36, 190), np.float32) / 255
    paint.tint(image, paint.fractal(rng, size, size, {60: 0.08, 20: 0.08, 6: 0.1, 3: 0.08}))
    paint.spots(rng, image, 90, (1, 10), (70, 84, 92))
    paint.scratches(rng, image, 60, (5, 40), (120, 120, 120), 0.6)
    return image


def stone(size=512):
    """Draw rough ashlar, 8 courses of blocks of many lengths; one repeat is 2 m."""
    rng = np.random.default_rng(27)
    image = paint.flat(size, size, (92, 98, 104))
    tall = size // 8
    for course in range(8):
        joints = np.sort(rng.choice(np.arange(0, size, 32), 6, replace=False))
        for left, right in zip(joints, [*joints[1:], joints[0] + size], strict=True):
            grey = rng.uniform(0.45, 0.8)
            warm = rng.uniform(0.88, 1.02)
            colour = tuple(float(c) for c in (grey * warm**2, grey * warm, grey))
            for shift in (0, -size):  # The block that crosses the edge shows on both sides.
                corner = (int(left) + shift + 3, course * tall + 3)
                opposite = (int(right) + shift - 4, (course + 1) * tall - 4)
                cv2.rectangle(image, corner, opposite, colour, -1)
    paint.tint(image, paint.fractal(rng, size, size, {110: 0.08, 40: 0.1, 14: 0.12, 6: 0.12, 2.5: 0.1}))
    paint.spots(rng, image, 200, (1, 10), (58, 64, 70))
    paint.spots(rng, image, 60, (4, 22), (70, 112, 96), (0.2, 0.5))
    paint.cracks(rng, image, 10, 30, (48, 52, 56), 0.7)
    return image


def write(directory):
    """Write one PNG for each kind of surface."""
    for draw in (brick, concrete, crate, container, barrel, post, stone):
        paint.save(directory / f"{draw.__name__}.png", draw())
