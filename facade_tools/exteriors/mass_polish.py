"""Polishing of a layout: Levenberg-Marquardt on the positions of its lines and its heights.

Edges that lie on one line move together, so that what was flush stays flush; lines of locked
boxes do not move. Scalar code throughout: the result does not depend on a linear algebra library.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers, Rectangles
from ..geometry.floors import TOLERANCE
from .mass_attributes import GENERAL, MASS_SIZE, PORCH
from .mass_energy import DISCONNECTED, Target
from .mass_layout import (
    CAPACITY,
    EMPTY,
    HEIGHT_LOCKED,
    LEAST_THICKNESS,
    PLAN_LOCKED,
    Layout,
    Work,
    attributes_of_layout,
    connected,
    holds,
    thinness,
)

STEP = 1e-5  # of the forward differences (m)
LONGEST_MOVE = 1.0  # of a line in one step (m)
ROUNDS = 25
SOLVED = 1e-18
LEAST_HEIGHT = 1.8  # of a porch (m)
OVER_KEPT = 0.01  # by which a new box may be higher than a kept one that it overlaps (m)
MOST_VARIABLES = 5 * CAPACITY


class Variables(NamedTuple):
    """Which variable each number of a layout follows (-1: fixed), and the variables' values."""

    of: Integers  # (CAPACITY, 5)
    values: Floats


@compiled
def _variable(values: Floats, axes: Integers, count: int, axis: int, value: float) -> int:
    for v in range(count):
        if axes[v] == axis and values[v] == value:
            return v
    return count


@compiled
def _is_locked(layout: Layout, k: int, column: int) -> bool:
    return bool((layout.locks[k] & (HEIGHT_LOCKED if column == 4 else PLAN_LOCKED)) != 0)


@compiled
def gather(layout: Layout) -> Variables:
    """Return the distinct free lines and heights of a layout as variables."""
    of = np.full((CAPACITY, 5), -1, dtype=np.int64)
    values = np.zeros(MOST_VARIABLES)
    axes = np.zeros(MOST_VARIABLES, dtype=np.int64)
    fixed = np.zeros(MOST_VARIABLES, dtype=np.bool_)
    count = 0
    for k in range(CAPACITY):
        if layout.kinds[k] == EMPTY:
            continue
        for column in range(5):
            # Heights of porches are their own; the plan has x lines and y lines.
            axis = column % 2 if column < 4 else 2 + (layout.kinds[k] == PORCH) * (k + 1)
            v = _variable(values, axes, count, axis, layout.rows[k, column])
            if v == count:
                values[v], axes[v] = layout.rows[k, column], axis
                count += 1
            fixed[v] = fixed[v] or _is_locked(layout, k, column)
            of[k, column] = v
    names = np.full(MOST_VARIABLES, -1, dtype=np.int64)
    free = 0
    for v in range(count):
        if not fixed[v]:
            names[v] = free
            values[free] = values[v]
            free += 1
    for k in range(CAPACITY):
        for column in range(5):
            if of[k, column] >= 0:
                of[k, column] = names[of[k, column]]
    return Variables(of, values[:free].copy())


@compiled
def scatter(variables: Variables, values: Floats, layout: Layout) -> None:
    """Write the variables' `values` into a layout."""
    for k in range(CAPACITY):
        for column in range(5):
            v = variables.of[k, column]
            if v >= 0:
                layout.rows[k, column] = values[v]


@compiled
def _in_zone(row: Floats, zones: Rectangles) -> bool:
    for zone in zones:
        x = min(row[2], zone[2]) - max(row[0], zone[0])
        y = min(row[3], zone[3]) - max(row[1], zone[1])
        if min(x, y) > TOLERANCE:
            return True
    return False


@compiled
def _swallows(layout: Layout, k: int) -> bool:
    """Tell whether box k hides a kept one: over it, over half of its plan, or over a porch."""
    for j in range(CAPACITY):
        if layout.kinds[j] == EMPTY or layout.locks[j] & PLAN_LOCKED == 0:
            continue
        x0, y0, x1, y1, height = layout.rows[j]
        x = min(layout.rows[k, 2], x1) - max(layout.rows[k, 0], x0)
        y = min(layout.rows[k, 3], y1) - max(layout.rows[k, 1], y0)
        if min(x, y) <= TOLERANCE:
            continue
        higher = layout.rows[k, 4] > height + OVER_KEPT
        if layout.kinds[j] == PORCH or higher or x * y > 0.5 * (x1 - x0) * (y1 - y0):
            return True
    return False


@compiled
def valid(layout: Layout, target: Target) -> bool:
    """Tell whether all boxes are thick, high and out of the target's zones, one a general one.

    None hides a kept one.
    """
    for k in range(CAPACITY):
        if layout.kinds[k] == EMPTY:
            continue
        x0, y0, x1, y1, height = layout.rows[k]
        low = LEAST_HEIGHT if layout.kinds[k] == PORCH else 0.5 * target.storey_height + 0.01
        free_plan = layout.locks[k] & PLAN_LOCKED == 0
        if free_plan and min(x1 - x0, y1 - y0) < LEAST_THICKNESS:
            return False
        if free_plan and layout.kinds[k] != PORCH and _in_zone(layout.rows[k], target.zones):
            return False
        if free_plan and layout.kinds[k] != PORCH and _swallows(layout, k):
            return False
        if height < low and layout.locks[k] & HEIGHT_LOCKED == 0:
            return False
    return holds(layout, GENERAL)


@compiled
def _residuals(layout: Layout, target: Target, work: Work, out: Floats) -> float:
    """Write the weighted differences and the root of E_thick; return their sum of squares."""
    thick = 0.0
    if attributes_of_layout(layout, target.storey_height, work):
        thick = thinness(work, LEAST_THICKNESS)
    total = 0.0 if connected(layout) else DISCONNECTED
    for i in range(MASS_SIZE):
        out[i] = np.sqrt(target.weights[i]) * (work.values[i] - target.values[i])
        total += out[i] * out[i]
    out[MASS_SIZE] = np.sqrt(thick)
    return total + thick


@compiled
def _solve(a: Floats, b: Floats, damping: float) -> Floats:
    """Solve (A + damping · I) x = b for symmetric positive A by Cholesky's method."""
    n = len(b)
    low = np.zeros((n, n))
    x = b.copy()
    for i in range(n):
        for j in range(i + 1):
            s = a[i, j] + (damping if i == j else 0.0)
            for k in range(j):
                s -= low[i, k] * low[j, k]
            low[i, j] = np.sqrt(max(s, 1e-30)) if i == j else s / low[j, j]
    for i in range(n):
        for k in range(i):
            x[i] -= low[i, k] * x[k]
        x[i] /= low[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= low[k, i] * x[k]
        x[i] /= low[i, i]
    return x


@compiled
def _normal_equations(
    layout: Layout, target: Target, variables: Variables, work: Work, base: Floats
) -> tuple[Floats, Floats]:
    """Return JᵀJ and Jᵀr by forward differences; `layout` is put back."""
    n = len(variables.values)
    jacobian = np.zeros((n, MASS_SIZE + 1))
    moved = np.zeros(MASS_SIZE + 1)
    values = variables.values.copy()
    for v in range(n):
        values[v] += STEP
        scatter(variables, values, layout)
        _residuals(layout, target, work, moved)
        values[v] = variables.values[v]
        for i in range(MASS_SIZE + 1):
            jacobian[v, i] = (moved[i] - base[i]) / STEP
    scatter(variables, values, layout)
    square, right = np.zeros((n, n)), np.zeros(n)
    for v in range(n):
        for i in range(MASS_SIZE + 1):
            right[v] += jacobian[v, i] * base[i]
        for u in range(v + 1):
            for i in range(MASS_SIZE + 1):
                square[v, u] += jacobian[v, i] * jacobian[u, i]
            square[u, v] = square[v, u]
    return square, right


@compiled
def _step_to(start: Floats, step: Floats, out: Floats) -> None:
    """Write start − step, the step shortened so that no line moves more than LONGEST_MOVE."""
    longest = LONGEST_MOVE
    for v in range(len(step)):
        longest = max(longest, abs(step[v]))
    for v in range(len(step)):
        out[v] = start[v] - step[v] * (LONGEST_MOVE / longest)


@compiled
def polish(layout: Layout, target: Target, work: Work) -> float:
    """Move lines and heights to a local minimum of the energy; return it.

    Never raises the energy, never makes a box thinner than 0.5 m.
    """
    variables = gather(layout)
    base, trial = np.zeros(MASS_SIZE + 1), np.zeros(MASS_SIZE + 1)
    energy = _residuals(layout, target, work, base)
    values = variables.values.copy()
    damping = 1e-4
    for _ in range(ROUNDS):
        if energy < SOLVED or len(variables.values) == 0:
            break
        square, right = _normal_equations(layout, target, variables, work, base)
        before = energy
        for _ in range(8):
            step = _solve(square, right, damping)
            _step_to(variables.values, step, values)
            scatter(variables, values, layout)
            energy = _residuals(layout, target, work, trial)
            if energy < before and valid(layout, target):
                damping = max(damping * 0.1, 1e-12)
                variables.values[:] = values
                base[:] = trial
                break
            energy = before
            damping *= 10.0
        scatter(variables, variables.values, layout)
        if energy > before * 0.999:
            break
    return energy


@compiled
def round_layout(layout: Layout, grain: float, lift: float) -> None:
    """Round free lines and heights to multiples of `grain` (m), flush edges together.

    lift: of heights before they are rounded, in grains: 0.5 takes them up, -0.5 down.
    """
    variables = gather(layout)
    lifts = np.zeros(len(variables.values))
    for k in range(CAPACITY):
        if variables.of[k, 4] >= 0:
            lifts[variables.of[k, 4]] = lift * (1 - 1e-6)
    for v in range(len(variables.values)):
        variables.values[v] = np.rint(variables.values[v] / grain + lifts[v]) * grain
    scatter(variables, variables.values, layout)
