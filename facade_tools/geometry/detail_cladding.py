"""Cladding: the walls' skin a few millimetres off the mass, with texture coordinates.

The mass itself carries none, so that its vertices stay shared and it stays closed in every reader.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ..artifacts.building import Building
from .arrays import Floats, Points3
from .detail_boxes import WORLD, Box6, meshes_of
from .mesh import Mesh
from .patterns import pattern_uv
from .solids import Solid
from .triangulate import newell_normal, triangulate_face

OFFSET = 0.004  # metres off the wall
BOARD = 0.11  # width of a corner board
BOARD_DEPTH = 0.022


def wall_pattern(building: Building, color: str) -> str:
    """Return what a building's walls are made of: red walls are brick, flat-roofed ones plaster."""
    red, green, blue = bytes.fromhex(color[1:])
    if red > 1.3 * green and red > 1.5 * blue:
        return "brick"
    styles = {box.roof.style for box in building.boxes if box.kind == "general" and box.roof}
    return "" if styles == {"flat"} else "siding"


def cladding(solid: Solid, pattern: str) -> list[Mesh]:
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
    points, triangles = np.concatenate(vertices), np.concatenate(faces)
    return [Mesh("cladding", points, triangles, "wall", np.concatenate(uv))]


def corner_boards(solid: Solid, pattern: str) -> list[Mesh]:
    """Return the boards that cover the outer corners of boarded walls (axis-aligned walls only)."""
    if pattern != "siding":
        return []
    boxes = [_board(*corner) for corner in _outer_corners(solid)]
    return meshes_of("corner-boards", {"trim": boxes}, WORLD)


def _outer_corners(solid: Solid) -> Iterator[tuple[Points3, Floats]]:
    """Yield each upright edge where walls meet outward: its ends (2, 3), upward, and its way out.

    The way out (2,) is the sum of both walls' normals.
    """
    normals: dict[tuple[int, int], Floats] = {}
    for face, label in zip(solid.faces, solid.labels, strict=True):
        if label.semantic != "wall":
            continue
        normal = newell_normal(solid.vertices[list(face[0])])
        normal /= np.linalg.norm(normal)
        for ring in face:
            for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
                ends = solid.vertices[[a, b]]
                if np.abs(ends[0, :2] - ends[1, :2]).max() > 1e-6:
                    continue
                # Seen from outside, a wall's right edge runs up; beyond it stands the next wall.
                if (b, a) in normals:
                    up, down = (normal, normals[b, a])
                    if ends[1, 2] < ends[0, 2]:
                        up, down = down, up
                    if up[0] * down[1] - up[1] * down[0] > 0.9:
                        yield ends[np.argsort(ends[:, 2])], (up + down)[:2]
                normals[a, b] = normal


def _board(ends: Points3, out: Floats) -> Box6:
    (x, y, low), high = ends[0], ends[1, 2]
    near, far = out * BOARD_DEPTH, -out * BOARD
    (x0, x1), (y0, y1) = sorted((near[0], far[0])), sorted((near[1], far[1]))
    return (x + x0, y + y0, low, x + x1, y + y1, high)
