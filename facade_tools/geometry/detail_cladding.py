"""Cladding: the walls' skin a few millimetres off the mass, with texture coordinates.

The mass itself carries none, so that its vertices stay shared and it stays closed in every reader.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..artifacts.building import Building
from .mesh import Mesh
from .patterns import pattern_uv
from .solids import Solid
from .triangulate import newell_normal, triangulate_face

OFFSET = 0.004  # metres off the wall


def wall_pattern(building: Building, color: str) -> str:
    """Return what a building's walls are made of: red walls are brick, flat-roofed ones plaster."""
    red, green, blue = bytes.fromhex(color[1:])
    if red > 1.6 * green and red > 1.6 * blue:
        return "brick"
    styles = {box.roof.style for box in building.boxes if box.kind == "general" and box.roof}
    return "" if styles == {"flat"} else "siding"


def cladding(solid: Solid, pattern: str, name: str = "cladding") -> list[Mesh]:
    """Return the skin of all walls in a pattern; no pattern needs none."""
    vertices, faces, uv = [], [], []
    count = 0
    for face, label in zip(solid.faces, solid.labels, strict=True):
        if label.semantic != "wall" or not pattern:
            continue
        index = np.array([vertex for ring in face for vertex in ring], dtype=np.int64)
        points = solid.vertices[index]
        normal = newell_normal(solid.vertices[list(face[0])])
        normal /= np.linalg.norm(normal)
        ends = np.cumsum([0, *map(len, face)])
        local = [np.arange(a, b, dtype=np.int64) for a, b in pairwise(ends)]
        vertices.append(points + OFFSET * normal)
        faces.append(triangulate_face(points, local) + count)
        uv.append(pattern_uv(pattern, points, normal))
        count += len(points)
    if not vertices:
        return []
    return [Mesh(name, np.concatenate(vertices), np.concatenate(faces), "wall", np.concatenate(uv))]
