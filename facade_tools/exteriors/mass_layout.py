"""The kernel below attributes and mass generation: boxes on a compressed grid, in fixed arrays.

`facade attributes` and the energy of `massgen` share it, so that their numbers agree. It also
gives the two geometric terms of FW16 eq. 3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from ..geometry.floors import FLOORS, TOLERANCE

GENERAL, GARAGE, PORCH = 0, 1, 2
KINDS = ("general", "garage", "porch")

# Places of the groups in the vector of 27.
BBOX, BCR, BDRY, FAR, ARF, GARAGE_AT, PORCH_AT = 0, 3, 4, 5, 6, 9, 15
MASS_SIZE = 27

CAPACITY = 24  # boxes of a layout
EMPTY = -1  # kind of an unused row
PLAN_LOCKED, HEIGHT_LOCKED = 1, 2
LEAST_CONTACT = 0.5  # boxes that share an edge or overlap by this much are connected (m)
LEAST_THICKNESS = 0.5  # t_min of FW16 (m)


class Layout(NamedTuple):
    """Boxes as rows x0, y0, x1, y1, height (n, 5), their kinds (EMPTY: unused), what is locked."""

    rows: Floats
    kinds: Integers
    locks: Integers


class Work(NamedTuple):
    """Scratch of `describe`: grid lines, box spans, storeys a cell reaches, sizes, attributes."""

    xs: Floats
    ys: Floats
    spans: Integers
    levels: Integers  # with an empty rim
    size: Integers  # number of lines in x and in y
    values: Floats  # (27,) the attributes


def new_layout() -> Layout:
    """Return a layout without boxes."""
    kinds = np.full(CAPACITY, EMPTY, dtype=np.int64)
    return Layout(np.zeros((CAPACITY, 5)), kinds, np.zeros(CAPACITY, dtype=np.int64))


@compiled
def new_work(capacity: int = CAPACITY) -> Work:
    """Return scratch arrays for layouts of up to `capacity` boxes."""
    lines = 2 * capacity
    return Work(
        np.zeros(lines),
        np.zeros(lines),
        np.zeros((capacity, 4), dtype=np.int64),
        np.zeros((lines + 1, lines + 1), dtype=np.int64),
        np.zeros(2, dtype=np.int64),
        np.zeros(MASS_SIZE),
    )


@compiled
def copy_layout(source: Layout, target: Layout) -> None:
    """Copy all boxes."""
    target.rows[:] = source.rows
    target.kinds[:] = source.kinds
    target.locks[:] = source.locks


@compiled
def _insert(lines: Floats, count: int, value: float) -> int:
    at = count
    while at > 0 and lines[at - 1] > value:
        at -= 1
    if at > 0 and lines[at - 1] == value:
        return count
    for k in range(count, at, -1):
        lines[k] = lines[k - 1]
    lines[at] = value
    return count + 1


@compiled
def _find(lines: Floats, value: float) -> int:
    at = 0
    while lines[at] < value:
        at += 1
    return at


@compiled
def _level(height: float, storey_height: float) -> int:
    level = 0
    while level < FLOORS and height > (level + 0.5) * storey_height + TOLERANCE:
        level += 1
    return level


@compiled
def _build_grid(layout: Layout, storey_height: float, work: Work) -> None:
    n = 0
    m = 0
    for k in range(len(layout.kinds)):
        if layout.kinds[k] != EMPTY:
            n = _insert(work.xs, _insert(work.xs, n, layout.rows[k, 0]), layout.rows[k, 2])
            m = _insert(work.ys, _insert(work.ys, m, layout.rows[k, 1]), layout.rows[k, 3])
    work.size[0], work.size[1] = n, m
    for i in range(n + 1):
        for j in range(m + 1):
            work.levels[i, j] = 0
    for k in range(len(layout.kinds)):
        kind = layout.kinds[k]
        if kind == EMPTY:
            continue
        i0, i1 = _find(work.xs, layout.rows[k, 0]), _find(work.xs, layout.rows[k, 2])
        j0, j1 = _find(work.ys, layout.rows[k, 1]), _find(work.ys, layout.rows[k, 3])
        work.spans[k, 0], work.spans[k, 1], work.spans[k, 2], work.spans[k, 3] = i0, j0, i1, j1
        level = 0 if kind == PORCH else _level(layout.rows[k, 4], storey_height)
        for i in range(i0 + 1, i1 + 1):
            for j in range(j0 + 1, j1 + 1):
                work.levels[i, j] = max(work.levels[i, j], level)


@compiled
def _areas(work: Work) -> float:
    """Write the floors' areas to the arf places; return the perimeter of floor 0."""
    out, levels = work.values, work.levels
    perimeter = 0.0
    for i in range(1, work.size[0]):
        width = work.xs[i] - work.xs[i - 1]
        for j in range(1, work.size[1]):
            level = levels[i, j]
            if level == 0:
                continue
            depth = work.ys[j] - work.ys[j - 1]
            for floor in range(level):
                out[ARF + floor] += width * depth
            perimeter += width * ((levels[i, j - 1] == 0) + (levels[i, j + 1] == 0))
            perimeter += depth * ((levels[i - 1, j] == 0) + (levels[i + 1, j] == 0))
    return perimeter


@compiled
def _exposed(k: int, work: Work, porch: bool) -> float:
    """Return the length of box k's outline on the outline of floor 0, or of floor 0 ∪ porch."""
    i0, j0, i1, j1 = work.spans[k, 0], work.spans[k, 1], work.spans[k, 2], work.spans[k, 3]
    length = 0.0
    for i in range(i0 + 1, i1 + 1):
        width = work.xs[i] - work.xs[i - 1]
        inside = porch or work.levels[i, j0 + 1] > 0
        length += width * (inside != (work.levels[i, j0] > 0))
        inside = porch or work.levels[i, j1] > 0
        length += width * (inside != (work.levels[i, j1 + 1] > 0))
    for j in range(j0 + 1, j1 + 1):
        depth = work.ys[j] - work.ys[j - 1]
        inside = porch or work.levels[i0 + 1, j] > 0
        length += depth * (inside != (work.levels[i0, j] > 0))
        inside = porch or work.levels[i1, j] > 0
        length += depth * (inside != (work.levels[i1 + 1, j] > 0))
    return length


@compiled
def layout_bounds(layout: Layout, storey_height: float, ground: bool) -> tuple[Floats, float]:
    """Return the plan bounds of the mass (of floor 0 where `ground`) and its greatest height."""
    bounds = np.array([np.inf, np.inf, -np.inf, -np.inf])
    height = 0.0
    for k in range(len(layout.kinds)):
        if layout.kinds[k] == EMPTY or layout.kinds[k] == PORCH:
            continue
        if ground and _level(layout.rows[k, 4], storey_height) == 0:
            continue
        height = max(height, layout.rows[k, 4])
        for axis in range(2):
            bounds[axis] = min(bounds[axis], layout.rows[k, axis])
            bounds[2 + axis] = max(bounds[2 + axis], layout.rows[k, 2 + axis])
    return bounds, height


@compiled
def _write_part(layout: Layout, k: int, bounds: Floats, exposed: float, out: Floats) -> None:
    x0, y0, x1, y1, height = layout.rows[k]
    out[0] = ((x0 + x1) / 2 - bounds[0]) / (bounds[2] - bounds[0])
    out[1] = ((y0 + y1) / 2 - bounds[1]) / (bounds[3] - bounds[1])
    out[2], out[3], out[4] = x1 - x0, y1 - y0, height
    out[5] = min(exposed / (2 * (x1 - x0 + y1 - y0)), 1.0)


@compiled
def _parts(layout: Layout, bounds: Floats, work: Work) -> None:
    middle = (bounds[1] + bounds[3]) / 2
    sizes = np.zeros(3)
    for k in range(len(layout.kinds)):
        kind = layout.kinds[k]
        if kind != GARAGE and kind != PORCH:
            continue
        x0, y0, x1, y1, _ = layout.rows[k]
        part = 0 if kind == GARAGE else 1 + ((y0 + y1) / 2 >= middle)
        size = (x1 - x0) * (y1 - y0)
        if size > sizes[part]:
            sizes[part] = size
            start = GARAGE_AT if part == 0 else PORCH_AT + 6 * (part - 1)
            exposed = _exposed(k, work, kind == PORCH)
            _write_part(layout, k, bounds, exposed, work.values[start : start + 6])


@compiled
def attributes_of_layout(layout: Layout, storey_height: float, work: Work) -> bool:
    """Write the 27 attributes to `work.values`; False (and all 0) where there is no floor 0."""
    out = work.values
    out[:] = 0.0
    _build_grid(layout, storey_height, work)
    whole, height = layout_bounds(layout, storey_height, False)
    ground, _ = layout_bounds(layout, storey_height, True)
    if ground[0] >= ground[2]:
        return False
    out[0], out[1], out[2] = whole[2] - whole[0], whole[3] - whole[1], height
    base = (ground[2] - ground[0]) * (ground[3] - ground[1])
    perimeter = _areas(work)
    area = out[ARF]
    total = out[ARF] + out[ARF + 1] + out[ARF + 2]
    out[BCR] = min(area / base, 1.0)
    out[BDRY] = perimeter / np.sqrt(area)
    out[FAR] = min(total / base, 1.0 * FLOORS)
    for floor in range(FLOORS):
        out[ARF + floor] /= total
    _parts(layout, ground, work)
    return True


@compiled
def holds(layout: Layout, kind: int) -> bool:
    """Tell whether there is a box of a kind."""
    found = False
    for other in layout.kinds:
        found = found or other == kind
    return found


@compiled
def move_to_origin(layout: Layout) -> None:
    """Move all boxes so that the mass starts at x = 0, y = 0."""
    bounds, _ = layout_bounds(layout, 0.0, False)
    for k in range(len(layout.kinds)):
        for axis in range(2):
            layout.rows[k, axis] -= bounds[axis]
            layout.rows[k, 2 + axis] -= bounds[axis]


@compiled
def connected(layout: Layout) -> bool:
    """Tell whether all boxes hang together: they share 0.5 m of edge, or overlap by that."""
    reached = np.zeros(len(layout.kinds), dtype=np.int64)
    todo = 0
    for k in range(len(layout.kinds)):
        if layout.kinds[k] != EMPTY:
            reached[k] = 1 if todo == 0 else 0
            todo += 1
    grown = True
    while grown:
        grown = False
        for k in range(len(layout.kinds)):
            if layout.kinds[k] == EMPTY or reached[k]:
                continue
            for j in range(len(layout.kinds)):
                if reached[j] and in_contact(layout.rows[k], layout.rows[j]):
                    reached[k] = 1
                    grown = True
                    break
    return bool(reached.sum() == todo)


@compiled
def in_contact(a: Floats, b: Floats) -> bool:
    """Tell whether two rows share 0.5 m of edge or overlap by as much."""
    x = min(a[2], b[2]) - max(a[0], b[0])
    y = min(a[3], b[3]) - max(a[1], b[1])
    return bool(min(x, y) >= 0 and max(x, y) >= LEAST_CONTACT - 1e-9)


@compiled
def _same_run(levels: Integers, floor: int, start: int, stop: int, row: int) -> bool:
    """Tell whether the row before holds the same run, so that it was counted there."""
    for i in range(start - 1, stop + 1):
        if (levels[i, row] > floor) != (levels[i, row - 1] > floor):
            return False
    return row > 1


@compiled
def _thin_runs(levels: Integers, lines: Floats, size: Integers, floor: int, least: float) -> float:
    """Sum ((t − least)/least)² over runs of material and gaps thinner than `least`, along i."""
    total = 0.0
    for j in range(1, size[1]):
        start = 1
        for i in range(2, size[0] + 1):
            full = levels[start, j] > floor
            if i < size[0] and (levels[i, j] > floor) == full:
                continue
            inner = full or (start > 1 and i < size[0])
            t = lines[i - 1] - lines[start - 1]
            if inner and t < least - TOLERANCE and not _same_run(levels, floor, start, i, j):
                total += ((t - least) / least) ** 2
            start = i
    return total


@compiled
def thinness(work: Work, least: float) -> float:
    """Return E_thick of the described layout: facing outline edges nearer than `least` (m)."""
    total = 0.0
    swapped = work.size[::-1]
    for floor in range(FLOORS):
        total += _thin_runs(work.levels, work.xs, work.size, floor, least)
        total += _thin_runs(work.levels.T, work.ys, swapped, floor, least)
    return total
