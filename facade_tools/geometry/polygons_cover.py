"""Cover the cells of a grid by few, large rectangles that may overlap."""

from __future__ import annotations

import numpy as np

from .arrays import Booleans, Floats, Integers, Rectangles

MOST_RECTANGLES = 64  # of one polygon; a round tower is no reason for a thousand boxes
SPARE = 5e-3  # of the area: stop when only this much is left uncovered


def cover(inside: Booleans, xs: Floats, ys: Floats) -> Rectangles:
    """Return rectangles (n, 4), metres, whose union is the cells `inside` of a grid.

    inside: (len(xs) - 1, len(ys) - 1). Greedy: each time the maximal rectangle that covers most
    new area, of equal ones the largest. Largest first; no cell gives none.
    """
    if not inside.any():
        return np.empty((0, 4))
    spans = maximal_rectangles(inside)
    cells = np.diff(xs)[:, None] * np.diff(ys)[None, :]
    left = inside.copy()
    whole = float(cells[inside].sum())
    chosen: list[tuple[float, ...]] = []
    while left.any() and len(chosen) < MOST_RECTANGLES:
        best = spans[_best(spans, np.where(left, cells, 0.0), np.where(inside, cells, 0.0))]
        i0, i1, j0, j1 = best.tolist()
        left[i0:i1, j0:j1] = False
        chosen.append((xs[i0], ys[j0], xs[i1], ys[j1]))
        if chosen and float(cells[left].sum()) < SPARE * whole:
            break
    return np.array(chosen)


def _best(spans: Integers, fresh: Floats, area: Floats) -> int:
    gains, sizes = (_block_sums(values, spans) for values in (fresh, area))
    score = np.round(gains, 6) + 1e-7 * sizes / max(float(sizes.max()), 1e-9)
    return int(np.argmax(score))


def _block_sums(values: Floats, spans: Integers) -> Floats:
    table = np.zeros((values.shape[0] + 1, values.shape[1] + 1))
    table[1:, 1:] = values.cumsum(axis=0).cumsum(axis=1)
    i0, i1, j0, j1 = spans.T
    sums: Floats = table[i1, j1] - table[i0, j1] - table[i1, j0] + table[i0, j0]
    return sums


def maximal_rectangles(inside: Booleans) -> Integers:
    """Return all maximal rectangles of cells, one a row: i0, i1, j0, j1, ends exclusive.

    >>> maximal_rectangles(np.array([[True, True], [True, False]])).tolist()
    [[0, 1, 0, 2], [0, 2, 0, 1]]
    """
    rows, columns = inside.shape
    found = []
    for i0 in range(rows):
        common = np.ones(columns, dtype=bool)
        for i1 in range(i0 + 1, rows + 1):
            common = common & inside[i1 - 1]
            if not common.any():
                break
            for j0, j1 in _runs(common):
                above = i0 > 0 and bool(inside[i0 - 1, j0:j1].all())
                below = i1 < rows and bool(inside[i1, j0:j1].all())
                if not above and not below:
                    found.append((i0, i1, j0, j1))
    return np.array(sorted(found), dtype=np.int64).reshape(-1, 4)


def _runs(flags: Booleans) -> list[tuple[int, int]]:
    padded = np.concatenate([[False], flags, [False]])
    changes = np.flatnonzero(padded[1:] != padded[:-1]).tolist()
    return list(zip(changes[::2], changes[1::2], strict=True))
