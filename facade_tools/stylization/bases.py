"""Base models of a retarget: blocks, from a building's boxes or from another mesh (LNSW13 4.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..artifacts.blocks import Block, Blocks
from ..artifacts.building import Box, Building
from ..formats.textured import TexturedMesh
from ..geometry.arrays import Floats
from .model import CaptureOptions, modelled

Rectangle = tuple[float, float, float, float]


def building_blocks(building: Building) -> Blocks:
    """Return the mass of a building as disjoint blocks: where boxes overlap the highest stays.

    Garages and porches' roofs are left to their own stages: only general and garage boxes count.
    """
    boxes = [box for box in building.boxes if box.kind != "porch" and box.height]
    boxes.sort(key=lambda box: (-(box.height or 0.0), box.id))
    taken: list[Rectangle] = []
    blocks: list[Block] = []
    for box in boxes:
        for rectangle in _minus(_rectangle(box), taken):
            blocks.append(_block(box, rectangle, len(blocks), building.storey_height))
            taken.append(rectangle)
    return Blocks(building.id, tuple(blocks), _frame(building))


def _rectangle(box: Box) -> Rectangle:
    x, y, w, d = box.x, box.y, box.width / 2, box.depth / 2
    return x - w, y - d, x + w, y + d


def _minus(rectangle: Rectangle, holes: Sequence[Rectangle]) -> list[Rectangle]:
    """Return disjoint rectangles that cover what the holes leave of a rectangle."""
    left = [rectangle]
    for hole in holes:
        left = [part for piece in left for part in _cut(piece, hole)]
    return left


def _cut(a: Rectangle, b: Rectangle) -> list[Rectangle]:
    x0, y0, x1, y1 = max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])
    if x1 - x0 < 1e-6 or y1 - y0 < 1e-6:
        return [a]
    parts = [
        (a[0], a[1], a[2], y0),
        (a[0], y1, a[2], a[3]),
        (a[0], y0, x0, y1),
        (x1, y0, a[2], y1),
    ]
    return [p for p in parts if p[2] - p[0] > 1e-6 and p[3] - p[1] > 1e-6]


def _block(box: Box, rectangle: Rectangle, number: int, storey: float) -> Block:
    x0, y0, x1, y1 = rectangle
    height = float(box.height or 0.0)
    floors = max(1, round(height / storey))
    name = f"{box.id}-{number}"
    return Block(name, "body", x0, y0, 0.0, x1 - x0, y1 - y0, height, floors)


def _frame(building: Building) -> tuple[tuple[float, ...], ...] | None:
    if building.frame is None:
        return None
    angle = math.radians(building.frame.rotation)
    c, s = math.cos(angle), math.sin(angle)
    matrix: Floats = np.eye(4)
    matrix[:2, :2] = [[c, -s], [s, c]]
    matrix[:3, 3] = building.frame.shift
    return tuple(tuple(row) for row in matrix.tolist())


def mesh_blocks(mesh: TexturedMesh, identity: str) -> Blocks:
    """Return the blocks of a mesh by structure detection, in its own frame."""
    return modelled(mesh, identity, CaptureOptions()).blocks
