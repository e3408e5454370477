# SPDX-License-Identifier: BSD-3-Clause
"""The world `citadel`: a hill with a road up to a walled place on its top."""

import cv2
import numpy as np
import paint
from sdf import World

SIZE, SAMPLES = 64.0, 65  # Extent of the terrain, m, and samples along each axis.
TOP, TOP_RADIUS, FOOT_RADIUS = 3.5, 10.0, 26.0
ROAD_WIDTH, ROAD_FOOT = 3.5, -29.0  # The road climbs along y = 0 from its foot to the top, m.
WALL_RADIUS, WALL_HEIGHT, WALL = 7.5, 2.0, 0.5
SIDES, GATE_WIDTH = 8, 3.0


def _smooth(share):
    share = np.clip(share, 0, 1)
    return share * share * (3 - 2 * share)


def heights():
    """Height of the terrain in m: rows from the largest y down, columns with growing x."""
    axis = np.linspace(-SIZE / 2, SIZE / 2, SAMPLES)
    x, y = np.meshgrid(axis, axis[::-1])
    hill = _smooth((FOOT_RADIUS - np.hypot(x, y)) / (FOOT_RADIUS - TOP_RADIUS))
    rng = np.random.default_rng(51)
    rough = paint.fractal(rng, SAMPLES, SAMPLES, {16: 0.35, 7: 0.18})
    slope = 4 * hill * (1 - hill)
    hill = TOP * hill + slope * rough
    # Straight, apart from short bends at both ends.
    ramp = np.clip((x - ROAD_FOOT) / (-TOP_RADIUS - ROAD_FOOT), 0, 1)
    ramp = TOP * (0.85 * ramp + 0.15 * _smooth(ramp))
    on_road = np.exp(-((y / ROAD_WIDTH) ** 4)) * (x < 0)
    return np.clip(hill + on_road * (ramp - hill), 0, None)


def light_map(size=512):
    """Grass on the slopes, bare rock where they are steep, the road; 0.5 is neutral."""
    rng = np.random.default_rng(52)
    ground = cv2.resize(heights().astype(np.float32), (size, size), interpolation=cv2.INTER_CUBIC)
    dy, dx = np.gradient(ground, SIZE / size)
    steep = np.hypot(dx, dy)
    image = np.full((size, size, 3), 0.5, np.float32)
    paint.tint(image, paint.fractal(rng, size, size, {150: 0.06, 60: 0.09, 24: 0.1, 9: 0.09, 4: 0.08}))
    patches = paint.fractal(rng, size, size, {90: 0.5, 30: 0.4, 10: 0.3})
    axis = np.linspace(-SIZE / 2, SIZE / 2, size, dtype=np.float32)
    x, y = np.meshgrid(axis, axis[::-1])
    road = np.exp(-((y / 2.0) ** 6)) * (x < -WALL_RADIUS)
    bare = np.maximum(road, np.clip(WALL_RADIUS + 1 - np.hypot(x, y), 0, 1))
    paint.blend(image, (62, 116, 88), 0.75 * np.clip(0.6 + patches, 0, 1) * (1 - bare))
    paint.blend(image, (128, 132, 136), 0.8 * np.clip(8 * (steep - 0.3), 0, 1) * (1 - bare))
    return image


def write_media(directory):
    """Write citadel_height.png, 16 bits, white is TOP and a half, and citadel_map.png."""
    white = 1.5 * TOP
    grey = np.round(heights() / white * 65535).astype(np.uint16)
    if not cv2.imwrite(str(directory / "citadel_height.png"), grey):
        raise OSError("cannot write citadel_height.png")
    paint.save(directory / "citadel_map.png", light_map())


def write(directory):
    """Write citadel.world."""
    world = World(
        "citadel",
        "citadel.py",
        f"A hill of {TOP:g} m; a road climbs along y = 0 to a gate in the walls on its top.",
    )
    world.terrain("citadel_height", (SIZE, SIZE, 1.5 * TOP), "citadel_map")
    world.ground(0, -0.02)
    world.robot("spiri", "spiri", -31.0, 0, 0.0405)
    world.robot("husky", "husky", -29.5, 0, 0.1325)
    sunk = TOP - 0.3  # The feet of the walls stand in the ground.
    corner = [np.pi * (2 * i + 1) / SIDES for i in range(SIDES)]
    for i, turn in enumerate(corner):
        x, y = WALL_RADIUS * np.cos(turn), WALL_RADIUS * np.sin(turn)
        world.cylinder("tower", (x, y, sunk), 0.7, WALL_HEIGHT + 1.1, "stone")
        facing = (turn + corner[(i + 1) % SIDES] + (2 * np.pi if i == SIDES - 1 else 0)) / 2
        across = WALL_RADIUS * np.cos(np.pi / SIDES)
        length = 2 * WALL_RADIUS * np.sin(np.pi / SIDES)
        size = (WALL, length, WALL_HEIGHT + 0.3)
        if abs(np.cos(facing) + 1) > 1e-6:
            world.box("wall", (across * np.cos(facing), across * np.sin(facing), sunk), size, "stone", facing)
            continue
        rest = (length - GATE_WIDTH) / 2
        for side in (1, -1):
            place = (-across, side * (GATE_WIDTH + rest) / 2, sunk)
            world.box("gate_side", place, (WALL, rest, WALL_HEIGHT + 0.3), "stone")
        lintel = (WALL, GATE_WIDTH, 0.4)
        world.box("lintel", (-across, 0, TOP + WALL_HEIGHT), lintel, "stone")
    world.box("keep", (3.0, 1.5, sunk), (3.0, 3.0, 3.3), "stone", 0.2)
    for x, y, yaw in ((-2.5, 3.8, 0.3), (-3.3, 4.4, 0.8), (-1.5, -4.6, 0.1)):
        world.box("crate", (x, y, TOP - 0.02), (0.8, 0.8, 0.8), "crate", yaw)
    for x, y in ((-24.0, 3.0), (-20.0, -3.0), (-16.0, 3.0)):
        world.cylinder("post", (x, y, 0), 0.06, 4.0, "post")
    world.write(directory / "citadel.world")
