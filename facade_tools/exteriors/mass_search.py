"""The search for layouts: informed starts, polishing, annealing where they do not suffice."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from .mass_energy import Target, layout_energy
from .mass_layout import CAPACITY, Layout, Work
from .mass_polish import polish, valid
from .mass_starts import box_count, draw_start, drop_redundant
from .mass_taste import clumsiness

STARTS = 300  # drawn a round
POLISHED = 16  # of them polished
BOX_PRICE = 0.003  # of energy: prefers the simpler of equal starts
EXACT = 1e-8  # energies below it are equally good
THRESHOLD = 1e-3  # of FW16: below it the attributes count as met
DECADE, MISSED = 1.2, 8.0
HISTORY = 64
NEAT = 5.0  # of the rank: good enough to stop


class Pool(NamedTuple):
    """The best layouts so far: boxes (n, CAPACITY, 5), kinds, locks, energies, clumsiness.

    history: (HISTORY, 2) how many layouts had been polished when the least energy fell, and to
    what; counts: layouts polished, rows of the history.
    """

    rows: Floats
    kinds: Integers
    locks: Integers
    energies: Floats
    taste: Floats
    history: Floats
    counts: Integers


def new_pool(size: int) -> Pool:
    """Return a pool without layouts (their energies are infinite)."""
    shape = (size, CAPACITY)
    return Pool(
        np.zeros((*shape, 5)),
        np.full(shape, -1, dtype=np.int64),
        np.zeros(shape, dtype=np.int64),
        np.full(size, np.inf),
        np.full(size, np.inf),
        np.zeros((HISTORY, 2)),
        np.zeros(2, dtype=np.int64),
    )


@compiled
def _record(pool: Pool, energy: float) -> None:
    pool.counts[0] += 1
    rows = pool.counts[1]
    if rows < HISTORY and (rows == 0 or energy < pool.history[rows - 1, 1]):
        pool.history[rows, 0], pool.history[rows, 1] = pool.counts[0], energy
        pool.counts[1] += 1


@compiled
def pooled(pool: Pool, k: int) -> Layout:
    """Return layout k of a pool (shared, not copied)."""
    return Layout(pool.rows[k], pool.kinds[k], pool.locks[k])


@compiled
def rank(energy: float, taste: float) -> float:
    """Return what layouts are ordered by: clumsiness, and a price for each decade of energy.

    Below FW16's threshold a decade costs as much as three boxes; above it, far more.
    """
    decades = np.log10(max(energy, EXACT) / EXACT)
    above = np.log10(max(energy, THRESHOLD) / THRESHOLD)
    return float(taste + DECADE * decades + MISSED * (above + (energy >= THRESHOLD)))


@compiled
def offer(pool: Pool, layout: Layout, energy: float, taste: float) -> None:
    """Put a layout into the pool, best first, unless an equal one is there or all are better."""
    size = len(pool.energies)
    at = size
    for k in range(size):
        if abs(pool.taste[k] - taste) < 1e-7 and abs(pool.energies[k] - energy) < EXACT:
            return
        other = np.inf
        if pool.energies[k] < np.inf:
            other = rank(pool.energies[k], pool.taste[k])
        if at == size and rank(energy, taste) < other - 1e-9:
            at = k
    if at == size:
        return
    for k in range(size - 1, at, -1):
        pool.rows[k], pool.kinds[k] = pool.rows[k - 1], pool.kinds[k - 1]
        pool.locks[k] = pool.locks[k - 1]
        pool.energies[k], pool.taste[k] = pool.energies[k - 1], pool.taste[k - 1]
    pool.rows[at], pool.kinds[at], pool.locks[at] = layout.rows, layout.kinds, layout.locks
    pool.energies[at], pool.taste[at] = energy, taste


@compiled
def settle(pool: Pool, layout: Layout, target: Target, work: Work) -> float:
    """Polish `layout` in place and offer it to the pool; returns its energy."""
    polish(layout, target, work)
    drop_redundant(layout)
    energy = layout_energy(layout, target, work)
    if valid(layout, target):
        _record(pool, energy)
        offer(pool, layout, energy, clumsiness(layout, target.tower, target.styles, work))
    return energy


@compiled
def _draw_starts(
    best: Pool, base: Layout, target: Target, rng: np.random.Generator, work: Work
) -> None:
    """Draw STARTS layouts around `base` and offer them, as they are, to `best`."""
    layout = Layout(base.rows.copy(), base.kinds.copy(), base.locks.copy())
    for _ in range(STARTS):
        draw_start(base, target, rng, work, layout)
        if valid(layout, target):
            energy = layout_energy(layout, target, work)
            offer(best, layout, energy + BOX_PRICE * box_count(layout.kinds), 0.0)


def informed_round(
    pool: Pool, base: Layout, target: Target, work: Work, *, rng: np.random.Generator
) -> None:
    """Draw STARTS layouts around `base`, polish the most promising, offer them to `pool`."""
    best = new_pool(POLISHED)
    _draw_starts(best, base, target, rng, work)
    for k in np.flatnonzero(np.isfinite(best.energies)).tolist():
        settle(pool, pooled(best, k), target, work)
