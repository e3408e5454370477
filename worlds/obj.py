# SPDX-License-Identifier: BSD-3-Clause
"""Flat-shaded polygon meshes, written as Wavefront OBJ."""

import numpy as np


class Obj:
    """A mesh under construction. Points are (x, y, z) in metres; u, v are 0..1, v upwards."""

    def __init__(self):
        self._positions, self._uvs, self._normals, self._faces = [], [], [], []

    def face(self, points, uvs, outward=None):
        """Add a convex polygon, counter-clockwise from outside, or turned to face `outward`."""
        points = np.asarray(points, float)
        uvs = [tuple(uv) for uv in uvs]
        normal = np.cross(points[1] - points[0], points[2] - points[0])
        if outward is not None and np.dot(normal, outward) < 0:
            points, uvs, normal = points[::-1], uvs[::-1], -normal
        first = len(self._positions) + 1
        self._positions.extend(points)
        self._uvs.extend(uvs)
        self._normals.append(normal / np.linalg.norm(normal))
        self._faces.append([(first + i, len(self._normals)) for i in range(len(points))])

    def quad(self, a, b, c, d, rectangle, outward=None, flip=False):
        """Add a rectangle: corners lower left, lower right, upper right, upper left from outside.

        `rectangle` is the texture's (left, bottom, right, top). `flip` mirrors the winding.
        """
        left, bottom, right, top = rectangle
        uvs = [(left, bottom), (right, bottom), (right, top), (left, top)]
        points = [a, b, c, d]
        if flip:
            points, uvs = points[::-1], uvs[::-1]
        self.face(points, uvs, outward)

    def triangle(self, a, b, c, rectangle, outward=None):
        """Add a triangle on half a texture rectangle."""
        left, bottom, right, top = rectangle
        self.face([a, b, c], [(left, bottom), (right, top), (right, bottom)], outward)

    def box(self, centre, size, repeats):
        """Add a box whose texture repeats so often a metre."""
        centre, half = np.array(centre, float), np.array(size, float) / 2
        for axis in range(3):
            right, up = np.zeros(3), np.zeros(3)
            u, v = (axis + 1) % 3, (axis + 2) % 3
            right[u], up[v] = half[u], half[v]
            if u == 2:  # Keep the texture's long side along x or y.
                right, up = up, right
            for side in (1, -1):
                out = np.zeros(3)
                out[axis] = side
                middle = centre + side * half[axis] * np.eye(3)[axis]
                corners = [middle - right - up, middle + right - up, middle + right + up, middle - right + up]
                w, h = 2 * np.abs(right).max() * repeats, 2 * np.abs(up).max() * repeats
                self.quad(*corners, (0, 0, w, h), outward=out)

    def save(self, path):
        """Write the file; every polygon has its own corners and one normal."""
        with open(path, "w", encoding="ascii") as file:
            for point in self._positions:
                file.write("v {:.5f} {:.5f} {:.5f}\n".format(*point))
            for uv in self._uvs:
                file.write("vt {:.5f} {:.5f}\n".format(*uv))
            for normal in self._normals:
                file.write("vn {:.5f} {:.5f} {:.5f}\n".format(*normal))
            for corners in self._faces:
                file.write("f " + " ".join(f"{p}/{p}/{n}" for p, n in corners) + "\n")
