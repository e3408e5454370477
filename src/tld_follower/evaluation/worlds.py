# SPDX-License-Identifier: BSD-3-Clause
"""Writes the world of a flight: a base world with the plan's start poses, obstacles and light."""

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from tld_follower.evaluation.graph import world_file

# Elements of a world that name a file; one that lies beside the base world is named by its whole path.
_TLD = "urn:tld_follower"
_FILES = ("uri", "albedo_map", "light_map", f"{{{_TLD}}}sky")
_TEXTURE_SIZE = {"concrete": 1.5, "container": 1.6, "barrel": 0.9, "post": 0.5}  # m; the others 1 m


class WorldError(ValueError):
    """A base world that cannot be read, or lacks what the plan needs."""


def write_world(plan, base, path):
    """Write the world of a plan.

    Parameters
    ----------
    plan : Plan
    base : path
        SDF world with both robots of the plan; its own models stay.
    path : path
        The SDF world to write.

    Raises
    ------
    WorldError
        If `base` is no SDF world with these robots.
    OSError
        If a file cannot be read or written.
    """
    ElementTree.register_namespace("tld", _TLD)
    try:
        tree = ElementTree.parse(base)
    except ElementTree.ParseError as error:
        raise WorldError(f"{base} is not XML: {error}") from error
    world = tree.getroot().find("world")
    if world is None:
        raise WorldError(f"{base} has no <world>")
    folder = Path(base).resolve().parent
    for element in world.iter():
        if element.tag in _FILES and element.text:
            file = folder / element.text.strip().removeprefix("model://").removeprefix("file://")
            if file.is_file():
                element.text = str(file)
    drone = "spiri" if plan.vehicle == "uav" else "ugv"
    for robot, pose in ((drone, plan.drone), (plan.target_robot, plan.target)):
        _place(world, robot, pose, base)
    _light(world, plan.light)
    for obstacle in plan.obstacles:
        world.append(_model(obstacle))
    tree.write(path, encoding="utf-8", xml_declaration=True)


def _numbers(*values):
    return " ".join(f"{value:.6f}" for value in values)


def _place(world, robot, pose, base):
    """Move a robot to its start; its height stays."""
    for include in world.findall("include"):
        if include.findtext("name", "").strip() == robot:
            element = include.find("pose")
            if element is None:
                element = ElementTree.SubElement(include, "pose")
            height = (element.text or "0 0 0").split()[2]
            element.text = _numbers(pose.x, pose.y, float(height), 0.0, 0.0, pose.yaw)
            return
    raise WorldError(f"{base} has no robot named '{robot}'")


def _scale(element, factor):
    *colour, alpha = map(float, element.text.split())
    element.text = _numbers(*(min(factor * value, 1.0) for value in colour), alpha)


def _light(world, light):
    """Turn, raise and dim the suns and the ambient light of a world."""
    for ambient in world.findall("scene/ambient"):
        _scale(ambient, light.ambient)
    for sun in world.findall("light[@type='directional']"):
        for diffuse in sun.findall("diffuse"):
            _scale(diffuse, light.sun)
        direction = sun.find("direction")
        x, y, z = map(float, direction.text.split())
        azimuth = math.atan2(y, x) + light.azimuth
        elevation = math.atan2(-z, math.hypot(x, y)) if light.elevation is None else light.elevation
        flat = math.cos(elevation)
        direction.text = _numbers(flat * math.cos(azimuth), flat * math.sin(azimuth), -math.sin(elevation))


def _model(obstacle):
    """Make the SDF model of an obstacle."""
    height = 0.5 * obstacle.size[2]
    if obstacle.model:
        include = ElementTree.Element("include")
        x, y, yaw = obstacle.pose(0.0)
        for tag, text in (("uri", world_file(obstacle.model)), ("name", obstacle.name), ("static", "true")):
            ElementTree.SubElement(include, tag).text = text
        ElementTree.SubElement(include, "pose").text = _numbers(x, y, 0.0, 0.0, 0.0, yaw)
        return include
    model = ElementTree.Element("model", name=obstacle.name)
    if len(obstacle.track) == 1:
        (spot,) = obstacle.track
        ElementTree.SubElement(model, "static").text = "true"
        ElementTree.SubElement(model, "pose").text = _numbers(spot.x, spot.y, height, 0.0, 0.0, spot.yaw)
    else:
        for spot in obstacle.track:
            waypoint = ElementTree.SubElement(model, f"{{{_TLD}}}waypoint")
            waypoint.text = _numbers(spot.t, spot.x, spot.y, height, 0.0, 0.0, spot.yaw)
    link = ElementTree.SubElement(model, "link", name="link")
    for kind in ("collision", "visual"):
        part = ElementTree.SubElement(link, kind, name=kind)
        geometry = ElementTree.SubElement(ElementTree.SubElement(part, "geometry"), obstacle.shape)
        if obstacle.shape == "cylinder":
            ElementTree.SubElement(geometry, "radius").text = _numbers(0.5 * obstacle.size[0])
            ElementTree.SubElement(geometry, "length").text = _numbers(obstacle.size[2])
        else:
            ElementTree.SubElement(geometry, "size").text = _numbers(*obstacle.size)
    material = ElementTree.SubElement(part, "material")
    ElementTree.SubElement(material, "diffuse").text = "1 1 1 1"
    metal = ElementTree.SubElement(ElementTree.SubElement(material, "pbr"), "metal")
    ElementTree.SubElement(metal, "albedo_map").text = f"media/{obstacle.texture}.png"
    size = ElementTree.SubElement(material, f"{{{_TLD}}}texture_size")
    size.text = _numbers(_TEXTURE_SIZE.get(obstacle.texture, 1.0))
    return model
