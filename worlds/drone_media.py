# SPDX-License-Identifier: BSD-3-Clause
"""The drone that is a target: textures and meshes. Frame and sizes as in target_drone.urdf, metres."""

import itertools

import numpy as np
import paint
from obj import Obj

ORANGE = (24, 104, 238)
WHITE = (226, 230, 232)
INK = (26, 24, 24)

HALF_LENGTH, HALF_WIDTH, CHAMFER = 0.13, 0.095, 0.035
BELLY, SHOULDER, ROOF = -0.055, 0.035, 0.065
ROTOR_PLACE, ROTOR_RADIUS, ROTOR_HEIGHT = 0.12, 0.1, 0.045
GUARD_LOW, GUARD_HIGH = 0.015, 0.06
SKID = -0.12


def body():
    """Paint the hull: the top plate above, the wrap of the sides below with the rear in its middle."""
    rng = np.random.default_rng(41)
    image = paint.flat(1024, 1024, ORANGE)
    roof, wrap = image[:512], image[512:]
    paint.stripes(roof, 60, 60, 904, 90, 44, (INK, WHITE))
    paint.label(roof, "TARGET", 250, 330, 150, INK, 22)
    paint.stripes(roof, 60, 390, 904, 70, 60, (INK, ORANGE))
    wrap[:, 380:644] = np.array(WHITE, np.float32) / 255
    paint.label(wrap, "TLD 2", 396, 250, 88, INK, 15)
    paint.stripes(wrap, 380, 300, 264, 110, 46, (INK, (30, 190, 240)))
    for x in (40, 180, 840, 980):
        paint.label(wrap, "02", x - 30, 320, 92, WHITE, 12)
    wrap[440:470] *= 0.25
    for x in range(20, 1024, 82):
        paint.bolt(wrap, x, 40, 14)
        paint.bolt(roof, x, 30, 12)
        paint.bolt(roof, x, 484, 12)
    paint.weather(rng, image, 0.15, 1.3)
    return image


def frame():
    """Carbon and black plastic of arms, motors and skids; one repeat is 0.2 m."""
    rng = np.random.default_rng(42)
    image = paint.flat(512, 512, (64, 62, 60))
    weave = np.add.outer(np.arange(512) // 16, np.arange(512) // 16) % 2
    image *= (0.8 + 0.4 * weave.astype(np.float32))[..., None]
    image[:, 220:292] = np.array((38, 190, 240), np.float32) / 255
    paint.weather(rng, image, 0.2, 1.4)
    return image


def rotor():
    """Draw a turning rotor, seen along its axis: streaks about the hub, a bright ring of its tips."""
    rng = np.random.default_rng(43)
    size = 512
    image = paint.flat(size, size, (104, 106, 108))
    y, x = np.mgrid[0:size, 0:size].astype(np.float32) - size / 2
    radius, turn = np.hypot(x, y) / (size / 2), np.arctan2(y, x)
    image *= (1 + 0.35 * np.sin(2 * turn) * np.clip(radius, 0, 1))[..., None]
    paint.blend(image, (40, 200, 245), ((radius > 0.86) & (radius < 0.97)).astype(np.float32))
    paint.blend(image, INK, (radius < 0.16).astype(np.float32))
    paint.tint(image, paint.fractal(rng, size, size, {90: 0.08, 30: 0.1, 10: 0.12, 4: 0.1}))
    paint.spots(rng, image, 120, (2, 14), paint.MUD)
    return image


def _octagon(scale, z):
    """Corners of the hull's outline from the middle of the front on, counter-clockwise from above."""
    x, y, c = HALF_LENGTH * scale, HALF_WIDTH * scale, CHAMFER * scale
    half = [(x, y - c), (x - c, y), (c - x, y), (-x, y - c)]
    return [(x, 0.0, z), *((a, b, z) for a, b in half), (-x, 0.0, z)] + [
        (a, -b, z) for a, b in reversed(half)
    ]


def body_mesh():
    """Build the hull: eight sides, a shoulder that slopes to the roof, a flat belly."""
    mesh = Obj()
    low, high, top = _octagon(1, BELLY), _octagon(1, SHOULDER), _octagon(0.8, ROOF)
    around = np.cumsum(
        [0.0] + [np.hypot(*np.subtract(b, a)[:2]) for a, b in itertools.pairwise([*low, low[0]])]
    )
    around /= around[-1]

    def on_top(point):
        return 0.5 - point[1] / (2.2 * HALF_WIDTH), 0.75 + point[0] / (4.4 * HALF_LENGTH)

    for i in range(len(low)):
        j = (i + 1) % len(low)
        u0, u1 = around[i], around[i + 1]
        out = (low[i][0] + low[j][0], low[i][1] + low[j][1], 0)
        mesh.face([low[i], low[j], high[j], high[i]], [(u0, 0), (u1, 0), (u1, 0.4), (u0, 0.4)], outward=out)
        mesh.face(
            [high[i], high[j], top[j], top[i]], [(u0, 0.4), (u1, 0.4), (u1, 0.5), (u0, 0.5)], outward=out
        )
    mesh.face(top, [on_top(p) for p in top], outward=(0, 0, 1))
    mesh.face(low, [on_top(p) for p in low], outward=(0, 0, -1))
    return mesh


def _beam(mesh, a, b, width, tall):
    """Add a beam of rectangular section from a to b; its texture repeats every 0.2 m."""
    a, b = np.array(a, float), np.array(b, float)
    along = (b - a) / np.linalg.norm(b - a)
    side = np.cross((0, 0, 1), along) if abs(along[2]) < 0.9 else np.array((0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    up = np.cross(along, side)
    ring = [s * side * width / 2 + t * up * tall / 2 for s, t in ((1, -1), (1, 1), (-1, 1), (-1, -1))]
    long = np.linalg.norm(b - a) / 0.2
    for i in range(4):
        p, q = ring[i], ring[(i + 1) % 4]
        wide = np.linalg.norm(q - p) / 0.2
        mesh.face([a + p, a + q, b + q, b + p], [(0, 0), (wide, 0), (wide, long), (0, long)], outward=p + q)
    for end, sign in ((a, -1), (b, 1)):
        mesh.face([end + p for p in ring], [(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)], outward=sign * along)


def _rim(centre, radius, z, sides):
    """Corners of a regular polygon about `centre`, level, with their places in the unit square."""
    turns = 2 * np.pi * np.arange(sides) / sides
    points = [(centre[0] + radius * np.cos(t), centre[1] + radius * np.sin(t), z) for t in turns]
    return points, [(0.5 + 0.5 * np.cos(t), 0.5 + 0.5 * np.sin(t)) for t in turns]


def _places():
    return [(x * ROTOR_PLACE, y * ROTOR_PLACE) for x in (1, -1) for y in (1, -1)]


def frame_mesh():
    """Build arms, motors and landing skids."""
    mesh = Obj()
    for x, y in _places():
        _beam(mesh, (0.3 * x, 0.3 * y, 0.0), (1.05 * x, 1.05 * y, 0.0), 0.03, 0.022)
        low, _ = _rim((x, y), 0.014, -0.015, 8)
        high, uvs = _rim((x, y), 0.014, ROTOR_HEIGHT, 8)
        mesh.face(low, uvs, outward=(0, 0, -1))
        for i in range(8):
            j = (i + 1) % 8
            out = (low[i][0] + low[j][0] - 2 * x, low[i][1] + low[j][1] - 2 * y, 0)
            mesh.face(
                [low[i], low[j], high[j], high[i]], [(0, 0), (0.1, 0), (0.1, 0.3), (0, 0.3)], outward=out
            )
    for side in (1, -1):
        _beam(mesh, (-0.13, side * 0.085, SKID), (0.13, side * 0.085, SKID), 0.018, 0.018)
        for x in (-0.06, 0.06):
            _beam(mesh, (x, side * 0.085, SKID), (x, side * 0.06, BELLY), 0.014, 0.014)
    return mesh


def guard():
    """Paint the wrap of a rotor's guard, 1024x128: hazard stripes and numbers, once around."""
    rng = np.random.default_rng(44)
    image = paint.flat(128, 1024, WHITE)
    for x in range(0, 1024, 256):
        paint.stripes(image, x, 0, 140, 128, 40, (INK, ORANGE))
        paint.label(image, f"R{x // 256 + 1}", x + 150, 100, 72, INK, 11)
    image[:8] *= 0.3
    image[-8:] *= 0.3
    paint.weather(rng, image, 0.2, 1.3)
    return image


def guard_mesh(sides=16):
    """Build the rings around the rotors, seen from outside and from inside."""
    mesh = Obj()
    for place in _places():
        for radius, sign in ((ROTOR_RADIUS, 1), (ROTOR_RADIUS - 0.004, -1)):
            low, _ = _rim(place, radius, GUARD_LOW, sides)
            high, _ = _rim(place, radius, GUARD_HIGH, sides)
            for i in range(sides):
                j = (i + 1) % sides
                out = np.subtract(np.add(low[i], low[j]) / 2, (*place, GUARD_LOW)) * sign
                u0, u1 = i / sides, (i + 1) / sides
                mesh.face(
                    [low[i], low[j], high[j], high[i]], [(u0, 0), (u1, 0), (u1, 1), (u0, 1)], outward=out
                )
    return mesh


def rotor_mesh():
    """Build the four discs that turning rotors look like."""
    mesh = Obj()
    for place in _places():
        points, uvs = _rim(place, ROTOR_RADIUS, ROTOR_HEIGHT, 20)
        mesh.face(points, uvs, outward=(0, 0, 1))
        points, uvs = _rim(place, ROTOR_RADIUS, ROTOR_HEIGHT - 0.004, 20)
        mesh.face(points, uvs, outward=(0, 0, -1))
    return mesh


def write(directory):
    """Write drone_*.png and drone_*.obj."""
    for draw in (body, frame, rotor, guard):
        paint.save(directory / f"drone_{draw.__name__}.png", draw())
    meshes = {"body": body_mesh, "frame": frame_mesh, "rotor": rotor_mesh, "guard": guard_mesh}
    for name, build in meshes.items():
        build().save(directory / f"drone_{name}.obj")
