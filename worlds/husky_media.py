# SPDX-License-Identifier: BSD-3-Clause
"""The Husky: textures and meshes. Frames and sizes as in husky.urdf, metres."""

import itertools

import cv2
import numpy as np
import paint
from obj import Obj

YELLOW = (18, 178, 238)
BLACK = (34, 32, 31)

# The chassis, in the frame of base_link: x forward, z up from 0.132 m above the ground.
HALF_LENGTH, HALF_WIDTH = 0.4937, 0.28545
BUMPER_TOP, DECK, RAIL_TOP = 0.1237, 0.2175, 0.2475
WHEEL_RADIUS, WHEEL_WIDTH, CORE_RADIUS = 0.1651, 0.1143, 0.146


def shell():
    """Yellow panels in four strips of 1024x256: side, rear, front, plain."""
    rng = np.random.default_rng(31)
    image = paint.flat(1024, 1024, YELLOW)
    side, rear, front = image[0:256], image[256:512], image[512:768]
    for strip in (side, rear, front):
        strip[:6] *= 0.3
        strip[-6:] *= 0.3
        for x in range(24, 1024, 122):
            paint.bolt(strip, x, 22, 7)
            paint.bolt(strip, x, 234, 7)
    for x in (250, 760):
        side[:, x : x + 4] *= 0.25
    paint.label(side, "HUSKY", 398, 165, 58, (24, 24, 24), 10)
    paint.label(side, "A200", 800, 150, 48, (24, 24, 24), 7)
    paint.stripes(side, 24, 66, 200, 90, 30, ((24, 24, 24), YELLOW))

    cv2.rectangle(rear, (330, 40), (694, 216), (0.1, 0.1, 0.1), -1)
    paint.label(rear, "HUSKY", 352, 122, 62, YELLOW, 9)
    paint.label(rear, "UGV 07", 356, 190, 46, (225, 228, 230), 6)
    paint.stripes(rear, 40, 60, 230, 130, 34, ((24, 24, 24), YELLOW))
    cv2.circle(rear, (820, 128), 70, (0.9, 0.9, 0.9), -1, cv2.LINE_AA)
    cv2.circle(rear, (820, 128), 56, (0.12, 0.1, 0.75), -1, cv2.LINE_AA)
    paint.label(rear, "STOP", 783, 138, 22, (235, 235, 235), 3)
    for x in (925, 965):
        cv2.rectangle(rear, (x, 80), (x + 26, 176), (0.12, 0.12, 0.12), -1)

    cv2.rectangle(front, (300, 60), (724, 200), (0.1, 0.1, 0.1), -1)
    paint.label(front, "HUSKY", 340, 165, 84, YELLOW, 13)
    for x in (150, 874):
        cv2.circle(front, (x, 128), 66, (0.1, 0.1, 0.1), -1, cv2.LINE_AA)
        cv2.circle(front, (x, 128), 50, (0.92, 0.95, 0.96), -1, cv2.LINE_AA)
    paint.weather(rng, image, 0.0)
    for strip in (side, rear, front):
        paint.grime(rng, strip, paint.MUD, 0.45, 90)
    return image


def black():
    """Powder-coated metal and plastic; one repeat is 0.5 m."""
    rng = np.random.default_rng(32)
    image = paint.flat(512, 512, (52, 50, 48))
    paint.weather(rng, image, 0.35, 1.6)
    return image


def bumper():
    """Draw the wrap of a bumper, 1024x256."""
    rng = np.random.default_rng(33)
    image = paint.flat(256, 1024, (46, 44, 43))
    image[116:124] *= 0.3
    image[124:132] *= 1.7
    for x in (60, 170, 854, 964):
        paint.bolt(image, x, 66, 13)
        paint.bolt(image, x, 196, 13)
    for x in (236, 700):
        cv2.rectangle(image, (x, 150), (x + 88, 186), (0.1, 0.1, 0.62), -1)
        cv2.rectangle(image, (x + 6, 156), (x + 82, 164), (0.35, 0.35, 0.95), -1)
    paint.stripes(image, 350, 146, 320, 60, 32, ((24, 24, 24), YELLOW))
    paint.label(image, "CAUTION", 396, 84, 50, (210, 214, 216), 7)
    paint.weather(rng, image, 0.4, 1.6)
    return image


def deck():
    """Top: yellow rim, dark plate with its grid of holes, labels. Up is forward."""
    rng = np.random.default_rng(34)
    image = paint.flat(1024, 1024, YELLOW)
    cv2.rectangle(image, (70, 120), (954, 904), (0.17, 0.17, 0.18), -1)
    cv2.rectangle(image, (70, 120), (954, 904), (0.05, 0.05, 0.05), 5)
    for x in range(110, 930, 50):
        for y in range(160, 880, 50):
            cv2.circle(image, (x, y), 9, (0.02, 0.02, 0.02), -1, cv2.LINE_AA)
            cv2.circle(image, (x + 2, y + 2), 10, (0.4, 0.4, 0.41), 1, cv2.LINE_AA)
    cv2.rectangle(image, (340, 360), (690, 650), (0.24, 0.25, 0.27), -1)
    cv2.rectangle(image, (340, 360), (690, 650), (0.6, 0.6, 0.6), 4)
    paint.label(image, "HUSKY", 378, 470, 72, YELLOW, 11)
    paint.label(image, "24V 20Ah", 380, 545, 48, (200, 204, 206), 5)
    paint.label(image, "NO STEP", 384, 620, 50, (60, 60, 220), 6)
    paint.stripes(image, 110, 420, 150, 180, 34, ((24, 24, 24), YELLOW))
    paint.stripes(image, 770, 420, 150, 180, 34, ((24, 24, 24), (215, 218, 220)))
    for x in range(30, 1024, 107):
        paint.bolt(image, x, 60, 11)
        paint.bolt(image, x, 964, 11)
    paint.weather(rng, image, 0.0, 1.3)
    return image


def rail():
    """Slotted aluminium; one repeat is 0.1 m along the rail."""
    rng = np.random.default_rng(35)
    image = paint.flat(128, 256, (176, 174, 172))
    image[44:84] = 0.12
    image[:8] *= 0.6
    for x in (40, 168):
        paint.bolt(image, x, 64, 12)
    paint.tint(image, paint.fractal(rng, 128, 256, {60: 0.08, 16: 0.1, 5: 0.12}))
    paint.spots(rng, image, 50, (2, 12), paint.MUD)
    return image


def tyre():
    """Rubber (left half: tread and lugs) and the wheel's face (right half)."""
    rng = np.random.default_rng(36)
    image = paint.flat(512, 1024, (50, 50, 52))
    paint.tint(image, paint.fractal(rng, 512, 1024, {120: 0.12, 40: 0.16, 14: 0.18, 6: 0.2, 3: 0.12}))
    paint.spots(rng, image, 420, (2, 22), (86, 108, 128), (0.3, 0.9), 2)
    paint.spots(rng, image, 200, (2, 12), (18, 18, 18), (0.4, 0.9), 2)
    centre = (768, 256)
    cv2.circle(image, centre, 186, (0.09, 0.09, 0.09), -1, cv2.LINE_AA)
    cv2.circle(image, centre, 172, (0.3, 0.31, 0.33), -1, cv2.LINE_AA)
    for spoke in range(5):
        turn = 2 * np.pi * spoke / 5
        hole = (int(768 + 108 * np.cos(turn)), int(256 + 108 * np.sin(turn)))
        cv2.circle(image, hole, 42, (0.06, 0.06, 0.06), -1, cv2.LINE_AA)
        nut = (int(768 + 62 * np.cos(turn + 0.63)), int(256 + 62 * np.sin(turn + 0.63)))
        paint.bolt(image, *nut, 9)
    cv2.circle(image, centre, 36, (0.1, 0.62, 0.85), -1, cv2.LINE_AA)
    cv2.circle(image, centre, 12, (0.1, 0.1, 0.1), -1, cv2.LINE_AA)
    for turn in range(0, 360, 30):
        angle = np.radians(turn)
        mark = (int(768 + 216 * np.cos(angle)), int(256 + 216 * np.sin(angle)))
        cv2.circle(image, mark, 5, (0.7, 0.7, 0.7), -1, cv2.LINE_AA)
    paint.spots(rng, image, 160, (2, 14), paint.MUD, (0.3, 0.8), 2)
    return image


def shell_mesh():
    """Yellow body above the wheels: sloping ends, a waist between the wheels."""
    mesh = Obj()
    strip = {
        name: (0.0, 0.75 - 0.25 * i, 1.0, 1.0 - 0.25 * i) for i, name in enumerate(("side", "rear", "front"))
    }
    foot, top, waist, flare = 0.425, 0.395, 0.215, 0.198
    for side in (1, -1):
        y, w = side * HALF_WIDTH, side * waist
        # Seen from outside: left to right is +x for the right side, -x for the left side.
        a, b = side * foot, -side * foot
        c, d = side * top, -side * top
        mesh.quad((a, w, 0.0), (b, w, 0.0), (d, w, flare), (c, w, flare), strip["side"])
        mesh.quad((c, y, flare), (d, y, flare), (d, y, DECK), (c, y, DECK), (0.0, 0.05, 1.0, 0.1))
        mesh.quad(
            (d, w, flare), (d, y, flare), (c, y, flare), (c, w, flare), (0.0, 0.0, 1.0, 0.1), flip=side > 0
        )
    for end, name in ((-1, "rear"), (1, "front")):
        left = -end * HALF_WIDTH
        low, high = (end * foot, BUMPER_TOP - 0.002), (end * top, DECK)
        corners = [
            (low[0], -left, low[1]),
            (low[0], left, low[1]),
            (high[0], left, high[1]),
            (high[0], -left, high[1]),
        ]
        mesh.quad(corners[1], corners[0], corners[3], corners[2], strip[name], flip=False)
        for side in (1, -1):  # The gusset between the sloping end and the flare.
            y = side * HALF_WIDTH
            mesh.triangle(
                (end * foot, y, BUMPER_TOP),
                (end * top, y, DECK),
                (end * top, y, BUMPER_TOP),
                (0.0, 0.02, 0.12, 0.12),
                outward=(0, side, 0),
            )
    return mesh


def deck_mesh():
    """Build the top."""
    mesh = Obj()
    x, y = 0.395, HALF_WIDTH
    # The image's top is the front, so that letters read from behind.
    mesh.quad((-x, y, DECK), (-x, -y, DECK), (x, -y, DECK), (x, y, DECK), (0, 0, 1, 1))
    return mesh


def bumper_mesh():
    """Both bumpers: chamfered corners, a step below."""
    mesh = Obj()
    outline = [
        (0.405, HALF_WIDTH),
        (0.452, HALF_WIDTH),
        (HALF_LENGTH, 0.225),
        (HALF_LENGTH, -0.225),
        (0.452, -HALF_WIDTH),
        (0.405, -HALF_WIDTH),
    ]
    length = np.cumsum([0.0] + [np.hypot(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(outline)])
    for end in (1, -1):
        points = [(end * x, end * y) for x, y in outline]
        for i, (a, b) in enumerate(itertools.pairwise(points)):
            u0, u1 = 1 - length[i] / length[-1], 1 - length[i + 1] / length[-1]
            mesh.quad((*b, 0.0), (*a, 0.0), (*a, BUMPER_TOP), (*b, BUMPER_TOP), (u1, 0, u0, 1))
        centre = (end * 0.43, 0.0)
        for a, b in itertools.pairwise([*points, points[0]]):
            for z, up in ((BUMPER_TOP, 1), (0.0, -1)):
                mesh.triangle((*centre, z), (*a, z), (*b, z), (0.02, 0.62, 0.5, 0.98), outward=(0, 0, up))
    return mesh


def frame_mesh():
    """Build the black parts: the floor of the body and what carries the axles."""
    mesh = Obj()
    mesh.box((0, 0, 0.006), (0.84, 0.42, 0.012), 2.0)
    for end in (1, -1):
        mesh.box((end * 0.256, 0, 0.03282), (0.06, 0.52, 0.05), 2.0)
    return mesh


def rail_mesh():
    """Two rails along the deck and two across it."""
    mesh = Obj()
    middle, tall = (DECK + RAIL_TOP) / 2, RAIL_TOP - DECK
    for side in (1, -1):
        mesh.box((0, side * 0.215, middle), (0.74, 0.035, tall), 10.0)
        mesh.box((side * 0.30, 0, middle), (0.03, 0.395, tall), 10.0)
    return mesh


def wheel_mesh(lugs=16):
    """Build a chunky tyre about the y axis: core, lugs in two staggered rows, dished faces."""
    mesh = Obj()
    half = WHEEL_WIDTH / 2

    def rim(turn, radius, y):
        return radius * np.sin(turn), y, radius * np.cos(turn)

    sides = 2 * lugs
    for i in range(sides):
        a, b = 2 * np.pi * i / sides, 2 * np.pi * (i + 1) / sides
        u0, u1 = 0.5 * i / sides, 0.5 * (i + 1) / sides
        mesh.quad(
            rim(a, CORE_RADIUS, -half),
            rim(b, CORE_RADIUS, -half),
            rim(b, CORE_RADIUS, half),
            rim(a, CORE_RADIUS, half),
            (u0, 0, u1, 1),
            outward=rim((a + b) / 2, 1, 0),
        )
        for side in (1, -1):
            points = [
                (0, side * (half - 0.018), 0),
                rim(a, CORE_RADIUS, side * half),
                rim(b, CORE_RADIUS, side * half),
            ]
            uvs = [(0.75 + 0.25 * p[0] / CORE_RADIUS, 0.5 + 0.5 * p[2] / CORE_RADIUS) for p in points]
            mesh.face(points, uvs, outward=(0, side, 0))
    for i in range(lugs):
        for side in (1, -1):
            start = 2 * np.pi * (i + (0.5 if side < 0 else 0)) / lugs
            end = start + 0.56 * 2 * np.pi / lugs
            skew = 0.3 * 2 * np.pi / lugs  # The lug leans towards the tyre's edge.
            inner, outer = side * 0.004, side * half
            low = [
                rim(start + skew, CORE_RADIUS, inner),
                rim(end + skew, CORE_RADIUS, inner),
                rim(end, CORE_RADIUS, outer),
                rim(start, CORE_RADIUS, outer),
            ]
            high = [
                rim(start + skew, WHEEL_RADIUS, inner),
                rim(end + skew, WHEEL_RADIUS, inner),
                rim(end, WHEEL_RADIUS - 0.004, outer * 0.94),
                rim(start, WHEEL_RADIUS - 0.004, outer * 0.94),
            ]
            away = rim((start + end) / 2, 1, 0)
            u = 0.5 * ((i * 0.37) % 0.8)
            middle = np.mean(low + high, axis=0)
            mesh.face(high, [(u, 0.1), (u + 0.1, 0.1), (u + 0.1, 0.4), (u, 0.4)], outward=away)
            for j in range(4):
                k = (j + 1) % 4
                wall = [low[j], low[k], high[k], high[j]]
                mesh.face(
                    wall,
                    [(u, 0.5), (u + 0.08, 0.5), (u + 0.08, 0.6), (u, 0.6)],
                    outward=np.mean(wall, axis=0) - middle,
                )
    return mesh


def write(directory):
    """Write husky_*.png and husky_*.obj."""
    for draw in (shell, black, bumper, deck, rail, tyre):
        paint.save(directory / f"husky_{draw.__name__}.png", draw())
    meshes = {
        "shell": shell_mesh,
        "deck": deck_mesh,
        "bumper": bumper_mesh,
        "frame": frame_mesh,
        "rail": rail_mesh,
        "wheel": wheel_mesh,
    }
    for name, build in meshes.items():
        build().save(directory / f"husky_{name}.obj")
