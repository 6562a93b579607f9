"""Blocks on blocks: walls thinned under overhangs, edges snapped to those below.

LNSW13 5.1.2 and 5.2.1. Blocks that stand on each other as their sources do stay as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..artifacts.blocks import Block, Blocks
from ..artifacts.stylesheet import StyleSheet
from ..geometry.arrays import Floats
from .placed import TOUCH, Placed, placed_slabs, sides_of
from .remesh import on_grid
from .snapping import snapped, unsqueezed

SUPPORT = 0.9  # of the distance of the outer boundaries: thickness of a wall under an overhang
FLUSH = 0.05  # m: walls nearer than that stand in one plane, and thinning would take all relief
OUTER = 0.25  # of a block, in which its walls stand
ACROSS = (("left", "right"), ("front", "back"))  # the sides where the axes x and y begin and end


def foreign_blocks(own: Blocks, placed: Sequence[Placed]) -> list[int]:
    """Return the placed blocks that stand on others unlike their sources do."""
    return [j for i, j in stacked(placed) if not stands_as_source(own, placed[i], placed[j])]


def stacked(placed: Sequence[Placed]) -> list[tuple[int, int]]:
    """Return the pairs (lower, upper) of blocks that stand on each other."""
    pairs = []
    for i, lower in enumerate(placed):
        for j, upper in enumerate(placed):
            a, b = lower.target, upper.target
            if abs(a.z + a.height - b.z) < 1e-3 and _overlap(a, b):
                pairs.append((i, j))
    return pairs


def stands_as_source(own: Blocks, lower: Placed, upper: Placed) -> bool:
    """Tell whether two blocks stand on each other as their sources do, up to scale."""
    sources = {block.id: block for block in own.blocks}
    a, b = sources[lower.source.id], sources[upper.source.id]
    if abs(a.z + a.height - b.z) > 1e-3 * max(a.height, b.height) or not _overlap(a, b):
        return False
    return all(
        np.allclose(_relation(lower.target, upper.target, k), _relation(a, b, k), atol=1e-3)
        for k in (0, 1)
    )


def _relation(lower: Block, upper: Block, axis: int) -> tuple[float, float]:
    """Return where an upper block begins and ends along an axis, as shares of the lower one."""
    start, size = (lower.x, lower.width) if axis == 0 else (lower.y, lower.depth)
    low, length = (upper.x, upper.width) if axis == 0 else (upper.y, upper.depth)
    return (low - start) / size, (low + length - start) / size


def _overlap(a: Block, b: Block) -> bool:
    return (
        min(a.x + a.width, b.x + b.width) - max(a.x, b.x) > TOUCH
        and min(a.y + a.depth, b.y + b.depth) - max(a.y, b.y) > TOUCH
    )


def supported(sheet: StyleSheet, placed: list[Placed], pair: tuple[int, int]) -> None:
    """Thin the lower block's walls where the upper one would reach over them (Fig. 11)."""
    lower, upper = placed[pair[0]], placed[pair[1]]
    reaching = _overhanging(sheet, lower, upper)
    maps = []
    for axis, sides in enumerate(ACROSS):
        old, new = lower.maps[axis]
        size = float(old[-1])
        thickness = [wall_thickness(sheet, lower.source.id, side) for side in sides]
        ends = [_outer(sheet, upper, axis, side) for side in sides]
        low = _thinned(lower, axis, thickness[0], ends[0]) if sides[0] in reaching else []
        inside = (size - thickness[1][0], size - thickness[1][1])
        high = _thinned(lower, axis, inside, ends[1]) if sides[1] in reaching else []
        knots = [*low, *high[::-1]]
        places = [place for place, _ in knots]
        ordered = all(a < b for a, b in pairwise(places))
        if knots and ordered and places[0] > 0 and places[-1] < size:
            old = np.array([old[0], *places, old[-1]])
            new = np.array([new[0], *(value for _, value in knots), new[-1]])
        maps.append((old, np.maximum.accumulate(new)))
    placed[pair[0]] = replace(lower, maps=(maps[0], maps[1]))


def _overhanging(sheet: StyleSheet, lower: Placed, upper: Placed) -> set[str]:
    """Return the sides on which an upper block stands over what the floor below it leaves open."""
    below, above = placed_slabs(sheet, lower), placed_slabs(sheet, upper)
    if not below or not above:
        return set()
    lines = (below[-1].xs, above[0].xs), (below[-1].ys, above[0].ys)
    xs, ys = (
        np.unique(np.clip(np.union1d(*pair), *sides))
        for pair, sides in zip(lines, sides_of(lower.target), strict=True)
    )
    filled, over = on_grid(below[-1], xs, ys), on_grid(above[0], xs, ys)
    least = FLUSH * max(lower.target.width, lower.target.depth)
    found = set()
    for side, axis, step in (("left", 1, 1), ("right", 1, -1), ("front", 0, 1), ("back", 0, -1)):
        # seen from the side, before the lower floor's wall
        order = np.s_[::step, :] if axis == 0 else np.s_[:, ::step]
        before = ~np.logical_or.accumulate(filled[order], axis=axis)[order]
        if float(np.diff(ys) @ (over & before) @ np.diff(xs)) > least:
            found.add(side)
    return found


def wall_thickness(sheet: StyleSheet, block: str, side: str) -> tuple[float, float]:
    """Return how far inside a block's side its wall begins and ends (m)."""
    wall = next(w for w in sheet.walls if w.block == block and w.side == side)
    return wall.thickness.outer, wall.thickness.inner


def _outer(sheet: StyleSheet, upper: Placed, axis: int, side: str) -> float:
    """Return where the upper block's outer boundary on a side is (m, absolute)."""
    outer = wall_thickness(sheet, upper.source.id, side)[0]
    size = upper.source.size[axis]
    place = outer if side in ("left", "front") else size - outer
    return float(upper.moved(axis, np.array([place]))[0])


def _thinned(
    lower: Placed, axis: int, bounds: tuple[float, float], reach: float
) -> list[tuple[float, float]]:
    """Return knots of a wall's inner boundary where the upper wall lies within its thickness.

    What is deeper than the outer quarter of the block is a court or a wing, no wall.
    """
    if abs(bounds[1] - bounds[0]) > OUTER * float(lower.maps[axis][0][-1]):
        return []
    outer, inner = lower.moved(axis, np.array(bounds)).tolist()
    distance = reach - outer if bounds[1] > bounds[0] else outer - reach
    thickness = abs(inner - outer)
    if not FLUSH < distance < thickness:
        return []
    sign = 1.0 if bounds[1] > bounds[0] else -1.0
    knots = [(bounds[0], outer), (bounds[1], outer + sign * SUPPORT * distance)]
    return [knot for knot in knots if 0 < knot[0] < float(lower.maps[axis][0][-1])]


def snapped_onto(sheet: StyleSheet, lower: Placed, upper: Placed) -> Placed:
    """Snap the vertical edges of an upper block to those of the block below, view by view."""
    below, above = placed_slabs(sheet, lower), placed_slabs(sheet, upper)
    if not below or not above:
        return upper
    maps = []
    for axis in (0, 1):
        old, new = upper.maps[axis]
        places = _edges(sheet, upper, axis)
        start, end = float(new[0]), float(new[-1])
        goal = below[-1].xs if axis == 0 else below[-1].ys
        goal = goal[(goal > start + TOUCH) & (goal < end - TOUCH)]
        stood = upper.moved(axis, places)
        moved = unsqueezed(stood, snapped(stood, goal, end - start), (start, end))
        maps.append(
            (
                np.concatenate([old[:1], places, old[-1:]]),
                np.concatenate([new[:1], moved, new[-1:]]),
            )
        )
    return replace(upper, maps=(maps[0], maps[1]))


def _edges(sheet: StyleSheet, placed: Placed, axis: int) -> Floats:
    """Return all places of a block's vertical edges strictly between its ends (m, source)."""
    lines = [
        floor.xs if axis == 0 else floor.ys
        for floor in sheet.floors
        if floor.block == placed.source.id
    ]
    places = np.unique(np.concatenate([np.array(line) for line in lines]))
    size = placed.source.size[axis]
    return np.asarray(places[(places > TOUCH) & (places < size - TOUCH)])
