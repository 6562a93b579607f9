"""Storeys at the heights of a target block: like ones are inserted or left out, not stretched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..artifacts.blocks import Block
from ..artifacts.stylesheet import StyleBlock, StyleFloor, StyleSheet
from ..geometry.arrays import Floats
from .remesh import Slab, plan_difference

SAME = 0.02  # share of the plan, of the height: storeys that differ less are one storey repeated
LEAST_STOREY = 2.0  # m
SMALL_STOREY = 1 / 60  # of the highest block, in a model that is not in metres
MOSTLY = 0.5  # of a block's height, that storeys in such a model make up


@dataclass(frozen=True, slots=True)
class Storey:
    """A floor of the source put between two heights of the target (m, absolute).

    boxed: it fills its block, and each side shows one face. lintel: height (m) below its top in
    which it fills its block, so that a roof stands on it.
    """

    floor: int
    bottom: float
    top: float
    boxed: bool = False
    lintel: float = 0.0


def cells(floor: StyleFloor) -> np.ndarray:
    """Return the plan of a floor as a mask (len(ys) − 1, len(xs) − 1)."""
    return np.array([[cell == "1" for cell in row] for row in floor.cells], dtype=bool)


def storeys(sheet: StyleSheet, source: StyleBlock, block: Block) -> tuple[Storey, ...]:
    """Return a block's floors at their new heights: like storeys repeated as often as fits best."""
    floors = [i for i, floor in enumerate(sheet.floors) if floor.block == source.id]
    first, unit, repeats = _run_of_storeys(sheet, floors)
    order = floors
    if repeats > 1:
        lengths = [sheet.floors[i].top - sheet.floors[i].bottom for i in floors]
        one = sum(lengths[first : first + unit * repeats]) / repeats
        fixed = sum(lengths) - one * repeats
        wanted = max(1, round((block.height - fixed) / one))
        inner = [floors[first + k % (unit * repeats)] for k in range(unit * wanted)]
        order = [*floors[:first], *inner, *floors[first + unit * repeats :]]
    heights = np.array([sheet.floors[i].top - sheet.floors[i].bottom for i in order])
    even = heights * block.height / heights.sum()
    stretched = even if repeats > 1 else _stretched(heights, block.height)
    levels = block.z + np.concatenate([[0.0], np.cumsum(stretched)])
    return tuple(
        Storey(floor, float(bottom), float(top))
        for floor, bottom, top in zip(order, levels[:-1], levels[1:], strict=True)
    )


def _stretched(heights: Floats, target: float) -> Floats:
    """Return the heights (m) of slabs, none of them repeated, that fill a target.

    Where storeys make up most of a block that grows, sign boards and mouldings keep their height.
    """
    high = heights >= LEAST_STOREY
    low = float(heights[~high].sum())
    if target > heights.sum() and heights[high].sum() > MOSTLY * heights.sum():
        return np.where(high, heights * (target - low) / heights[high].sum(), heights)
    return np.asarray(heights * target / heights.sum())


def _run_of_storeys(sheet: StyleSheet, floors: Sequence[int]) -> tuple[int, int, int]:
    """Return first floor, floors a storey, and number of storeys of the highest run of like ones.

    A storey may be several slabs (a window band, a parapet); like ones agree in height and plan.
    Sign boards and mouldings that lie on each other like storeys are none: they are too low.
    """
    plans = [_plan(sheet.floors[i]) for i in floors]
    whole = sum(plan.height for plan in plans)
    best = (0.0, 0, 1, 1)
    for unit in range(1, min(6, len(plans) // 2) + 1):
        like = [_like(plans[k], plans[k + unit]) for k in range(len(plans) - unit)]
        start = 0
        for k in range(len(like) + 1):
            if k < len(like) and like[k]:
                continue
            repeats = (k - start) // unit + 1 if k > start else 1
            height = sum(plan.height for plan in plans[start : start + unit * repeats])
            high = height / repeats >= _least_storey(sheet, whole, height)
            if repeats > 1 and high and height > best[0] * 1.01:
                best = (height, start, unit, repeats)
            start = k + 1
    return best[1:]


def _least_storey(sheet: StyleSheet, block: float, run: float) -> float:
    """Return the least height (m) of a storey, of which a run (m) stands in a block (m high).

    Where they are most of the block, storeys may be lower: the model need not be in metres.
    """
    highest = max(source.size[2] for source in sheet.blocks)
    return min(LEAST_STOREY, SMALL_STOREY * highest) if run > MOSTLY * block else LEAST_STOREY


def _plan(floor: StyleFloor) -> Slab:
    return Slab(floor.bottom, floor.top, np.array(floor.xs), np.array(floor.ys), cells(floor))


def _like(a: Slab, b: Slab) -> bool:
    return abs(a.height - b.height) < SAME * max(a.height, b.height) + 0.05 and (
        plan_difference(a, b) < SAME
    )
