"""Structure of a building from its floors: cuts, blocks and their matching (LNSW13 4.2, 5.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..artifacts.blocks import Block
from ..artifacts.stylesheet import StyleBlock
from ..geometry.arrays import Floats, Integers

LEAST_CHANGE = 1.05  # of floor area, for a cut (CONTRACT)
SNAP_WINDOW = 0.2  # κ of 5.2.1, of the building's width


def cuts(areas: Sequence[float]) -> list[int]:
    """Return the indices i at which a new block begins: floor i against floor i − 1.

    r_i = larger over smaller area of successive floors; a cut is a strict local maximum of r above
    1.05, the ends compared with 1.

    >>> cuts([100, 100, 60, 60, 58])
    [2]
    """
    a = np.asarray(areas, dtype=np.float64)
    ratio = np.maximum(a[1:], a[:-1]) / np.maximum(np.minimum(a[1:], a[:-1]), 1e-12)
    around = np.concatenate([[1.0], ratio, [1.0]])
    peak = (ratio > LEAST_CHANGE) & (ratio > around[:-2]) & (ratio > around[2:])
    return (np.flatnonzero(peak) + 1).tolist()


def transformation_cost(source: Sequence[float], target: Sequence[float]) -> float:
    """Return Ψ_shape of two sizes (width, depth, height), at least 1 (eq. 7)."""
    a = np.asarray(source, dtype=np.float64) / math.fsum(source)
    b = np.asarray(target, dtype=np.float64) / math.fsum(target)
    return float(np.prod(np.maximum(a / b, b / a)))


def match_costs(sources: Floats, targets: Floats) -> Floats:
    """Return Ψ (eq. 6) of every source block (n, 3) for every target block (m, 3) as (n, m)."""
    volumes = [sizes.prod(axis=1) / sizes.prod(axis=1).sum() for sizes in (sources, targets)]
    volume = np.maximum.outer(*volumes) / np.minimum.outer(*volumes)
    a = sources / sources.sum(axis=1, keepdims=True)
    b = targets / targets.sum(axis=1, keepdims=True)
    ratio = a[:, None] / b[None]
    shape: Floats = np.maximum(ratio, 1 / ratio).prod(axis=2)
    costs: Floats = shape * volume
    return costs


def match_blocks(
    sources: Floats, source_roles: Sequence[str], targets: Floats, target_roles: Sequence[str]
) -> list[int]:
    """Return the source block of every target block: least Ψ among those of the same role.

    Bottom goes to bottom and top to top; a role that the source lacks takes any of its blocks.
    """
    costs = match_costs(sources, targets)
    chosen = []
    for j, role in enumerate(target_roles):
        same = [i for i, other in enumerate(source_roles) if other == role]
        candidates = same or list(range(len(source_roles)))
        chosen.append(min(candidates, key=lambda i: (costs[i, j], i)))
    return chosen


def chosen_style(
    styles: Sequence[Sequence[StyleBlock]],
    target: Sequence[Block],
    *,
    rng: np.random.Generator,
) -> int:
    """Return the index of one of several styles, drawn with odds of 1 over its mean cost Ψ.

    Alike structures are likely, others possible; with one style there is nothing to draw.
    """
    if len(styles) == 1:
        return 0
    goal = np.array([(block.width, block.depth, block.height) for block in target])
    costs = [match_costs(np.array([b.size for b in s]), goal).min(axis=0).mean() for s in styles]
    odds = 1 / np.array(costs)
    return int(rng.choice(len(styles), p=odds / odds.sum()))


def snapped(upper: Floats, lower: Floats, width: float) -> Floats:
    """Shift the vertices of an upper floor to those of the lower one by dynamic time warping.

    upper (n,), lower (m,): horizontal places in the reference view, increasing. A vertex moves at
    most κ·width, and only to a vertex that the optimal warping matches it with (5.2.1); of several
    the nearest. Returns (n,), increasing.
    """
    if len(upper) == 0 or len(lower) == 0:
        return upper.copy()
    distance = np.abs(upper[:, None] - lower[None])
    distance = np.where(distance <= SNAP_WINDOW * width, distance, np.inf)
    matched = _warping(distance)
    out = upper.copy()
    for i in range(len(upper)):
        row = matched[matched[:, 0] == i, 1]
        if len(row):
            out[i] = lower[row[np.argmin(distance[i, row])]]
    return np.maximum.accumulate(out)


def _warping(distance: Floats) -> Integers:
    """Return the matched pairs (k, 2) of the warping path of least total distance.

    Pairs beyond the window may not be matched: a path skips a vertex that has no partner at a
    price above any match.
    """
    n, m = distance.shape
    skip = 2 * np.max(distance, where=np.isfinite(distance), initial=0.0) + 1.0
    total = np.full((n + 1, m + 1), np.inf)
    total[0], total[:, 0] = skip * np.arange(m + 1), skip * np.arange(n + 1)
    step = np.zeros((n + 1, m + 1), dtype=np.int8)
    step[0, 1:], step[1:, 0] = 4, 3
    for i in range(1, n + 1):
        for j in range(1, m + 1):
            d = distance[i - 1, j - 1]
            options = (
                total[i - 1, j - 1] + d,
                total[i - 1, j] + d,
                total[i, j - 1] + d,
                total[i - 1, j] + skip,
                total[i, j - 1] + skip,
            )
            best = min(range(5), key=options.__getitem__)
            total[i, j], step[i, j] = options[best], best
    return _traced(step)


def _traced(step: np.ndarray[tuple[int, int], np.dtype[np.int8]]) -> Integers:
    i, j = step.shape[0] - 1, step.shape[1] - 1
    pairs = []
    while i or j:
        kind = int(step[i, j])
        if kind < 3 and i and j:
            pairs.append((i - 1, j - 1))
        i, j = i - (kind in (0, 1, 3)), j - (kind in (0, 2, 4))
    return np.array(pairs[::-1], dtype=np.int64).reshape(-1, 2)
