"""Structure of a building from its floors: cuts, blocks and their matching (LNSW13 4.2, 5.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..artifacts.blocks import Block, BlockRole
from ..artifacts.stylesheet import StyleBlock
from ..geometry.arrays import Floats
from .storeys import LEAST_STOREY

LEAST_CHANGE = 1.05  # of floor area, for a cut (CONTRACT)


@dataclass(frozen=True, slots=True)
class Candidate:
    """A block in the matching: role, size (m), and its middle as shares of its building."""

    role: BlockRole
    size: tuple[float, ...]
    place: tuple[float, ...]


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


def match_blocks(sources: Sequence[Candidate], targets: Sequence[Candidate]) -> list[int]:
    """Return the source block of every target block: least Ψ among those of the same role.

    Bottom goes to bottom and top to top; a role that the source lacks takes any of its blocks. A
    body as high as a storey takes no moulding (a lower block) where the source has others. Of
    blocks with equal costs the one that lies most alike in its building is taken.
    """
    costs = match_costs(*(np.array([c.size for c in side]) for side in (sources, targets)))
    chosen = []
    for j, target in enumerate(targets):
        same = [i for i, source in enumerate(sources) if source.role == target.role]
        if target.role == "body" and target.size[2] >= LEAST_STOREY:
            same = [i for i in same if sources[i].size[2] >= LEAST_STOREY] or same
        candidates = same or list(range(len(sources)))
        least = min(costs[i, j] for i in candidates)
        equal = [i for i in candidates if costs[i, j] <= least * (1 + 1e-9)]
        chosen.append(min(equal, key=lambda i: (math.dist(sources[i].place, target.place), i)))
    return chosen


def candidates(blocks: Sequence[Block]) -> list[Candidate]:
    """Return blocks as candidates of the matching."""
    low = np.array([(b.x, b.y, b.z) for b in blocks])
    size = np.array([(b.width, b.depth, b.height) for b in blocks])
    whole = (low + size).max(axis=0) - low.min(axis=0)
    places = (low + 0.5 * size - low.min(axis=0)) / whole
    return [
        Candidate(block.role, tuple(s), tuple(p))
        for block, s, p in zip(blocks, size.tolist(), places.tolist(), strict=True)
    ]


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
