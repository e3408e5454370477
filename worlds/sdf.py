# SPDX-License-Identifier: BSD-3-Clause
"""Worlds written as SDF 1.6: open ground, the robots, and obstacles that stand on it."""

HEAD = """<?xml version="1.0"?>
<!-- SPDX-License-Identifier: BSD-3-Clause -->
<!-- {comment} Written by worlds/{script}. -->
<sdf version="1.6" xmlns:tld="urn:tld_follower">
  <world name="{name}">
    <gravity>0 0 -9.81</gravity>
    <scene>
      <ambient>0.52 0.54 0.58 1</ambient>
      <background>0.62 0.72 0.85 1</background>
      <shadows>true</shadows>
    </scene>
    <tld:sky>media/sky.png</tld:sky>
    <light type="directional" name="sun">
      <pose>0 0 30 0 0 0</pose>
      <diffuse>0.72 0.69 0.62 1</diffuse>
      <specular>0 0 0 1</specular>
      <direction>0.45 -0.40 -0.80</direction>
    </light>
"""
MODEL = """
    <model name="{name}">
      <static>true</static><pose>{pose}</pose>
      <link name="link">
        <collision name="collision"><geometry>{geometry}</geometry></collision>
        <visual name="visual">
          <geometry>{geometry}</geometry><material>
            <diffuse>1 1 1 1</diffuse><tld:texture_size>{repeat:g}</tld:texture_size>
            <pbr><metal><albedo_map>media/{texture}.png</albedo_map>{light_map}</metal></pbr>
          </material>
        </visual>
      </link>
    </model>
"""
ROBOT = """
    <include>
      <uri>model://{file}.urdf</uri>
      <name>{name}</name>
      <pose>{pose}</pose>
    </include>
"""
# Edge of one repeat of each texture, m.
REPEATS = {
    "ground": 3,
    "brick": 1,
    "concrete": 1.5,
    "crate": 1,
    "container": 1.6,
    "barrel": 0.9,
    "post": 0.5,
    "stone": 2,
}


def _numbers(values):
    return " ".join(f"{round(float(value), 4):g}" for value in values)


class World:
    """A world under construction. Lengths in metres, angles in rad; z is up."""

    def __init__(self, name, script, comment):
        self._text = [HEAD.format(name=name, script=script, comment=comment)]
        self._count = {}

    def _model(self, name, pose, geometry, texture, light_map=None):
        light = f'<light_map uv_set="1">media/{light_map}.png</light_map>' if light_map else ""
        self._text.append(
            MODEL.format(
                name=name,
                pose=_numbers(pose),
                geometry=geometry,
                texture=texture,
                repeat=REPEATS[texture],
                light_map=light,
            )
        )

    def _number(self, kind):
        self._count[kind] = self._count.get(kind, 0) + 1
        return f"{kind}_{self._count[kind]}"

    def ground(self, x, z=0.0):
        """Add 120 m of open ground about x."""
        geometry = "<plane><normal>0 0 1</normal><size>120 120</size></plane>"
        self._model("ground", (x, 0, z, 0, 0, 0), geometry, "ground", "ground_map")

    def terrain(self, image, size, light_map):
        """Add a heightmap about the origin; size x, y and the height of white."""
        geometry = f"<heightmap><uri>media/{image}.png</uri><size>{_numbers(size)}</size></heightmap>"
        self._model("terrain", (0,) * 6, geometry, "ground", light_map)

    def robot(self, name, file, x, y, z, yaw=0.0):
        """Place a robot; its name says what it is (doc/gazebo.md)."""
        self._text.append(ROBOT.format(name=name, file=file, pose=_numbers((x, y, z, 0, 0, yaw))))

    def box(self, kind, place, size, texture, yaw=0.0):
        """Add a box of `size` whose lowest face is at `place`'s z."""
        x, y, z = place
        geometry = f"<box><size>{_numbers(size)}</size></box>"
        self._model(self._number(kind), (x, y, z + size[2] / 2, 0, 0, yaw), geometry, texture)

    def cylinder(self, kind, place, radius, length, texture):
        """Add an upright cylinder whose lower end is at `place`'s z."""
        x, y, z = place
        geometry = f"<cylinder><radius>{radius:g}</radius><length>{length:g}</length></cylinder>"
        self._model(self._number(kind), (x, y, z + length / 2, 0, 0, 0), geometry, texture)

    def write(self, path):
        """Write the file."""
        path.write_text("".join(self._text) + "  </world>\n</sdf>\n", encoding="ascii")
