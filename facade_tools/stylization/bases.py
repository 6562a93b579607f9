"""Base models of a retarget: blocks, from a building's boxes or from another mesh (LNSW13 4.2)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..artifacts.blocks import Block, BlockRole, Blocks
from ..artifacts.building import Box, Building
from ..artifacts.layout import Layout
from ..errors import InvalidInput
from ..formats.exporting import FAR
from ..formats.textured import TexturedMesh
from ..geometry.arrays import Floats
from .model import CaptureOptions, modelled

Rectangle = tuple[float, float, float, float]
STOREY = 3.0  # m
THINNEST = 1e-6  # of the axes' box: a frame that squeezes it further is singular
HOUSE_DEPTH = 10.0  # m behind a layout's canvas
BAY, BAY_DEPTH = 2.0, 0.5  # m: least width and height, and depth, of a bay


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
    return Blocks(building.id, tuple(blocks), frame_of(building))


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


def layout_blocks(layout: Layout) -> Blocks:
    """Return a layout as the front of a house: the canvas 10 m deep, its bays standing forward.

    A bay is a visible shape at least 2 m wide and high and half a metre deep; finer shapes are
    ornaments, which the style brings itself.
    """
    width, height = layout.canvas.width, layout.canvas.height
    floors = max(1, round(height / STOREY))
    blocks = [Block("canvas", "body", 0.0, 0.0, 0.0, width, HOUSE_DEPTH, height, floors)]
    for number, shape in enumerate(layout.shapes):
        x, z = shape.x0, shape.y0
        size = shape.x1 - x, shape.depth, shape.y1 - z
        if shape.visible and min(size[0], size[2]) >= BAY and size[1] >= BAY_DEPTH:
            floors = max(1, round(size[2] / STOREY))
            name = f"{shape.layer}-{number}"
            blocks.append(Block(name, "body", x, -size[1], z, *size, floors))
    return Blocks(layout.id, tuple(blocks))


def with_ends(base: Blocks, style: Blocks) -> Blocks:
    """Return a base without roles with a bottom and a top cut off its blocks as the style has them.

    What stands on the ground gets a bottom as high as the style's (its shops), what is open to
    the sky a top as high as the style's where that is as wide as its body (an attic, no lift
    house); each only where at least twice as much is left between. A base with roles is kept.
    """
    if any(block.role != "body" for block in base.blocks):
        return base
    low, high = _end_height(style, "bottom"), _end_height(style, "top")
    ground = min(block.z for block in base.blocks)
    blocks: list[Block] = []
    for block in base.blocks:
        foot = low if block.z < ground + 0.1 else 0.0
        head = 0.0 if any(_stands_on(other, block) for other in base.blocks) else high
        blocks += _with_ends(block, foot, head)
    return replace(base, blocks=tuple(blocks))


def _end_height(style: Blocks, role: str) -> float:
    """Return the height (m) of a style's bottom or top; 0 where it has none or a narrow one."""
    ends = [block for block in style.blocks if block.role == role]
    area = sum(block.width * block.depth for block in ends)
    body = max((b.width * b.depth for b in style.blocks if b.role == "body"), default=0.0)
    if not ends or area < 0.6 * body:
        return 0.0
    return max(b.z + b.height for b in ends) - min(b.z for b in ends)


def _stands_on(upper: Block, lower: Block) -> bool:
    return (
        abs(lower.z + lower.height - upper.z) < 1e-3
        and min(lower.x + lower.width, upper.x + upper.width) > max(lower.x, upper.x)
        and min(lower.y + lower.depth, upper.y + upper.depth) > max(lower.y, upper.y)
    )


def _with_ends(block: Block, foot: float, head: float) -> list[Block]:
    foot = foot if block.height >= 3 * foot else 0.0
    head = head if block.height - foot >= 3 * head else 0.0
    middle = block.height - foot - head
    levels: list[tuple[BlockRole, float]] = [("bottom", foot), ("body", middle), ("top", head)]
    parts, z = [], block.z
    for role, height in levels:
        if height > 0:
            name = block.id if role == "body" else f"{block.id}-{role}"
            floors = max(1, round(block.floors * height / block.height))
            parts.append(replace(block, id=name, role=role, z=z, height=height, floors=floors))
        z += height
    return parts


def frame_of(building: Building) -> tuple[tuple[float, ...], ...] | None:
    """Return where a building stands (4, 4), None where it does not say."""
    if building.frame is None:
        return None
    angle = math.radians(building.frame.rotation)
    c, s = math.cos(angle), math.sin(angle)
    matrix: Floats = np.eye(4)
    matrix[:2, :2] = [[c, -s], [s, c]]
    matrix[:3, 3] = building.frame.shift
    return tuple(tuple(row) for row in matrix.tolist())


def blocks_problems(blocks: Blocks) -> Iterator[tuple[str, str]]:
    """Yield pointer and message of what the schema cannot see: ids that stand twice, the frame."""
    seen: set[str] = set()
    for i, block in enumerate(blocks.blocks):
        if block.id in seen:
            yield f"/blocks/{i}/id", f"id {block.id!r} stands twice; expected unique ids"
        seen.add(block.id)
    if blocks.frame is not None and not _is_frame(np.array(blocks.frame, dtype=np.float64)):
        yield "/frame", "is singular or projective; expected an invertible affine 4×4 matrix"


def check_blocks(blocks: Blocks) -> None:
    """Raise InvalidInput, with the pointer, on the first of the problems of blocks."""
    for pointer, message in blocks_problems(blocks):
        raise InvalidInput(message, pointer=pointer)


def _is_frame(matrix: Floats) -> bool:
    """Tell whether no axis is squeezed to nothing, and the last row is 0 0 0 1."""
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    volume = abs(float(np.linalg.det(matrix[:3, :3])))
    affine = np.allclose(matrix[3], [0, 0, 0, 1], rtol=0, atol=1e-9)
    return bool(affine and volume > THINNEST * math.prod(lengths.tolist()) > 0)


def mesh_blocks(mesh: TexturedMesh, identity: str, up: str = "auto") -> Blocks:
    """Return the blocks of a mesh (m) by structure detection, in its own frame.

    up: its upward axis, "y" or "z"; "auto" asks the textures.
    """
    return modelled(mesh, identity, CaptureOptions(up=up)).blocks


def brought_near(base: Blocks, building: Building | None) -> tuple[Blocks, Building | None, Floats]:
    """Return a base whose frame has no far shift, and that shift (3,), m.

    What is computed and compared in single precision would be a ruin at a map's coordinates.
    """
    step: Floats = np.zeros(3)
    if base.frame is None:
        return base, building, step
    frame = np.array(base.frame, dtype=np.float64)
    if np.abs(frame[:3, 3]).max() <= FAR:
        return base, building, step
    step, frame[:3, 3] = frame[:3, 3].copy(), 0.0
    base = replace(base, frame=tuple(tuple(row) for row in frame.tolist()))
    if building is not None and building.frame is not None:
        building = replace(building, frame=replace(building.frame, shift=(0.0, 0.0, 0.0)))
    return base, building, step
