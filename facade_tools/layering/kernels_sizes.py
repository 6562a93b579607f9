"""What the columns of an alignment ask of the symbols' sizes, for the walk (kernels_walk.py)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled
from .kernels_labels import IS_SOLID, LEAST, OPEN, REST, TO_PLACE
from .kernels_simplex import IMPOSSIBLE, least_value

Array = Any  # numba knows their exact types
TINY = 1e-9


@compiled
def _whole(net: Any, sizing: Any, here: int, there: int, out: Array) -> None:
    """Count the whole letters between two places."""
    for s in range(len(out)):
        out[s] = net.tally[there, s] - net.tally[here, s]
    if net.places[here, OPEN] and there != here:
        out[sizing.letter[here]] -= 1.0


@compiled
def sizable(  # noqa: C901 - one loop over the rows of a column
    net: Any, sizing: Any, frame: Any, d: int, over: bool
) -> Any:
    """Tell whether some sizes of the symbols satisfy what the columns up to d ask for.

    Every column is as wide as its opaque substring. Of a letter that a border lies in, `form` is
    how much has been consumed. `over`: the columns fill the canvas.
    """
    m, kinds = len(net.starts) - 1, len(sizing.least)
    if not over:
        width = np.zeros(kinds)
        line = np.zeros(kinds)
        for r in range(m):
            step = frame.taken[d, r]
            if step >= 0 and net.steps[step, IS_SOLID]:
                _whole(net, sizing, frame.code[d, r] >> 2, net.steps[step, TO_PLACE], width)
                break
        frame.fill[d + 1] = frame.fill[d] + width
        frame.rank[d + 1], frame.held[d + 1] = frame.rank[d], frame.held[d]
        for r in range(m):
            here, there = frame.code[d, r] >> 2, frame.code[d + 1, r] >> 2
            frame.form[d + 1, r] = 0.0
            if frame.taken[d, r] < 0:
                continue
            _whole(net, sizing, here, there, line)
            if net.places[here, OPEN]:
                line -= frame.form[d, r]
                if there != here:
                    line[sizing.letter[here]] += 1.0
            line = width - line  # what is left for the letter that it ends in
            if not net.places[there, OPEN]:
                if not _equal(frame, d + 1, line):
                    return False
                continue
            frame.form[d + 1, r] = line
            if not _positive(frame, d + 1, line):
                return False
            line = -line
            line[sizing.letter[there]] += 1.0
            if not _positive(frame, d + 1, line):
                return False
        if frame.rank[d + 1] == frame.rank[d] and frame.held[d + 1] == frame.held[d]:
            return True
    return _has_sizes(net, sizing, frame, d + 1, over)


@compiled
def _equal(frame: Any, d: int, line: Array) -> Any:
    """Add that a line is zero; False where that is impossible at once."""
    rank = frame.rank[d]
    own = line.copy()
    for k in range(rank):
        factor = own[frame.pivot[k]]
        if factor != 0.0:
            own -= factor * frame.basis[k]
    low, high, pivot = 0.0, 0.0, 0
    for s in range(len(own)):
        if abs(own[s]) < TINY:
            own[s] = 0.0
        low, high = min(low, own[s]), max(high, own[s])
        if abs(own[s]) > abs(own[pivot]):
            pivot = s
    if low == 0.0 and high == 0.0:
        return True
    if low == 0.0 or high == 0.0 or rank >= len(frame.basis):
        return False
    frame.basis[rank] = own / own[pivot]
    frame.pivot[rank] = pivot
    frame.rank[d] += 1
    return True


@compiled
def _positive(frame: Any, d: int, line: Array) -> bool:
    """Add that a line is not negative; False where that is impossible at once."""
    low, high = line.min(), line.max()
    if low >= 0.0:
        return True
    if high <= 0.0:
        return False
    frame.lines[frame.held[d]] = line
    frame.held[d] += 1
    return True


@compiled
def _has_sizes(net: Any, sizing: Any, frame: Any, d: int, over: bool) -> Any:
    m, kinds = len(net.starts) - 1, len(sizing.least)
    table, least = sizing.table, sizing.least
    table[0, : kinds + 1] = 0.0
    rows = 0
    for k in range(frame.rank[d]):
        for sign in (1.0, -1.0):
            rows += 1
            _line(table, rows, frame.basis[k], sign, 0.0, least)
    for k in range(frame.held[d]):
        rows += 1
        _line(table, rows, frame.lines[k], -1.0, 0.0, least)
    if over:
        for sign in (1.0, -1.0):
            rows += 1
            _line(table, rows, frame.fill[d], sign, sign, least)
    else:
        for r in range(m):
            if sizing.fixed[r]:  # the letters to come need columns, too
                there = frame.code[d, r] >> 2
                rows += 1
                rest = frame.fill[d] + sizing.total[r] - net.tally[there] - frame.form[d, r]
                _line(table, rows, rest, 1.0, 1.0, least)
    return least_value(table, rows, kinds, 0.5) < IMPOSSIBLE


@compiled
def _line(table: Array, row: int, line: Array, sign: float, most: float, least: Array) -> None:
    """Set the row that says sign · line · x ≤ most, for x from `least` on."""
    table[row, 0] = most
    for s in range(len(line)):
        table[row, s + 1] = sign * line[s]
        table[row, 0] -= sign * line[s] * least[s]


@compiled
def dependent(net: Any, sizing: Any, frame: Any, d: int) -> bool:
    """Tell whether a column's error depends on sizes that are free."""
    for r in range(len(net.starts) - 1):
        if frame.taken[d, r] >= 0:
            here, there = frame.code[d, r] >> 2, frame.code[d + 1, r] >> 2
            if net.places[here, OPEN] or net.places[there, OPEN]:
                return True
            for s in range(len(sizing.free)):
                if sizing.free[s] >= 0 and net.tally[there, s] > net.tally[here, s]:
                    return True
    return False


@compiled
def least_error_of(  # noqa: C901 - one table, row by row
    net: Any, sizing: Any, frame: Any, d: int, enough: float
) -> Any:
    """Return the least Ω of the columns up to d over all sizes of unsized symbols and pieces.

    A linear programme, in shares of the canvas: of each column that depends on such sizes the
    smallest substring V and the error e are unknown.
    """
    m, kinds, count = len(net.starts) - 1, len(sizing.free), len(sizing.low)
    table, units = sizing.table, sizing.units[0]
    rows, width = 0, count
    omega = sigma = 0.0
    whole = np.zeros(kinds)
    chain = np.zeros(m, np.int64)  # the row that sums the pieces of the letter a border lies in
    table[: sizing.height[0], : sizing.height[1]] = 0.0
    for s in range(count):
        rows += 1
        table[rows, 0], table[rows, s + 1] = sizing.high[s] - sizing.low[s], 1.0
    total = rows + 1
    rows += 1
    for j in range(d + 1):
        if not dependent(net, sizing, frame, j):
            upper, lower = frame.upper[j, m], frame.lower[j, m]
            omega += (upper - lower) / units
            sigma += upper / units
            continue
        small, error = width + 1, width + 2
        width += 2
        table[0, error] = 1.0
        table[total, small], table[total, error] = 1.0, 1.0
        for r in range(m):
            if frame.taken[j, r] < 0:
                continue
            here, there = frame.code[j, r] >> 2, frame.code[j + 1, r] >> 2
            rows += 2  # V ≤ substring ≤ V + e
            a, b = rows - 1, rows
            table[a, small], table[b, small], table[b, error] = 1.0, -1.0, -1.0
            _whole(net, sizing, here, there, whole)
            for s in range(kinds):
                times = whole[s]
                if times != 0.0:
                    known = times * sizing.size[s]
                    if sizing.free[s] >= 0:
                        table[a, sizing.free[s] + 1] -= times
                        table[b, sizing.free[s] + 1] += times
                        known = times * sizing.low[sizing.free[s]]
                    table[a, 0] += known
                    table[b, 0] -= known
            if net.places[here, OPEN]:
                width += 1
                table[a, width], table[b, width] = -1.0, 1.0
                table[chain[r], width] = 1.0
                if there != here:  # no less than the letter, either
                    rows += 1
                    table[rows, : width + 1] = -table[chain[r], : width + 1]
            if net.places[there, OPEN] and there != here:
                width += 1
                table[a, width], table[b, width] = -1.0, 1.0
                rows += 1
                chain[r] = rows
                table[rows, width] = 1.0
                s = sizing.letter[there]
                table[rows, 0] = sizing.size[s]
                if sizing.free[s] >= 0:
                    table[rows, 0] = sizing.low[sizing.free[s]]
                    table[rows, sizing.free[s] + 1] = -1.0
    ahead = np.int64(0)
    for r in range(m):
        there = frame.code[d + 1, r] >> 2
        ahead = max(ahead, net.places[there, REST] - net.places[there, LEAST])
    table[total, 0] = sizing.widest[0] - sigma - ahead / units
    for k in range(len(sizing.bounds)):
        rows += 2
        for s in range(count):
            table[rows - 1, s + 1] = sizing.counts[k, s]
            table[rows, s + 1] = -sizing.counts[k, s]
            table[rows - 1, 0] -= sizing.counts[k, s] * sizing.low[s]
            table[rows, 0] += sizing.counts[k, s] * sizing.low[s]
        table[rows, 0] -= sizing.bounds[k, 0]
        table[rows - 1, 0] += sizing.bounds[k, 1]
    found = least_value(table, rows, width, enough - omega + TINY)
    return found if found >= IMPOSSIBLE else found + omega
