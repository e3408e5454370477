# SPDX-License-Identifier: BSD-3-Clause
"""The world `corridor`: two walls, boxes along both, doorways to pass."""

from sdf import World

LENGTH, WIDTH, HEIGHT, WALL = 30.0, 3.2, 2.2, 0.25
DOORS = ((10.0, 0.0), (20.0, 0.35))  # Where along the corridor, and how far left of its middle.
DOOR_WIDTH, DOOR_HEIGHT = 1.3, 1.9
BOXES = ((2.5, 1), (5.0, -1), (7.0, 1), (12.5, -1), (14.5, 1), (17.0, -1), (22.5, 1), (25.0, -1), (27.0, 1))


def write(directory):
    """Write corridor.world."""
    world = World(
        "corridor",
        "corridor.py",
        f"A corridor of {WIDTH:g} m along x with boxes on both sides; doorways {DOOR_WIDTH:g} m wide at x = "
        f"{' and '.join(f'{x:g}' for x, _ in DOORS)} m.",
    )
    world.ground(13)
    world.robot("spiri", "spiri", -1.5, 0, 0.0405)
    world.robot("husky", "husky", 0, 0, 0.1325)
    start = -4.0
    middle = (start + LENGTH) / 2
    for side, texture in ((1, "brick"), (-1, "concrete")):
        world.box("wall", (middle, side * (WIDTH + WALL) / 2, 0), (LENGTH - start, WALL, HEIGHT), texture)
    world.box("end", (LENGTH + WALL / 2, 0, 0), (WALL, WIDTH + 2 * WALL, HEIGHT), "brick")
    for x, shift in DOORS:
        for side in (1, -1):
            edge = shift + side * DOOR_WIDTH / 2
            width = WIDTH / 2 - side * edge
            world.box("door_side", (x, edge + side * width / 2, 0), (WALL, width, HEIGHT), "stone")
        lintel = (WALL, DOOR_WIDTH, HEIGHT - DOOR_HEIGHT)
        world.box("lintel", (x, shift, DOOR_HEIGHT), lintel, "stone")
    for i, (x, side) in enumerate(BOXES):
        edge = (0.6, 0.45, 0.75)[i % 3]
        place = (x, side * (WIDTH / 2 - edge / 2 - 0.08), 0)
        if i % 4 == 3:
            world.cylinder("barrel", place, edge / 2, 0.9, "barrel")
        else:
            world.box("crate", place, (edge, edge, edge), "crate", 0.1 * (i % 3 - 1))
    world.write(directory / "corridor.world")
