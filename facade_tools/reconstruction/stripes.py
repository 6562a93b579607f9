"""The stripes of windows of a facade: the chain of its columns (KSTTP09 3.3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible
from ..geometry.arrays import Floats
from .chains import Chain, ChainProblem, solve
from .evidence import along_columns, repeated_columns
from .potentials import (
    Weights,
    boundary_costs,
    boundary_strength,
    diagonal_sums,
    gap_costs,
    labels,
    line_differences,
    run_contents,
)
from .storeys import Band, Facade

STRIPE = (5, 30)  # cells: widths of a stripe, 0.5 to 3 m
GAP = 60  # cells: the widest wall between two stripes
WEIGHTS = Weights(alpha=3.0, beta=0.4, boundary=0.05, gap=0.03, content=0.2)
EDGE = 0.15  # of the usual evidence: a stripe ends where it falls below
FEW = 0.5  # of the columns' root mean square: the usual evidence is no less
COST = 0.25  # of a stripe
CELL_SHARE = 0.4  # of the usual evidence: from here a cell holds a window
ROOF_BLUR = 2.0  # cells: a dormer's frame and its pane are one
ROW_SHARE = 0.4  # of the rows: from here a stripe is one

Span = tuple[int, int]


def stripes(facade: Facade, *, gaps: bool = True) -> Chain:
    """Return the stripes of windows from the left: the exact minimum of eq. 3 with eq. 8.

    gaps: with the term of walls between windows (homogeneous and symmetric); it can be switched
    off. A facade without any has an empty chain.
    """
    across = repeated_columns(facade.plane[facade.sky :], facade.storey)
    least = FEW * float(np.sqrt((across**2).mean()))  # where few columns hold anything, 95% is 0
    evidence = across / (max(float(np.percentile(across, 95)), least) + 1e-9)
    return _chain(facade.picture[facade.sky :], evidence - EDGE, gaps=gaps)


def _chain(picture: Floats, evidence: Floats, *, gaps: bool) -> Chain:
    side = np.ascontiguousarray(picture.transpose(1, 0, 2))
    n = len(side)
    widest = STRIPE[1]
    unary = (
        labels(n, STRIPE, STRIPE)
        + WEIGHTS.boundary * boundary_costs(boundary_strength(side), widest)
        - WEIGHTS.content * run_contents(evidence, widest)
        + COST
    )
    table = gap_costs(side, GAP) if gaps else np.zeros((n + 1, GAP + 1))
    ends = np.zeros(n + 1)
    sums = diagonal_sums(line_differences(side))
    try:
        return solve(ChainProblem(sums, unary, table, WEIGHTS, ends, grounded=False))
    except Infeasible:
        return Chain((), (), 0.0)


def roof_spans(facade: Facade, roof: Band, bands: Sequence[Band]) -> list[Span]:
    """Return the windows of a roof, which need not stand in the columns below it."""
    floors = [band for band in bands if band.kind == "floor" and band.high > band.low]
    across = [facade.plane[b.low : b.high].mean(axis=0) for b in floors or [roof]]
    usual = float(np.median([np.percentile(row, 90) for row in across]))
    own = facade.plane[roof.low : roof.high].mean(axis=0).astype(np.float64)
    evidence = along_columns(own, ROOF_BLUR) / (usual + 1e-9)
    chain = _chain(facade.picture[roof.low : roof.high], evidence, gaps=False)
    return [(start, start + size) for start, size in zip(chain.starts, chain.sizes, strict=True)]


def spans(chain: Chain, bands: Sequence[Band], plane: NDArray[np.float32]) -> list[Span]:
    """Return the stripes (x0, x1) in cells that hold something in most rows of windows.

    A stripe beside the facade (a neighbour, the picture's rim) repeats nothing.
    """
    found = [(start, start + size) for start, size in zip(chain.starts, chain.sizes, strict=True)]
    rows = [band for band in bands if band.high > band.low and band.kind != "roof"]
    if not rows or not found:
        return found
    held = np.array(
        [[plane[band.low : band.high, x0:x1].mean() for band in rows] for x0, x1 in found]
    )
    usual = float(np.median(held))
    share = (held > CELL_SHARE * usual).mean(axis=1)
    return [span for span, part in zip(found, share, strict=True) if part >= ROW_SHARE]
