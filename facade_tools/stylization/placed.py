"""A source block on a target block: where its places go, its plans and the corners of its faces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.blocks import Block
from ..artifacts.stylesheet import StyleBlock, StyleFace, StyleSheet
from ..geometry.arrays import Floats
from .remesh import Slab, on_grid, trimmed
from .storeys import Storey, cells

TOUCH = 1e-6  # m
Knots = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True)
class Placed:
    """A source block on a target block.

    maps: for x and y, places in the source block (m) and where they go (m, absolute).
    """

    target: Block
    source: StyleBlock
    storeys: tuple[Storey, ...]
    maps: tuple[Knots, Knots]

    def moved(self, axis: int, places: Floats) -> Floats:
        """Return where places (m) of the source block go along an axis (0 x, 1 y)."""
        old, new = self.maps[axis]
        inside: Floats = np.interp(places, old, new)
        return inside


def placed_slabs(sheet: StyleSheet, placed: Placed) -> list[Slab]:
    """Return the plans of a placed block's storeys, in the target's coordinates."""
    slabs = []
    for storey in placed.storeys:
        floor = sheet.floors[storey.floor]
        xs, ys = (placed.moved(a, np.array(v)) for a, v in enumerate((floor.xs, floor.ys)))
        plan = _without_nothing(Slab(storey.bottom, storey.top, xs, ys, cells(floor)))
        if storey.boxed:
            sides = sides_of(placed.target)
            plan = Slab(storey.bottom, storey.top, *sides, np.ones((1, 1), dtype=bool))
        if not plan.cells.any():
            continue
        closed = _with_box(plan, *sides_of(placed.target)) if storey.lintel else plan
        if closed.area > plan.area + TOUCH:
            foot = storey.top - storey.lintel
            slabs.append(replace(plan, top=foot))
            plan = replace(closed, bottom=foot)
        slabs.append(plan)
    return slabs


def face_corners(placed: Placed, storey: Storey, face: StyleFace, side: str) -> Floats:
    """Return the corners (4, 3) of a face in the target: lower left, lower right, upper ones.

    On a storey that fills its block a face is the whole side.
    """
    axis = 0 if side in ("front", "back") else 1
    corners = np.empty((4, 3))
    if storey.boxed:
        sides = sides_of(placed.target)
        start, end = sides[axis].tolist()[:: 1 if side in ("front", "right") else -1]
        place = sides[1 - axis][0 if side in ("front", "left") else 1]
    else:
        start, end = placed.moved(axis, np.array([face.start, face.end])).tolist()
        place = placed.moved(1 - axis, np.array([face.place]))[0]
    corners[:, axis] = [start, end, end, start]
    corners[:, 1 - axis] = place
    corners[:, 2] = [storey.bottom, storey.bottom, storey.top, storey.top]
    return corners


def sides_of(block: Block) -> tuple[Floats, Floats]:
    """Return where a block begins and ends along x and y (m)."""
    xs, ys = (block.x, block.x + block.width), (block.y, block.y + block.depth)
    return np.array(xs), np.array(ys)


def _with_box(plan: Slab, xs: Floats, ys: Floats) -> Slab:
    """Return a plan with a box (its ends along x and y) added to it."""
    lines, rows = np.union1d(plan.xs, xs), np.union1d(plan.ys, ys)
    x, y = (0.5 * (v[1:] + v[:-1]) for v in (lines, rows))
    inside = ((y > ys[0]) & (y < ys[-1]))[:, None] & ((x > xs[0]) & (x < xs[-1]))
    whole = Slab(plan.bottom, plan.top, lines, rows, on_grid(plan, lines, rows) | inside)
    return _without_nothing(whole)


def _without_nothing(slab: Slab) -> Slab:
    """Drop rows and columns that are squeezed to nothing."""
    columns, rows = np.diff(slab.xs) > TOUCH, np.diff(slab.ys) > TOUCH
    xs = np.append(slab.xs[:-1][columns], slab.xs[-1])
    ys = np.append(slab.ys[:-1][rows], slab.ys[-1])
    return trimmed(replace(slab, xs=xs, ys=ys, cells=slab.cells[np.ix_(rows, columns)]))
