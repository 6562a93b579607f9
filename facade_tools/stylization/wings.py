"""Plans of L, T and U cut into rectangles side by side (beyond LNSW13, which takes one box)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Booleans, Floats, Integers
from .remesh import Slab, on_grid, trimmed

COMPACT = 0.9  # of its bounding box: a plan that fills more is one block
LEAST_WING = 0.08  # of the plan's area
NARROW = 0.12  # of the plan's smaller side: what is thinner is a detail, no wing
MOST_WINGS = 8


def wings(slabs: Sequence[Slab]) -> tuple[Floats, Floats, Integers]:
    """Return a partition of the plan of successive slabs into wings.

    Returns the grid's xs and ys and the wing of every cell (len(ys) − 1, len(xs) − 1), numbered
    from 0. The largest rectangle that the plan holds becomes a wing, again and again; what is too
    small or too thin for one belongs to the nearest. A compact plan is one wing.
    """
    xs = np.unique(np.concatenate([slab.xs for slab in slabs]))
    ys = np.unique(np.concatenate([slab.ys for slab in slabs]))
    plan = _usual_plan(slabs, xs, ys)
    labels = np.zeros(plan.shape, dtype=np.int64)
    rectangles = _rectangles(plan, xs, ys) if _fill(plan, xs, ys) < COMPACT else []
    if len(rectangles) > 1:
        labels = _nearest(rectangles, 0.5 * (xs[1:] + xs[:-1]), 0.5 * (ys[1:] + ys[:-1]))
    return xs, ys, labels


def wing_slab(slab: Slab, grid: tuple[Floats, Floats], mask: Booleans) -> Slab:
    """Return the part of a slab inside a wing's mask on the partition's grid, not trimmed."""
    xs, ys = grid
    return Slab(slab.bottom, slab.top, xs, ys, on_grid(slab, xs, ys) & mask)


def _usual_plan(slabs: Sequence[Slab], xs: Floats, ys: Floats) -> Booleans:
    """Return the cells that are inside over at least half of the height."""
    inside = np.zeros((len(ys) - 1, len(xs) - 1))
    for slab in slabs:
        inside += slab.height * on_grid(slab, xs, ys)
    return np.asarray(inside >= 0.5 * sum(slab.height for slab in slabs))


def _fill(plan: Booleans, xs: Floats, ys: Floats) -> float:
    if not plan.any():
        return 1.0
    box = trimmed(Slab(0.0, 1.0, xs, ys, plan))
    return box.area / float(np.ptp(box.xs) * np.ptp(box.ys))


def _rectangles(plan: Booleans, xs: Floats, ys: Floats) -> list[Floats]:
    left = plan.copy()
    widths, depths = np.diff(xs), np.diff(ys)
    whole = float(depths @ left @ widths)
    thin = NARROW * min(float(np.ptp(xs)), float(np.ptp(ys)))
    found: list[Floats] = []
    while len(found) < MOST_WINGS:
        r0, r1, c0, c1 = _largest(left, widths, depths, thin)
        box = np.array([xs[c0], ys[r0], xs[c1], ys[r1]])
        if (box[2] - box[0]) * (box[3] - box[1]) < LEAST_WING * whole:
            break
        left[r0:r1, c0:c1] = False
        found.append(box)
    return found


@compiled
def _largest(
    plan: Booleans, widths: Floats, depths: Floats, thin: float
) -> tuple[int, int, int, int]:
    """Return rows r0…r1 and columns c0…c1 of the largest full rectangle not thinner than `thin`."""
    rows, columns = plan.shape
    best = 0.0
    found = (0, 0, 0, 0)
    for r0 in range(rows):
        full = np.ones(columns, dtype=np.bool_)
        depth = 0.0
        for r1 in range(r0, rows):
            depth += depths[r1]
            width = 0.0
            start = 0
            for c in range(columns):
                full[c] = full[c] and plan[r1, c]
                if not full[c]:
                    width = 0.0
                    start = c + 1
                    continue
                width += widths[c]
                if width * depth > best and min(width, depth) >= thin:
                    best = width * depth
                    found = (r0, r1 + 1, start, c + 1)
    return found


def _nearest(rectangles: Sequence[Floats], x: Floats, y: Floats) -> Integers:
    distances = [
        np.hypot(
            np.maximum(np.maximum(x0 - x, x - x1), 0.0)[None],
            np.maximum(np.maximum(y0 - y, y - y1), 0.0)[:, None],
        )
        for x0, y0, x1, y1 in rectangles
    ]
    return np.asarray(np.argmin(distances, axis=0))
