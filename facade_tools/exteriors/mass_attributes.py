"""The 27 mass attributes of a set of boxes, compiled: shared by `attributes` and `massgen`."""

from __future__ import annotations

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers, Rectangles
from ..geometry.boxes import RESOLUTION, area_perimeter, shared_outline
from ..geometry.floors import FLOORS, TOLERANCE

GENERAL, GARAGE, PORCH = 0, 1, 2
KINDS = ("general", "garage", "porch")

# Places of the groups in the vector of 27.
BBOX, BCR, BDRY, FAR, ARF, GARAGE_AT, PORCH_AT = 0, 3, 4, 5, 6, 9, 15
MASS_SIZE = 27


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
def floor_mask(boxes: Floats, kinds: Integers, storey_height: float, floor: int) -> Integers:
    """Return the indices of the boxes of a floor; an unknown height (NaN) reaches floor 0."""
    chosen = np.empty(len(boxes), dtype=np.int64)
    count = 0
    threshold = (floor + 0.5) * storey_height + TOLERANCE
    for k in range(len(boxes)):
        height = boxes[k, 4]
        if kinds[k] != PORCH and (height > threshold or (floor == 0 and np.isnan(height))):
            chosen[count] = k
            count += 1
    return chosen[:count]


@compiled
def bounding(edges: Rectangles, chosen: Integers) -> Floats:
    """Return the bounding rectangle of chosen rectangles; there must be one at least."""
    bounds: Floats = edges[chosen[0]].copy()
    for k in chosen:
        for axis in range(2):
            bounds[axis] = min(bounds[axis], edges[k, axis])
            bounds[2 + axis] = max(bounds[2 + axis], edges[k, 2 + axis])
    return bounds


@compiled
def _describe(box: Floats, bounds: Floats, exposed: float, out: Floats) -> None:
    """Write centre relative to `bounds`, size and exposure of a garage or porch."""
    out[0] = (box[0] - bounds[0]) / (bounds[2] - bounds[0])
    out[1] = (box[1] - bounds[1]) / (bounds[3] - bounds[1])
    out[2], out[3], out[4] = box[2], box[3], box[4]
    out[5] = min(exposed / (2 * (box[2] + box[3])), 1.0)


@compiled
def _largest(boxes: Floats, kinds: Integers, kind: int, middle: float, part: int) -> int:
    """Return the largest box of a kind, -1 if none; part 0 before, 1 behind the middle, 2 any."""
    best, size = -1, -1.0
    for k in range(len(boxes)):
        behind = 0 if boxes[k, 1] < middle else 1
        area = boxes[k, 2] * boxes[k, 3]
        if kinds[k] == kind and part in (2, behind) and area > size:
            best, size = k, area
    return best


@compiled
def _floor_values(
    boxes: Floats, kinds: Integers, edges: Rectangles, storey_height: float, out: Floats
) -> None:
    ground = floor_mask(boxes, kinds, storey_height, 0)
    bounds = bounding(edges, ground)
    base = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])
    area, perimeter = area_perimeter(edges[ground])
    out[BCR] = min(area / base, 1.0)
    out[BDRY] = perimeter / np.sqrt(area)
    out[ARF] = area
    for floor in range(1, FLOORS):
        upper = floor_mask(boxes, kinds, storey_height, floor)
        out[ARF + floor] = area if len(upper) == len(ground) else area_perimeter(edges[upper])[0]
    total = out[ARF] + out[ARF + 1] + out[ARF + 2]
    out[FAR] = min(total / base, 1.0 * FLOORS)
    for floor in range(FLOORS):
        out[ARF + floor] /= total


@compiled
def _parts(
    boxes: Floats, kinds: Integers, edges: Rectangles, ground: Integers, out: Floats
) -> None:
    bounds = bounding(edges, ground)
    garage = _largest(boxes, kinds, GARAGE, 0.0, 2)
    if garage >= 0:
        exposed = shared_outline(edges[garage], edges[ground])
        _describe(boxes[garage], bounds, exposed, out[GARAGE_AT : GARAGE_AT + 6])
    for part in range(2):
        porch = _largest(boxes, kinds, PORCH, (bounds[1] + bounds[3]) / 2, part)
        if porch >= 0:
            around = np.empty((len(ground) + 1, 4))
            around[:-1] = edges[ground]
            around[-1] = edges[porch]
            exposed = shared_outline(edges[porch], around)
            start = PORCH_AT + 6 * part
            _describe(boxes[porch], bounds, exposed, out[start : start + 6])


@compiled
def mass_vector(boxes: Floats, kinds: Integers, storey_height: float) -> Floats:
    """Return the 27 mass attributes: bbox 3, bcr, bdry, far, arf 3, garage 6, porches 2 × 6.

    boxes: (n, 5) centre x, y, width, depth, height (m; height NaN where unknown); kinds: (n,)
    indices into KINDS. All NaN without a box that reaches floor 0; all six 0 where there is no
    garage or porch. Largest garage or porch in plan, ties by order.
    """
    ground = floor_mask(boxes, kinds, storey_height, 0)
    if len(ground) == 0:
        return np.full(MASS_SIZE, np.nan)
    edges = plan_edges(boxes)
    out = np.zeros(MASS_SIZE)
    mass = np.flatnonzero(kinds != PORCH)
    bounds = bounding(edges, mass)
    out[0] = bounds[2] - bounds[0]
    out[1] = bounds[3] - bounds[1]
    for k in mass:
        out[2] = boxes[k, 4] if np.isnan(boxes[k, 4]) else max(out[2], boxes[k, 4])
        if np.isnan(out[2]):
            break
    _floor_values(boxes, kinds, edges, storey_height, out)
    _parts(boxes, kinds, edges, ground, out)
    return out
