"""A layout found on a coarse field carried to the fine one: every border finds its pixel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..grammar.plan import Plan
from ..grammar.segments import Bounds, Cut, best_cut, chain
from .energy import Field, Layout, column_costs, column_limits, row_limits, span_costs

MAX_ROUNDS = 10


def enlarged(layout: Layout, factor: int, shape: tuple[int, int]) -> Layout:
    """Return the layout of a coarse field on a field of `shape` (height, width)."""
    columns = tuple(_scaled(cut, factor, shape[1]) for cut in layout.columns)
    return Layout(_scaled(layout.rows, factor, shape[0]), columns, layout.owner)


def _scaled(cut: Cut, factor: int, length: int) -> Cut:
    inner = [at * factor for at in cut.bounds[1:-1]]
    return Cut(cut.states, (0, *inner, length), cut.cost)


def refined(field: Field, plan: Plan, layout: Layout, reach: int) -> Layout:
    """Move borders of rows and of columns in turn by up to `reach` pixels until nothing gains.

    The states stay. Each half-step is exact within its reach.
    """
    for _ in range(MAX_ROUNDS):
        before = layout
        layout = _rows_moved(field, plan, layout, reach)
        layout = _columns_moved(field, plan, layout, reach)
        if _borders(layout) == _borders(before):
            break
    return layout


def _borders(layout: Layout) -> list[tuple[int, ...]]:
    return [cut.bounds for cut in (layout.rows, *layout.columns)]


def _rows_moved(field: Field, plan: Plan, layout: Layout, reach: int) -> Layout:
    rows, height = layout.rows, field.shape[0]
    spans = [
        (max(0, low - reach), min(height, high + reach))
        for low, high in zip(rows.bounds, rows.bounds[1:], strict=False)
    ]
    sets = [None if own < 0 else layout.columns[own] for own in layout.owner]
    costs = span_costs(field, plan, rows.states, sets, spans)
    moved = _moved(rows, costs, row_limits(plan, field, rows.states), reach)
    if moved is None:  # sizes that fitted coarse pixels do not fit: look along the whole line
        whole = span_costs(field, plan, rows.states, sets, [(0, height)] * len(spans))
        moved = _anywhere(rows, whole, row_limits(plan, field, rows.states))
    return Layout(moved, layout.columns, layout.owner)


def _columns_moved(field: Field, plan: Plan, layout: Layout, reach: int) -> Layout:
    rows = layout.rows
    segments = list(zip(rows.states, rows.bounds, rows.bounds[1:], strict=False))
    columns = []
    for own, cut in enumerate(layout.columns):
        held = [s for s, o in zip(segments, layout.owner, strict=True) if o == own]
        group = plan.states[held[0][0]].group if held else None
        if group is None:
            columns.append(cut)
            continue
        costs = column_costs(field, plan, held)[list(cut.states)]
        limits = _chosen(column_limits(plan, field, group), cut.states)
        columns.append(_moved(cut, costs, limits, reach) or _anywhere(cut, costs, limits))
    return Layout(rows, tuple(columns), layout.owner)


def _chosen(limits: Bounds, states: Sequence[int]) -> Bounds:
    at = list(states)
    return Bounds(limits.least[at], limits.most[at], limits.prior[at])


def _moved(cut: Cut, costs: NDArray[np.float64], limits: Bounds, reach: int) -> Cut | None:
    bounds = np.asarray(cut.bounds, np.int64)
    arrays = (limits.least, limits.most, limits.prior)
    best, cost = nudge(costs, bounds, *arrays, reach)
    return None if not np.isfinite(cost) else Cut(cut.states, tuple(best.tolist()), float(cost))


def _anywhere(cut: Cut, costs: NDArray[np.float64], limits: Bounds) -> Cut:
    found = best_cut(costs, chain(len(cut.states)), limits)
    return cut if found is None else Cut(cut.states, found.bounds, found.cost)


@compiled
def nudge(
    costs: NDArray[np.float64],
    bounds: NDArray[np.int64],
    least: NDArray[np.int64],
    most: NDArray[np.int64],
    prior: NDArray[np.float64],
    reach: int,
) -> tuple[NDArray[np.int64], float]:
    """Return the best borders within `reach` of the given ones, and what the cutting costs.

    costs: (parts, length) of every position under every part. Infinite where no sizes fit.
    """
    parts, length = costs.shape
    width = 2 * reach + 1
    reached = np.full((parts + 1, width), np.inf)
    came = np.zeros((parts + 1, width), np.int64)
    reached[0, reach] = 0.0
    total = np.zeros(length + 1)
    for part in range(parts):
        low = max(0, bounds[part] - reach)
        high = min(length, bounds[part + 1] + reach)
        total[low] = 0.0
        for at in range(low, high):
            total[at + 1] = total[at] + costs[part, at]
        for after in range(width):
            stop = bounds[part + 1] + after - reach
            if stop < 0 or stop > length or (part == parts - 1 and after != reach):
                continue
            for before in range(width):
                start = bounds[part] + before - reach
                size = stop - start
                if reached[part, before] == np.inf or start < 0:
                    continue
                if size < least[part] or size > most[part]:
                    continue
                cost = reached[part, before] + total[stop] - total[start]
                if prior[part, 2] > 0.0:
                    off = (size - prior[part, 0]) * prior[part, 1]
                    cost += prior[part, 2] * off * off / 2
                if cost < reached[part + 1, after]:
                    reached[part + 1, after] = cost
                    came[part + 1, after] = before
    best = bounds.copy()
    choice = reach
    for part in range(parts, 0, -1):
        best[part] = bounds[part] + choice - reach
        choice = came[part, choice]
    return best, reached[parts, reach]
