"""Masses as candidates, and a choice of them that differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..artifacts.building import Box
from ..geometry.arrays import Rectangles
from ..geometry.boxes import area_perimeter, box_rectangles

LEAST_DISTANCE = 0.05  # of two masses (`mass_distance`)
RELAXED = (LEAST_DISTANCE, 0.02, 0.005, 1e-4)


@dataclass(frozen=True, slots=True)
class Mass:
    """Boxes of one mass, their energy, and its shares by attribute group.

    curve: the search's (layouts polished, least energy) wherever that fell.
    """

    boxes: tuple[Box, ...]
    energy: float
    shares: dict[str, float]
    curve: tuple[tuple[int, float], ...] = ()


def mass_distance(a: Sequence[Box], b: Sequence[Box]) -> float:
    """Return 1 − |A ∩ B| / |A ∪ B| of two masses as solids without roofs, porches included.

    Both are taken where they stand; 0: equal, 1: apart.
    """
    levels = sorted({0.0, *(box.height or 0.0 for box in (*a, *b))})
    common = whole = 0.0
    for low, high in pairwise(levels):
        first, second = (_above(boxes, low) for boxes in (a, b))
        union = area_perimeter(np.vstack([first, second]))[0]
        both = area_perimeter(first)[0] + area_perimeter(second)[0] - union
        common += (high - low) * both
        whole += (high - low) * union
    return 1.0 - common / whole if whole else 0.0


def _above(boxes: Sequence[Box], level: float) -> Rectangles:
    return box_rectangles([box for box in boxes if (box.height or 0.0) > level])


def diverse(masses: Sequence[Mass], count: int) -> list[Mass]:
    """Return `count` masses, best first, at least LEAST_DISTANCE apart where that many are.

    Where fewer are so different the distance is lowered step by step (RELAXED); fewer than
    `count` come back only where there are no more different ones at all.
    """
    chosen: list[Mass] = list(masses[:1])
    for least in RELAXED:
        for mass in masses:
            if len(chosen) >= count:
                break
            if all(mass_distance(mass.boxes, other.boxes) >= least for other in chosen):
                chosen.append(mass)
    return sorted(chosen[:count], key=lambda mass: mass.energy) if count > 1 else chosen[:1]
