"""Exact inference in the grammar's chain MRFs (KSTTP09 3.2, 3.3).

A label is (position, size) in cells; size 0 is an absent element, and absent elements stand at
the end of the chain, so that a chain of any number of nodes is one that may end at every element.
Max-product on a chain is a dynamic programme, and since an element begins where the one before
ends (floors) or a bounded gap later (stripes of windows), a message looks at the sizes of the one
before and the gap only, never at all pairs of labels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiled import compiled
from ..errors import Infeasible
from ..geometry.arrays import Floats, Integers
from .potentials import CELL, Weights


@dataclass(frozen=True, slots=True)
class Chain:
    """The optimal labelling: `starts` and `sizes` (cells) of the elements that exist, and E."""

    starts: tuple[int, ...]
    sizes: tuple[int, ...]
    energy: float


@dataclass(frozen=True, slots=True)
class ChainProblem:
    """A chain over n lines.

    sums: diagonal sums of line differences (n+1, n+1). unary: cost of every label
    (n+1, widest+1), ∞ where it is none. gaps: costs (n+1, longest+1) of the space before an
    element (eq. 8), of which those between two elements count; floors have one column of zeros.
    ends: cost (n+1,) of the line at which the last element ends, ∞ where it may not.
    grounded: the first element begins at line 0.
    """

    sums: Floats
    unary: Floats
    gaps: Floats
    weights: Weights
    ends: Floats
    grounded: bool


def solve(problem: ChainProblem) -> Chain:
    """Return the labelling of least energy (eq. 3 to 5). Raises Infeasible if there is none."""
    w = problem.weights
    scale = np.array([w.alpha, w.beta * CELL, w.gap])
    best, back = _messages(problem.sums, problem.unary, problem.gaps, scale, problem.grounded)
    ends = _ends(best, problem.ends)
    if not np.isfinite(ends).any():
        raise Infeasible("no chain of elements of the allowed sizes fills the picture")
    start, size = (int(v) for v in np.unravel_index(int(np.argmin(ends)), ends.shape))
    return _traced(back, start, size, float(ends[start, size]))


def _ends(best: Floats, costs: Floats) -> Floats:
    """Return the messages with what ending there costs."""
    n = len(best) - 1
    last = np.minimum(np.arange(n + 1)[:, None] + np.arange(best.shape[1]), n)
    ends: Floats = best + costs[last]
    return ends


def _traced(back: Integers, start: int, size: int, energy: float) -> Chain:
    starts, sizes = [start], [size]
    while back[start, size, 0]:
        before, gap = (int(v) for v in back[start, size])
        start, size = start - gap - before, before
        starts.append(start)
        sizes.append(size)
    return Chain(tuple(starts[::-1]), tuple(sizes[::-1]), energy)


@compiled
def _messages(
    sums: Floats, unary: Floats, gaps: Floats, scale: Floats, grounded: bool
) -> tuple[Floats, Integers]:
    """Return the least energy of chains that end in (start, size), and their last step."""
    n = len(sums) - 1
    widest = unary.shape[1] - 1
    alpha, beta, space = scale
    best = np.full((n + 1, widest + 1), np.inf)
    back = np.zeros((n + 1, widest + 1, 2), dtype=np.int64)
    for start in range(n):
        for size in range(1, min(widest, n - start) + 1):
            own = unary[start, size]
            if own == np.inf:
                continue
            least = own if start == 0 or not grounded else np.inf
            for gap in range(min(gaps.shape[1], start)):
                end = start - gap
                between = own + space * gaps[end, gap]
                for before in range(1, min(widest, end) + 1):
                    begin = end - before
                    energy = best[begin, before] + between
                    if energy >= least:  # all that is added is at least 0
                        continue
                    overlap = min(before, size)
                    alike = sums[begin + overlap, start + overlap] - sums[begin, start]
                    energy += alpha * alike / overlap + beta * abs(size - before)
                    if energy < least:
                        least = energy
                        back[start, size, 0] = before
                        back[start, size, 1] = gap
            best[start, size] = least
    return best, back
