"""New porches that can be seen, and that leave what was observed of the house free.

A porch attribute says place and size, not what stands there: the house itself, or a known door.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..artifacts.building import Box, Building, Roof
from ..geometry.blocked import porch_strips
from ..geometry.boxes import area_perimeter, box_rectangles
from ..geometry.checks import element_rectangles, overlaps

HIDDEN = 0.9  # share of a porch's plan under the house from which nobody sees it
BESIDE = 0.5  # what overlaps a porch's front by less stands beside it (m)
SHIFTS = tuple(round(0.2 * k, 1) for k in range(-10, 11))  # tried along the wall (m)
WIDER = SHIFTS  # … with the porch wider by this (m)
LEAST = 1.2  # width of a narrowed porch (m)
STEEPEST = Roof("shed", 14.0, "y", 0.25)  # roof of a porch that reaches highest up the wall


def outside_porches(boxes: Sequence[Box], keep: Building | None) -> tuple[Box, ...]:
    """Return the boxes with new porches that are hidden in the house moved before its wall.

    Left out where they stay hidden. Boxes of `keep` stay.
    """

    def outside(porch: Box, solid: Sequence[Box]) -> Box | None:
        return _before(porch, solid) if hidden(porch, solid) else porch

    return _each_new(boxes, keep, outside)


def clear_porches(boxes: Sequence[Box], keep: Building | None) -> tuple[Box, ...]:
    """Return the boxes with new porches clear of known elements.

    One whose posts or roof would stand before a known window or door is moved or resized along the
    wall, or left out. Boxes of `keep` stay.
    """
    return _each_new(boxes, keep, lambda porch, solid: _clear(porch, solid, keep))


def _each_new(
    boxes: Sequence[Box],
    keep: Building | None,
    settled: Callable[[Box, Sequence[Box]], Box | None],
) -> tuple[Box, ...]:
    """Return the boxes with every new porch as `settled` (of it and the house) makes it."""
    known = {box.id for box in keep.boxes} if keep else set()
    solid = [box for box in boxes if box.kind != "porch"]
    found = [
        settled(box, solid) if box.kind == "porch" and box.id not in known else box for box in boxes
    ]
    return tuple(box for box in found if box is not None)


def hidden(porch: Box, solid: Sequence[Box]) -> bool:
    """Tell whether a porch lies in the house: (nearly) all of its plan is under the boxes."""
    x0, y0, x1, y1 = box_rectangles([porch])[0].tolist()
    own = box_rectangles(solid)
    width = np.minimum(own[:, 2], x1) - np.maximum(own[:, 0], x0)
    depth = np.minimum(own[:, 3], y1) - np.maximum(own[:, 1], y0)
    most = HIDDEN * porch.width * porch.depth
    if float((np.maximum(width, 0.0) * np.maximum(depth, 0.0)).sum()) < most:
        return False
    clipped = np.column_stack([np.maximum(own[:, :2], (x0, y0)), np.minimum(own[:, 2:], (x1, y1))])
    inside = clipped[(width > 0) & (depth > 0)]
    return most > 0 and float(area_perimeter(inside)[0]) >= most


def _before(porch: Box, solid: Sequence[Box]) -> Box | None:
    """Return a porch with its back at the house's front (or behind it), None if it stays hidden."""
    low, high = porch.x - porch.width / 2 + BESIDE, porch.x + porch.width / 2 - BESIDE
    walls = [b for b in solid if b.x - b.width / 2 < high and b.x + b.width / 2 > low]
    if not walls:
        return None
    rectangles = box_rectangles(solid)
    front = porch.y < (rectangles[:, 1].min() + rectangles[:, 3].max()) / 2
    edges = box_rectangles(walls)[:, 1 if front else 3]
    y = edges.min() - porch.depth / 2 if front else edges.max() + porch.depth / 2
    moved = replace(porch, y=round(float(y), 9))
    return None if hidden(moved, solid) else moved


def _clear(porch: Box, solid: Sequence[Box], keep: Building | None) -> Box | None:
    """Return the porch, or the one most like it that leaves all known elements free."""
    if keep is None or not any(p.elements for f in keep.facades.values() for p in f.pieces):
        return porch
    return next((p for p in _variants(porch) if not _collides(p, solid, keep)), None)


def _variants(porch: Box) -> Iterator[Box]:
    """Yield the porch, then moved and resized ones along x, by the sum of both changes."""
    yield porch
    for shift, wider in sorted(product(SHIFTS, WIDER), key=lambda pair: sum(map(abs, pair))):
        if (shift, wider) != (0.0, 0.0) and porch.width + wider >= LEAST:
            yield replace(porch, x=round(porch.x + shift, 9), width=round(porch.width + wider, 9))


def _collides(porch: Box, solid: Sequence[Box], keep: Building) -> bool:
    """Tell whether a post or the roof of a porch stands before a known element."""
    roofed = replace(porch, roof=STEEPEST)
    building = replace(keep, boxes=(*solid, roofed))
    for side, facade in keep.facades.items():
        for piece in facade.pieces:
            strips = porch_strips(building, roofed, side, piece)
            if overlaps(element_rectangles(piece.elements), strips).any():
                return True
    return False
