"""What the search aims at where attributes are unknown or a partial building says more."""

from __future__ import annotations

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.building import Building
from ..geometry.arrays import Booleans, Floats, Rectangles
from .mass_attributes import ARF, GARAGE_AT, PORCH_AT
from .mass_energy import Target, target_of

# Medians of North American detached houses; only where nothing better is known.
USUAL_PLAN = ((7.0, 14.0), (7.0, 12.0))  # width, depth (m)
USUAL_GARAGE = (6.0, 6.2, 2.7)
USUAL_PORCH = (3.2, 2.0, 2.6)
CLEAR = 3.0  # free ground before an observed wall (m)
_RIGHT = {"front": (1, 0), "back": (-1, 0), "left": (0, -1), "right": (0, 1)}
_OUTWARD = {"front": (0, -1), "back": (0, 1), "left": (-1, 0), "right": (1, 0)}


def search_target(
    attributes: Attributes, keep: Building | None, *, rng: np.random.Generator
) -> Target:
    """Return the target with hints for what is unknown; hints carry no weight in the energy.

    What a partial building says to be complete is neither hinted at nor added.
    """
    target = target_of(attributes)
    values = target.values.copy()
    known = target.weights > 0
    _hint_bbox(values, known, attributes, rng)
    _hint_parts(values, known, attributes, rng)
    complete = keep.complete if keep else ()
    if "garage" in complete or "mass" in complete:
        values[GARAGE_AT:PORCH_AT] *= target.weights[GARAGE_AT:PORCH_AT] > 0
    if "mass" in complete:
        target = target._replace(extra=0, tower=False)
    return target._replace(values=values, zones=observed_zones(keep))


def observed_zones(keep: Building | None) -> Rectangles:
    """Return plan rectangles (n, 4) right before the observed walls of a partial building (m)."""
    rows = []
    for side, facade in keep.facades.items() if keep else ():
        (rx, ry), (nx, ny) = _RIGHT[side], _OUTWARD[side]
        for piece in facade.pieces:
            x, y, _ = piece.origin
            far_x = x + rx * piece.width + nx * CLEAR
            far_y = y + ry * piece.width + ny * CLEAR
            rows.append((min(x, far_x), min(y, far_y), max(x, far_x), max(y, far_y)))
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _hint_bbox(
    values: Floats, known: Booleans, attributes: Attributes, rng: np.random.Generator
) -> None:
    least = attributes.bounds.bbox_min if attributes.bounds else (0.0, 0.0, 0.0)
    for axis, (low, high) in enumerate(USUAL_PLAN):
        if not known[axis]:
            values[axis] = round(max(rng.uniform(low, high), least[axis]), 1)
    if not known[2]:
        floors = 1 + sum(values[ARF + i] > 0.02 for i in (1, 2))
        floors = floors if known[ARF + 1] else int(rng.integers(1, 3))
        values[2] = round(max(floors * attributes.storey_height, least[2]), 2)


def _hint_parts(
    values: Floats, known: Booleans, attributes: Attributes, rng: np.random.Generator
) -> None:
    """Hint at garages and porches that are present but unmeasured."""
    present = attributes.present
    if present is None:
        return
    width, depth = values[0], values[1]
    side = float(rng.choice([-1.0, 1.0]))
    w, d, h = USUAL_GARAGE
    garage = (0.5 + side * (0.5 - w / width / 2), min(d / depth / 2, 1.0), w, d, h, 0.7)
    w, d, h = USUAL_PORCH
    front = (0.5, -d / depth / 2, w, d, h, 0.6)
    back = (0.5, 1 + d / depth / 2, w, d, h, 0.6)
    for there, start, usual in (
        (present.garage, GARAGE_AT, garage),
        (present.porch_front, PORCH_AT, front),
        (present.porch_back, PORCH_AT + 6, back),
    ):
        place = slice(start, start + 6)
        if there:
            values[place] = np.where(known[place], values[place], usual)
