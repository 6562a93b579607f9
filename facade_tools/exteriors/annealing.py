"""Simulated annealing of mass layouts: add, remove, move, resize, snap (FW16 6.1).

One compiled loop serves the paper's plain run from an empty layout and the run from the best
informed start. Scalar code, one generator: the same seed takes the same path everywhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats
from .mass_attributes import GARAGE, GARAGE_AT, GENERAL, PORCH, PORCH_AT
from .mass_energy import MOST_BOXES, Target, layout_energy
from .mass_layout import (
    CAPACITY,
    EMPTY,
    HEIGHT_LOCKED,
    PLAN_LOCKED,
    Layout,
    Work,
    copy_layout,
    new_layout,
    new_work,
)
from .mass_polish import valid
from .mass_search import (
    NEAT,
    THRESHOLD,
    Pool,
    informed_round,
    pooled,
    rank,
    settle,
)
from .mass_starts import add_box, box_count, free_row, holds_part, part_row

ITERATIONS = 10_000  # proposals at most (FW16)
RESTARTS = 3
HOPS = 300
GAIN = 0.25  # of the rank: a round of starts that brings less is the last
HOP = 1.5  # step length of a hop (m)
FLUSH = 0.3  # share of resizes that make an edge flush with another box's
SNAP = 0.10  # edges of two boxes closer than this are snapped (m)


class Schedule(NamedTuple):
    """Temperature from `hot` to `cold` (geometric), step lengths (m) likewise, stopping rule."""

    hot: float
    cold: float
    far: float
    near: float
    iterations: int
    threshold: float


PLAIN = Schedule(0.3, 1e-6, 3.0, 0.05, ITERATIONS, THRESHOLD)
"""From an empty layout."""

REFINE = Schedule(3e-3, 1e-7, 1.5, 0.03, ITERATIONS, 1e-9)
"""From a good one."""


@compiled
def _random_free(layout: Layout, mask: int, rng: np.random.Generator) -> int:
    """Return a random used row without the locks of `mask`, -1 if there is none."""
    count = 0
    for k in range(CAPACITY):
        count += layout.kinds[k] != EMPTY and layout.locks[k] & mask == 0
    if count == 0:
        return -1
    pick = int(rng.random() * count)
    for k in range(CAPACITY):
        if layout.kinds[k] != EMPTY and layout.locks[k] & mask == 0:
            if pick == 0:
                return k
            pick -= 1
    return -1


@compiled
def _normal(rng: np.random.Generator) -> float:
    """Return about a standard normal number, of four uniform ones."""
    return (rng.random() + rng.random() + rng.random() + rng.random() - 2.0) * 1.7320508075688772


@compiled
def _origin(layout: Layout) -> tuple[float, float]:
    x, y = np.inf, np.inf
    for k in range(CAPACITY):
        if layout.kinds[k] != EMPTY and layout.kinds[k] != PORCH:
            x, y = min(x, layout.rows[k, 0]), min(y, layout.rows[k, 1])
    return (x, y) if x < np.inf else (0.0, 0.0)


@compiled
def _add(layout: Layout, target: Target, rng: np.random.Generator) -> int:
    """Add a box: a wanted garage or porch that is not there, or a general one."""
    if free_row(layout) < 0 or box_count(layout.kinds) >= MOST_BOXES:
        return -1
    x, y = _origin(layout)
    frame = np.array([x, y, x + target.values[0], y + target.values[1]])
    pick = int(rng.random() * 6)
    start = (GARAGE_AT, PORCH_AT, PORCH_AT + 6)[pick] if pick < 3 else -1
    if start >= 0 and target.values[start + 2] > 0 and not holds_part(layout, frame, pick):
        kind = GARAGE if start == GARAGE_AT else PORCH
        return add_box(layout, kind, part_row(target.values[start : start + 6], frame))
    if target.extra == 0:
        return -1
    row = np.empty(5)
    for axis in range(2):
        size = (0.15 + 0.85 * rng.random()) * target.values[axis]
        row[axis] = frame[axis] + rng.random() * (target.values[axis] - size)
        row[2 + axis] = row[axis] + size
    row[4] = _any_height(layout, target, rng)
    return add_box(layout, GENERAL, row)


@compiled
def _any_height(layout: Layout, target: Target, rng: np.random.Generator) -> float:
    k = _random_free(layout, 0, rng)
    if k >= 0 and rng.random() < 0.3:
        return float(layout.rows[k, 4])
    floors = int(max(np.rint(target.values[2] / target.storey_height), 1.0))
    level = 1 + int(rng.random() * floors)
    return target.values[2] if level == floors else level * target.storey_height


@compiled
def _move(layout: Layout, step: float, rng: np.random.Generator) -> int:
    k = _random_free(layout, PLAN_LOCKED, rng)
    if k >= 0:
        dx, dy = step * _normal(rng), step * _normal(rng)
        along = rng.random()
        for axis, shift in ((0, dx * (along < 0.67)), (1, dy * (along > 0.33))):
            layout.rows[k, axis] += shift
            layout.rows[k, 2 + axis] += shift
    return k


@compiled
def _resize(layout: Layout, target: Target, step: float, rng: np.random.Generator) -> int:
    """Move one edge of a box, or make it flush with another's, or change the height."""
    if rng.random() < 0.2:
        k = _random_free(layout, HEIGHT_LOCKED, rng)
        if k >= 0 and rng.random() < 0.5 and layout.kinds[k] == GENERAL:
            layout.rows[k, 4] = _any_height(layout, target, rng)
        elif k >= 0:
            layout.rows[k, 4] += 0.3 * step * _normal(rng)
        return k
    k = _random_free(layout, PLAN_LOCKED, rng)
    if k >= 0:
        edge = int(rng.random() * 4)
        other = _random_free(layout, 0, rng)
        if rng.random() < FLUSH:
            layout.rows[k, edge] = layout.rows[other, edge % 2 + 2 * int(rng.random() * 2)]
        else:
            layout.rows[k, edge] += step * _normal(rng)
    return k


@compiled
def _shift_line(layout: Layout, step: float, rng: np.random.Generator) -> int:
    """Move an edge together with all free edges that are flush with it."""
    k = _random_free(layout, PLAN_LOCKED, rng)
    if k < 0:
        return k
    edge = int(rng.random() * 4)
    old = layout.rows[k, edge]
    new = old + step * _normal(rng)
    for j in range(CAPACITY):
        if layout.kinds[j] != EMPTY and layout.locks[j] & PLAN_LOCKED == 0:
            for other in (edge % 2, edge % 2 + 2):
                if layout.rows[j, other] == old:
                    layout.rows[j, other] = new
    return k


@compiled
def _snap(layout: Layout, k: int) -> None:
    """Snap each edge of box k to the nearest edge of another box within 10 cm."""
    if layout.kinds[k] == EMPTY or layout.locks[k] & PLAN_LOCKED:
        return
    for edge in range(4):
        best, at = SNAP, layout.rows[k, edge]
        for j in range(CAPACITY):
            if j == k or layout.kinds[j] == EMPTY:
                continue
            for other in (edge % 2, edge % 2 + 2):
                gap = abs(layout.rows[j, other] - layout.rows[k, edge])
                if gap < best:
                    best, at = gap, layout.rows[j, other]
        layout.rows[k, edge] = at


@compiled
def propose(layout: Layout, target: Target, step: float, rng: np.random.Generator) -> None:
    """Change a layout by one random operation, then snap what has moved."""
    pick = rng.random()
    if pick < 0.08 or box_count(layout.kinds) == 0:
        k = _add(layout, target, rng)
    elif pick < 0.14:
        k = _random_free(layout, PLAN_LOCKED, rng)
        if k >= 0:
            layout.kinds[k] = EMPTY
        k = -1
    elif pick < 0.38:
        k = _move(layout, step, rng)
    elif pick < 0.75:
        k = _resize(layout, target, step, rng)
    else:
        k = _shift_line(layout, step, rng)
    if k >= 0:
        _snap(layout, k)


@compiled
def _cooled(schedule: Schedule, k: int) -> tuple[float, float]:
    """Return temperature and step length of iteration k."""
    share = k / schedule.iterations
    temperature = schedule.hot * (schedule.cold / schedule.hot) ** share
    return temperature, schedule.far * (schedule.near / schedule.far) ** share


@compiled
def anneal(
    layout: Layout,
    target: Target,
    schedule: Schedule,
    rng: np.random.Generator,
    work: Work,
    trace: Floats,
) -> float:
    """Anneal `layout` in place to the best layout met; return its energy.

    trace: (n,) receives the best energy so far at n evenly spaced iterations.
    """
    best = Layout(layout.rows.copy(), layout.kinds.copy(), layout.locks.copy())
    trial = Layout(layout.rows.copy(), layout.kinds.copy(), layout.locks.copy())
    energy = layout_energy(layout, target, work)
    least = energy
    trace[:] = energy
    for k in range(schedule.iterations):
        if least < schedule.threshold:
            break
        temperature, step = _cooled(schedule, k)
        copy_layout(layout, trial)
        propose(trial, target, step, rng)
        chance = rng.random()
        if valid(trial, target):
            proposed = layout_energy(trial, target, work)
            if proposed <= energy or chance < np.exp((energy - proposed) / temperature):
                copy_layout(trial, layout)
                energy = proposed
            if energy < least:
                least = energy
                copy_layout(layout, best)
        trace[(k * len(trace)) // schedule.iterations :] = least
    copy_layout(best, layout)
    return least


@compiled
def _mutate(pool: Pool, layout: Layout, target: Target, rng: np.random.Generator) -> None:
    """Copy one of the best layouts into `layout`, and change it by a few operations."""
    k = int(rng.random() ** 2 * len(pool.energies))
    copy_layout(pooled(pool, k if pool.energies[k] < np.inf else 0), layout)
    for _ in range(1 + int(rng.random() * 3)):
        propose(layout, target, HOP, rng)


def hop(pool: Pool, target: Target, work: Work, *, rng: np.random.Generator) -> None:
    """Basin hopping: change the best layouts by a few operations, polish, keep what is better."""
    layout = new_layout()
    for _ in range(HOPS if pool.energies[0] < np.inf else 0):
        if rank(pool.energies[0], pool.taste[0]) < NEAT:
            break
        _mutate(pool, layout, target, rng)
        if valid(layout, target):
            settle(pool, layout, target, work)


def search(
    pool: Pool, base: Layout, target: Target, rounds: int, *, rng: np.random.Generator
) -> None:
    """Fill `pool` with the best layouts around the locked boxes of `base`.

    rounds: of informed starts, at least; more while they help. Where they and basin hopping
    leave an energy above FW16's threshold, annealing from the best and from nothing has its turn.
    """
    work = new_work()
    before = np.inf
    for number in range(4 * rounds):
        informed_round(pool, base, target, work, rng=rng)
        reached = rank(pool.energies[0], pool.taste[0])
        if number + 1 >= rounds and (reached < NEAT or reached > before - GAIN):
            break
        before = reached
    trace = np.zeros(1)
    layout = Layout(base.rows.copy(), base.kinds.copy(), base.locks.copy())
    hop(pool, target, work, rng=rng)
    for restart in range(RESTARTS):
        if pool.energies[0] < THRESHOLD:
            break
        refine = restart > 0 and pool.energies[0] < np.inf
        copy_layout(pooled(pool, 0) if refine else base, layout)
        anneal(layout, target, REFINE if refine else PLAIN, rng, work, trace)
        settle(pool, layout, target, work)
