"""A dual simplex method in compiled scalar code, for the small programmes inside a search."""

from __future__ import annotations

from typing import Any

from ..compiled import compiled

Array = Any  # float arrays; numba knows their exact types
NEGATIVE = -1e-10  # what is above counts as zero: right sides are shares of the canvas
PIVOT = 1e-9
IMPOSSIBLE = 1e300


@compiled
def least_value(table: Array, rows: int, width: int, enough: float) -> Any:
    """Return a lower bound on min c · x over A x ≤ b, x ≥ 0, where c ≥ 0; the least, as a rule.

    table: c in row 0, A in rows 1 to `rows`; b in column 0, x in columns 1 to `width`; it is
    overwritten. IMPOSSIBLE where there is no x. Every step of the method gives a bound, so that it
    may stop as soon as one is above `enough`, or after too many steps.
    """
    table[0, 0] = 0.0
    for _ in range(50 + 6 * rows):
        if -table[0, 0] > enough:
            break
        row, worst = 0, NEGATIVE
        for i in range(1, rows + 1):
            if table[i, 0] < worst:
                row, worst = i, table[i, 0]
        if row == 0:
            break
        column, ratio = 0, IMPOSSIBLE
        for j in range(1, width + 1):
            if table[row, j] < -PIVOT and table[0, j] < -ratio * table[row, j]:
                column, ratio = j, -table[0, j] / table[row, j]
        if column == 0:
            return IMPOSSIBLE
        _exchange(table, rows, width, row, column)
    return -table[0, 0]


@compiled
def _exchange(table: Array, rows: int, width: int, row: int, column: int) -> None:
    pivot = table[row, column]
    for j in range(width + 1):
        table[row, j] /= pivot
    table[row, column] = 1.0 / pivot
    for i in range(rows + 1):
        factor = table[i, column]
        if i != row and factor != 0.0:
            for j in range(width + 1):
                table[i, j] -= factor * table[row, j]
            table[i, column] = -factor / pivot
