"""Informed starts: layouts drawn from the lines that the target itself fixes.

The target gives the bounding box, the garage and the porches outright. Their edges, and a few free
lines, are where the edges of the general boxes of real houses lie; a start draws its boxes from
them. `polish` then moves the free lines until areas and perimeter agree.
"""

from __future__ import annotations

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from ..geometry.floors import FLOORS
from .mass_attributes import ARF, GARAGE, GARAGE_AT, GENERAL, PORCH
from .mass_energy import Target, layout_energy
from .mass_layout import (
    CAPACITY,
    EMPTY,
    HEIGHT_LOCKED,
    PLAN_LOCKED,
    Layout,
    Work,
    copy_layout,
    holds,
)

FREE_LINES = 2  # a direction
SNAP = 0.02  # of given parts to the bounding box (m)
LEAST_SPAN = 1.8  # of a drawn general box (m)
TRIES = 10  # drawn boxes, of which the best is taken
MOST_DRAWN = 5
FULL_SPAN = 0.35  # chance that a box runs through the whole bounding box, a direction
LOWER = 0.35  # chance that a box is lower than the highest


@compiled
def free_row(layout: Layout) -> int:
    """Return the first unused row, -1 if all are used."""
    for k in range(CAPACITY):
        if layout.kinds[k] == EMPTY:
            return k
    return -1


@compiled
def add_box(layout: Layout, kind: int, row: Floats) -> int:
    """Add a free box; returns its row, -1 where there is no place."""
    k = free_row(layout)
    if k >= 0:
        layout.rows[k] = row
        layout.kinds[k] = kind
        layout.locks[k] = 0
    return k


@compiled
def _draw_origin(base: Layout, axis: int, size: float, rng: np.random.Generator) -> float:
    """Return where the bounding box starts, so that it holds the locked boxes."""
    low, high = np.inf, -np.inf
    for k in range(CAPACITY):
        if base.kinds[k] != EMPTY and base.kinds[k] != PORCH:
            low = min(low, base.rows[k, axis])
            high = max(high, base.rows[k, 2 + axis])
    if low > high:
        return 0.0
    first, last = min(high - size, low), low
    chance = rng.random()
    if chance < 0.35:
        return first
    return last if chance < 0.7 else first + (last - first) * rng.random()


@compiled
def _snapped(value: float, low: float, high: float) -> float:
    if abs(value - low) < SNAP:
        return low
    return high if abs(value - high) < SNAP else value


@compiled
def part_row(values: Floats, frame: Floats) -> Floats:
    """Return the row of a garage or porch with attributes `values` (6,) in `frame` (4,).

    One that would stand apart from the frame is put at it: nothing could connect it to the house.
    """
    row = np.empty(5)
    for axis in range(2):
        start, end = frame[axis], frame[2 + axis]
        half = values[2 + axis] / 2
        centre = min(max(start + values[axis] * (end - start), start - half), end + half)
        row[axis] = _snapped(centre - half, start, end)
        row[2 + axis] = _snapped(centre + half, start, end)
    row[4] = values[4]
    return row


@compiled
def holds_part(layout: Layout, frame: Floats, part: int) -> bool:
    """Tell whether there is a garage (part 0), a front porch (1) or a back porch (2)."""
    for k in range(CAPACITY):
        behind = layout.rows[k, 1] + layout.rows[k, 3] >= frame[1] + frame[3]
        if layout.kinds[k] == GARAGE and part == 0:
            return True
        if layout.kinds[k] == PORCH and part == (2 if behind else 1):
            return True
    return False


@compiled
def place_parts(layout: Layout, target: Target, frame: Floats) -> None:
    """Add the target's garage and porches where the layout has none of the kind yet."""
    for part in range(3):
        start = GARAGE_AT + 6 * part
        if target.values[start + 2] >= 0.5 and not holds_part(layout, frame, part):
            row = part_row(target.values[start : start + 6], frame)
            add_box(layout, GARAGE if part == 0 else PORCH, row)


@compiled
def _anchor_lines(layout: Layout, frame: Floats, axis: int, rng: np.random.Generator) -> Floats:
    """Return positions where edges may lie: frame, parts, locked boxes, free lines."""
    lines = np.empty(2 * CAPACITY + 2 + FREE_LINES)
    lines[0], lines[1] = frame[axis], frame[2 + axis]
    count = 2
    for k in range(CAPACITY):
        if layout.kinds[k] == EMPTY:
            continue
        for edge in (layout.rows[k, axis], layout.rows[k, 2 + axis]):
            if frame[axis] + 0.3 < edge < frame[2 + axis] - 0.3:
                lines[count] = edge
                count += 1
    for _ in range(FREE_LINES):
        share = 0.12 + 0.76 * rng.random()
        lines[count] = frame[axis] + share * (frame[2 + axis] - frame[axis])
        count += 1
    return lines[:count]


@compiled
def _draw_span(lines: Floats, rng: np.random.Generator) -> tuple[float, float]:
    """Return two of the lines, far enough apart; the whole span after some failures."""
    if rng.random() >= FULL_SPAN:
        for _ in range(4):
            a = lines[int(rng.random() * len(lines))]
            b = lines[int(rng.random() * len(lines))]
            if abs(a - b) >= LEAST_SPAN:
                return min(a, b), max(a, b)
    return lines[0], lines[1]


@compiled
def _draw_height(target: Target, rng: np.random.Generator) -> float:
    """Return an eaves height: the highest, or a lower storey's (the garage's, on the ground)."""
    highest = float(target.values[2])
    storey = target.storey_height
    floors = int(max(np.rint(highest / storey), 1.0))
    if floors == 1 or rng.random() >= LOWER + 0.3 * (target.values[ARF + 1] < target.values[ARF]):
        return highest
    level = 1 + int(rng.random() * (floors - 1))
    garage = float(target.values[GARAGE_AT + 4])
    if level == 1 and garage > 0.5 * storey and rng.random() < 0.5:
        return garage
    return float(min(level * storey, highest))


@compiled
def _fill_heights(layout: Layout, target: Target, rng: np.random.Generator) -> None:
    """Give boxes of unknown height one."""
    for k in range(CAPACITY):
        if layout.kinds[k] == EMPTY or layout.locks[k] & HEIGHT_LOCKED:
            continue
        if layout.locks[k] & PLAN_LOCKED:
            known = 2.6 if layout.kinds[k] == PORCH else 0.9 * target.storey_height
            start = GARAGE_AT if layout.kinds[k] == GARAGE else GARAGE_AT + 6
            if layout.kinds[k] == GENERAL:
                known = _draw_height(target, rng)
            elif target.values[start + 4] > 1.0:
                known = target.values[start + 4]
            layout.rows[k, 4] = known


@compiled
def _draw_row(
    xs: Floats, ys: Floats, target: Target, highest: bool, rng: np.random.Generator
) -> Floats:
    row = np.empty(5)
    row[0], row[2] = _draw_span(xs, rng)
    row[1], row[3] = _draw_span(ys, rng)
    row[4] = target.values[2] if highest else _draw_height(target, rng)
    return row


@compiled
def _draw_tower(frame: Floats, height: float, rng: np.random.Generator) -> Floats:
    """Return a small square box in a corner of the frame, more often a front one."""
    row = np.empty(5)
    side = 2.4 + 1.6 * rng.random()
    right, back = rng.random() < 0.5, rng.random() < 0.2
    row[0] = frame[2] - side if right else frame[0]
    row[1] = frame[3] - side if back else frame[1]
    row[2], row[3], row[4] = row[0] + side, row[1] + side, height
    return row


@compiled
def _with_top(target: Target, rng: np.random.Generator) -> Target:
    """Return the target, its eaves moved to some storey where height and floors disagree.

    A sampled height of 4.4 m and an upper floor contradict each other; 0.1 m more cost less.
    """
    storey = target.storey_height
    wanted = 1 + (target.values[ARF + 1] > 0.01) + (target.values[ARF + 2] > 0.01)
    low, high = (wanted - 0.5) * storey, (wanted + 0.5) * storey
    top = target.values[2]
    known = target.weights[ARF] > 0 and target.weights[2] > 0
    if not known or (low < top and (top <= high or wanted == FLOORS)):
        return target
    floors = 1 + int(rng.random() * FLOORS)
    values = target.values.copy()
    values[2] = max(top, (floors - 0.5) * storey + 0.01)
    if floors < FLOORS:
        values[2] = min(values[2], (floors + 0.5) * storey)
    return Target(
        values, target.weights, storey, target.extra, target.tower, target.styles, target.zones
    )


@compiled
def draw_start(
    base: Layout, target: Target, rng: np.random.Generator, work: Work, out: Layout
) -> None:
    """Draw a layout around the locked boxes of `base` into `out`.

    Each general box is the best, by energy, of a few drawn ones.
    """
    copy_layout(base, out)
    frame = np.empty(4)
    for axis in range(2):
        frame[axis] = _draw_origin(base, axis, target.values[axis], rng)
        frame[2 + axis] = frame[axis] + target.values[axis]
    place_parts(out, target, frame)
    hint = _with_top(target, rng)
    _fill_heights(out, hint, rng)
    xs, ys = _anchor_lines(out, frame, 0, rng), _anchor_lines(out, frame, 1, rng)
    lower = target.tower and rng.random() < 0.8
    if lower:
        add_box(out, GENERAL, _draw_tower(frame, hint.values[2], rng))
    locked = holds(base, GENERAL)
    count = min(int(rng.random() ** 1.6 * MOST_DRAWN) + (0 if locked else 1), target.extra)
    tries = TRIES if rng.random() < 0.7 else 1
    for number in range(count):
        highest = number == 0 and not locked and not lower
        row = _draw_row(xs, ys, hint, highest, rng)
        least = np.inf
        for _ in range(tries):
            trial = _draw_row(xs, ys, hint, highest, rng)
            k = add_box(out, GENERAL, trial)
            energy = layout_energy(out, target, work)
            out.kinds[k] = EMPTY
            if energy < least:
                row, least = trial, energy
        if not _redundant(out, row):
            add_box(out, GENERAL, row)


@compiled
def _redundant(layout: Layout, row: Floats) -> bool:
    """Tell whether one box of the layout holds the whole row."""
    for k in range(CAPACITY):
        r = layout.rows[k]
        if (
            layout.kinds[k] == GENERAL
            and r[0] <= row[0]
            and r[1] <= row[1]
            and r[2] >= row[2]
            and r[3] >= row[3]
            and r[4] >= row[4]
        ):
            return True
    return False


@compiled
def drop_redundant(layout: Layout) -> None:
    """Remove free general boxes that another general box holds."""
    for k in range(CAPACITY):
        if layout.kinds[k] == GENERAL and layout.locks[k] == 0:
            layout.kinds[k] = EMPTY
            if not _redundant(layout, layout.rows[k]):
                layout.kinds[k] = GENERAL


@compiled
def box_count(kinds: Integers) -> int:
    """Return how many rows are used."""
    count = 0
    for kind in kinds:
        count += kind != EMPTY
    return count
