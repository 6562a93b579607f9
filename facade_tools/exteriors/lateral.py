"""Lateral edges between groups: which are possible, and which make a cycle."""

from __future__ import annotations

import numpy as np

from .dataset import Dataset, GroupData
from .layout import Layout
from .network import Weights

ROWS_EACH = 10  # rows of the child that each lateral input needs at least
KNOWN_SHARE = 0.98  # a feature is a parent only where this share of the child's rows knows it
Inputs = tuple[int, ...]


def admissible(data: Dataset, weights: Weights, layout: Layout) -> list[dict[int, Inputs]]:
    """Return for each child the features that each parent group (−1 …: bits) can show it.

    A feature counts only where (nearly) all rows that observe the child know it, and where it
    varies among them.
    """
    owners = parent_of(layout)
    out = []
    for g, group in enumerate(data.groups):
        rows = group.dense.any(axis=1) & (weights.groups[g] > 0)
        usable: dict[int, list[int]] = {}
        if rows.any() and layout.groups[g].coordinates:
            known = data.known[rows].mean(axis=0)
            varies = data.features[rows].std(axis=0) > 1e-6
            for f in np.flatnonzero((known >= KNOWN_SHARE) & varies):
                if owners[f] != g:
                    usable.setdefault(owners[f], []).append(int(f))
        out.append({parent: tuple(features) for parent, features in usable.items()})
    return out


def parent_of(layout: Layout) -> list[int]:
    """Return the owner of each feature: a group, or −1, −2, … a vector of bits."""
    names = [group.name for group in layout.bit_groups]
    return [
        owner if owner >= 0 else -1 - names.index(name.split(".")[0])
        for owner, name in zip(layout.feature_group, layout.features, strict=True)
    ]


def acyclic(inputs: tuple[Inputs, ...], layout: Layout) -> bool:
    """Tell whether the lateral edges, with r1 before r2, have no cycle."""
    owners = parent_of(layout)
    parents = [{owners[f] for f in features if owners[f] >= 0} for features in inputs]
    names = [group.name for group in layout.groups]
    if "far" in names and "arf" in names:
        parents[names.index("arf")].add(names.index("far"))
    done: set[int] = set()
    while ready := [g for g, p in enumerate(parents) if g not in done and p <= done]:
        done.update(ready)
    return len(done) == len(parents)


def crowded(inputs: Inputs, child: GroupData) -> bool:
    """Tell whether a child has too few rows that observe it for so many inputs."""
    return len(inputs) * ROWS_EACH > int(child.dense.any(axis=1).sum())
