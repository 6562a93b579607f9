"""What makes one of several equally exact layouts look more like a house.

FW16 stops at the first layout under its threshold. Many layouts share their 27 attributes, so we
go on and take the one of least `clumsiness`: few boxes and corners, no slivers, no courtyards,
no steps too small to build, a garage that a car can leave, porches outside the walls.
"""

from __future__ import annotations

import numpy as np

from ..compiled import compiled
from ..geometry.floors import FLOORS
from .mass_attributes import GARAGE, GENERAL, PORCH
from .mass_layout import CAPACITY, EMPTY, Layout, Work, thinness

LEAST_JOG = 0.8  # distance of neighbouring wall lines (m)
LEAST_STEP = 0.45  # difference of eaves heights (m)
SLIM = 2.4  # a wing or a gap thinner than this looks odd (m)
TOWER_WIDTH = 4.6  # widest plan of a tower (m)
TOWER_RATIO = 1.5  # of its sides at most
SLIVER = 1.3  # … and thinner than this, absurd (m)
CAR = 2.4  # free wall that a garage door needs (m)
IN_HOUSE = 6.0  # price of a porch that lies whole in the house, in proportion to its plan there
MEETS_HOUSE = 3.0  # … and of one that lies in it at all


@compiled
def _near_lines(layout: Layout) -> float:
    """Sum over pairs of nearly flush wall lines, both directions."""
    total = 0.0
    for k in range(CAPACITY):
        for j in range(k):
            if min(layout.kinds[k], layout.kinds[j]) == EMPTY:
                continue
            if layout.kinds[k] == PORCH or layout.kinds[j] == PORCH:
                continue
            for a in range(4):
                for b in range(a % 2, 4, 2):
                    gap = abs(layout.rows[k, a] - layout.rows[j, b])
                    if 1e-6 < gap < LEAST_JOG:
                        total += 1.0 - gap / LEAST_JOG
    return total


@compiled
def _near_heights(layout: Layout) -> float:
    total = 0.0
    for k in range(CAPACITY):
        for j in range(k):
            if layout.kinds[k] == GENERAL and layout.kinds[j] == GENERAL:
                step = abs(layout.rows[k, 4] - layout.rows[j, 4])
                total += 1.0 if 1e-6 < step < LEAST_STEP else 0.0
    return total


@compiled
def _corners(work: Work) -> int:
    """Return the number of outline corners of all floors."""
    corners = 0
    for floor in range(FLOORS):
        for i in range(work.size[0]):
            for j in range(work.size[1]):
                full = 0
                for di in range(2):
                    for dj in range(2):
                        full += work.levels[i + di, j + dj] > floor
                corners += full % 2
    return corners


@compiled
def _door_walls(layout: Layout, k: int, work: Work) -> tuple[float, float]:
    """Return the longest free wall of box k on its front and on any other side (m)."""
    i0, j0, i1, j1 = work.spans[k, 0], work.spans[k, 1], work.spans[k, 2], work.spans[k, 3]
    free = np.zeros(4)
    for i in range(i0 + 1, i1 + 1):
        width = work.xs[i] - work.xs[i - 1]
        free[0] += width * (work.levels[i, j0] == 0)
        free[1] += width * (work.levels[i, j1 + 1] == 0)
    for j in range(j0 + 1, j1 + 1):
        depth = work.ys[j] - work.ys[j - 1]
        free[2] += depth * (work.levels[i0, j] == 0)
        free[3] += depth * (work.levels[i1 + 1, j] == 0)
    return free[0], free[1:].max()


@compiled
def _towerless(layout: Layout) -> bool:
    """Tell whether no general box is small, about square, and as high as the highest."""
    top = 0.0
    for k in range(CAPACITY):
        if layout.kinds[k] == GENERAL:
            top = max(top, layout.rows[k, 4])
    for k in range(CAPACITY):
        x0, y0, x1, y1, height = layout.rows[k]
        small, large = min(x1 - x0, y1 - y0), max(x1 - x0, y1 - y0)
        fits = small >= 1.8 and large <= min(TOWER_WIDTH, TOWER_RATIO * small)
        if layout.kinds[k] == GENERAL and height >= top - 1e-6 and fits:
            return False
    return True


@compiled
def _roofless(layout: Layout, styles: int) -> int:
    """Return for how many roof styles there is no general box."""
    for k in range(CAPACITY):
        styles -= layout.kinds[k] == GENERAL
    return max(styles, 0)


@compiled
def covered_share(k: int, work: Work) -> float:
    """Return the share of box k's plan that lies in the house: under general boxes and garages."""
    i0, j0, i1, j1 = work.spans[k, 0], work.spans[k, 1], work.spans[k, 2], work.spans[k, 3]
    covered = 0.0
    whole = (work.xs[i1] - work.xs[i0]) * (work.ys[j1] - work.ys[j0])
    for i in range(i0 + 1, i1 + 1):
        for j in range(j0 + 1, j1 + 1):
            if work.levels[i, j] > 0:
                covered += (work.xs[i] - work.xs[i - 1]) * (work.ys[j] - work.ys[j - 1])
    return float(covered / max(whole, 1e-9))


@compiled
def clumsiness(layout: Layout, tower: bool, styles: int, work: Work) -> float:
    """Return a penalty ≥ 0 (no unit) of a layout whose grid `work` describes.

    tower: whether one box should be small and high enough to be a tower. styles: how many
    styles of roof the boxes have to carry.
    """
    total = 1.5 * _near_lines(layout) + 2.0 * _near_heights(layout)
    total += 2.0 * thinness(work, SLIM) + 4.0 * thinness(work, SLIVER)
    total += 0.12 * _corners(work)
    total += 3.0 if tower and _towerless(layout) else 0.0
    total += 3.0 * _roofless(layout, styles)
    for k in range(CAPACITY):
        kind = layout.kinds[k]
        total += 0.35 if kind == GENERAL else 0.0
        if kind == PORCH:
            covered = covered_share(k, work)
            total += IN_HOUSE * covered + MEETS_HOUSE * (covered > 1e-4)
        if kind == GARAGE:
            front, other = _door_walls(layout, k, work)
            total += 0.0 if front >= CAR else (0.7 if other >= CAR else 6.0)
    return total
