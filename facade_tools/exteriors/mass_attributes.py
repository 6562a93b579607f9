"""The 27 mass attributes of a set of boxes, compiled: shared by `attributes` and `massgen`."""

from __future__ import annotations

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers, Rectangles
from ..geometry.boxes import RESOLUTION
from .mass_layout import (
    ARF,
    BBOX,
    BCR,
    BDRY,
    FAR,
    GARAGE,
    GARAGE_AT,
    GENERAL,
    KINDS,
    MASS_SIZE,
    PORCH,
    PORCH_AT,
    Layout,
    attributes_of_layout,
    layout_bounds,
    new_work,
)

__all__ = [
    "ARF",
    "BBOX",
    "BCR",
    "BDRY",
    "FAR",
    "GARAGE",
    "GARAGE_AT",
    "GENERAL",
    "KINDS",
    "MASS_SIZE",
    "PORCH",
    "PORCH_AT",
    "mass_vector",
    "plan_edges",
]

UNKNOWN_STOREYS = 0.75  # what a box of unknown height counts as: floor 0 and no other


@compiled
def plan_edges(boxes: Floats) -> Rectangles:
    """Return the plan rectangles of boxes (n, 5), edges rounded to 1e-6 m."""
    edges = np.empty((len(boxes), 4))
    for k in range(len(boxes)):
        for axis in range(2):
            centre, half = boxes[k, axis], boxes[k, 2 + axis] / 2
            edges[k, axis] = np.rint((centre - half) * RESOLUTION) / RESOLUTION
            edges[k, 2 + axis] = np.rint((centre + half) * RESOLUTION) / RESOLUTION
    return edges


@compiled
def _part_of(box: Floats, kind: int, middle: float) -> int:
    """Return 0 for a garage, 1 for a front porch, 2 for a back porch, -1 otherwise."""
    if kind == PORCH:
        return 2 if box[1] >= middle else 1
    return 0 if kind == GARAGE else -1


@compiled
def _as_given(boxes: Floats, kinds: Integers, bounds: Floats, out: Floats) -> None:
    """Write place and size of the largest garage and porches from their given numbers.

    The grid has rounded them to 1e-6 m.
    """
    middle = (bounds[1] + bounds[3]) / 2
    largest = np.zeros(3)
    for k in range(len(boxes)):
        part = _part_of(boxes[k], kinds[k], middle)
        size = boxes[k, 2] * boxes[k, 3]
        if part >= 0 and size > largest[part]:
            largest[part] = size
            start = GARAGE_AT + 6 * part
            for axis in range(2):
                span = bounds[2 + axis] - bounds[axis]
                out[start + axis] = (boxes[k, axis] - bounds[axis]) / span
            for column in range(2, 5):
                out[start + column] = boxes[k, column]


@compiled
def mass_vector(boxes: Floats, kinds: Integers, storey_height: float) -> Floats:
    """Return the 27 mass attributes: bbox 3, bcr, bdry, far, arf 3, garage 6, porches 2 × 6.

    boxes: (n, 5) centre x, y, width, depth, height (m; height NaN where unknown); kinds: (n,)
    indices into KINDS. All NaN without a box that reaches floor 0; all six 0 where there is no
    garage or porch. Largest garage or porch in plan, ties by order.
    """
    n = len(boxes)
    rows = np.empty((n, 5))
    rows[:, :4] = plan_edges(boxes)
    unknown = False
    for k in range(n):
        rows[k, 4] = boxes[k, 4]
        if np.isnan(boxes[k, 4]):
            rows[k, 4] = UNKNOWN_STOREYS * storey_height
            unknown = unknown or kinds[k] != PORCH
    work = new_work(n)
    layout = Layout(rows, kinds, np.zeros(n, dtype=np.int64))
    if not attributes_of_layout(layout, storey_height, work):
        work.values[:] = np.nan
        return work.values
    bounds, _ = layout_bounds(layout, storey_height, True)
    _as_given(boxes, kinds, bounds, work.values)
    if unknown:
        work.values[2] = np.nan
    return work.values
