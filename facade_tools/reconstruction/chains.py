"""Exact inference in the grammar's chain MRFs (KSTTP09 3.2, 3.3).

A label is (position, size) in cells; size 0 is an absent element, and absent elements stand at
the end of the chain. Max-product on a chain is a dynamic programme, and since an element begins
where the one before ends (floors) or a bounded gap later (stripes of windows), a message looks at
the sizes of the one before and the gap only, never at all pairs of labels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiled import compiled
from ..errors import Infeasible
from ..geometry.arrays import Floats, Integers
from .potentials import CELL, Weights

Sizes = tuple[int, int]  # least and greatest, in cells


@dataclass(frozen=True, slots=True)
class Chain:
    """The optimal labelling: `starts` and `sizes` (cells) of the elements that exist, and E."""

    starts: tuple[int, ...]
    sizes: tuple[int, ...]
    energy: float


@dataclass(frozen=True, slots=True)
class ChainProblem:
    """A chain over n lines.

    sums: diagonal sums of line differences (n+1, n+1). boundary: B (n+1,). first, other: allowed
    sizes of the first and of the other elements. gaps: costs (n+1, longest+1) of the space before
    an element (eq. 8), of which those between two elements count; floors have one column of zeros.
    length: most elements. tight: the first begins at line 0 and the last ends at line n.
    """

    sums: Floats
    boundary: Floats
    first: Sizes
    other: Sizes
    gaps: Floats
    length: int
    weights: Weights
    tight: bool


def solve(problem: ChainProblem) -> Chain:
    """Return the labelling of least energy (eq. 3 to 5). Raises Infeasible if there is none."""
    n = len(problem.boundary) - 1
    w = problem.weights
    widest = max(problem.first[1], problem.other[1])
    scale = np.array([w.alpha, w.beta * CELL, w.boundary, w.gap])
    best, back = _messages(
        problem.sums,
        problem.boundary,
        np.array([*problem.first, *problem.other, widest], dtype=np.int64),
        problem.gaps,
        problem.length,
        scale,
        problem.tight,
    )
    ends = _ends(best, n, problem.tight)
    if not np.isfinite(ends).any():
        raise Infeasible("no chain of elements of the allowed sizes fills the picture")
    node, start, size = (int(v) for v in np.unravel_index(int(np.argmin(ends)), ends.shape))
    energy = float(ends[node, start, size])
    return _traced(back, node, start, size, energy)


def _ends(best: Floats, n: int, tight: bool) -> Floats:
    """Return the messages at which a chain may end."""
    if not tight:
        return best
    ends = np.full_like(best, np.inf)
    for size in range(best.shape[2]):
        if size <= n:
            ends[:, n - size, size] = best[:, n - size, size]
    return ends


def _traced(back: Integers, node: int, start: int, size: int, energy: float) -> Chain:
    starts, sizes = [start], [size]
    while node:
        before, gap = (int(v) for v in back[node, start, size])
        node, start, size = node - 1, start - gap - before, before
        starts.append(start)
        sizes.append(size)
    return Chain(tuple(starts[::-1]), tuple(sizes[::-1]), energy)


@compiled
def _messages(
    sums: Floats,
    boundary: Floats,
    sizes: Integers,
    gaps: Floats,
    length: int,
    scale: Floats,
    tight: bool,
) -> tuple[Floats, Integers]:
    """Return the least energy of chains that end in (node, start, size), and their last step."""
    n = len(boundary) - 1
    alpha, beta, edge, space = scale
    first_low, first_high, low, high, widest = sizes
    best = np.full((length, n + 1, widest + 1), np.inf)
    back = np.zeros((length, n + 1, widest + 1, 2), dtype=np.int64)
    for start in range(1 if tight else n):
        for size in range(first_low, min(first_high, n - start) + 1):
            best[0, start, size] = -edge * (boundary[start] + boundary[start + size])
    for node in range(1, length):
        before_low = first_low if node == 1 else low
        before_high = first_high if node == 1 else high
        for start in range(1, n):
            for size in range(low, min(high, n - start) + 1):
                unary = -edge * (boundary[start] + boundary[start + size])
                for gap in range(min(gaps.shape[1], start)):
                    end = start - gap
                    between = space * gaps[end, gap]
                    for before in range(before_low, min(before_high, end) + 1):
                        begin = end - before
                        energy = best[node - 1, begin, before]
                        if energy == np.inf:
                            continue
                        overlap = min(before, size)
                        alike = sums[begin + overlap, start + overlap] - sums[begin, start]
                        energy += alpha * alike / overlap + beta * abs(size - before)
                        energy += unary + between
                        if energy < best[node, start, size]:
                            best[node, start, size] = energy
                            back[node, start, size, 0] = before
                            back[node, start, size, 1] = gap
    return best, back
