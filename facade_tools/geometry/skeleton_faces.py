"""Faces of a skeleton, put together from the arcs that the wavefront traced."""

from __future__ import annotations

import numpy as np

from facade_tools.compiled import compiled

from .arrays import Floats, Integers

SHORT = 1e-9  # arcs below this share of the polygon's size become one node


def faces_of(nodes: Floats, arcs: Integers, following: Integers) -> tuple[Integers, ...] | None:
    """Return the ring of each edge's face, or None when some face does not close.

    nodes: (m, 3) x, y, time; the first n are the polygon's points. arcs: (k, 4) from node, to
    node, face to the left, face to the right. following: (n,) next point of each point.
    """
    count = len(following)
    home = _merged_nodes(nodes, arcs, count)
    base = np.column_stack([np.arange(count), following, np.arange(count)])
    left, right = arcs[:, [0, 1, 2]], arcs[:, [1, 0, 3]]
    sides = np.concatenate([base, left, right])
    sides[:, :2] = home[sides[:, :2]]
    sides = sides[sides[:, 0] != sides[:, 1]]
    sides = sides[np.argsort(sides[:, 2], kind="stable")]
    starts = np.searchsorted(sides[:, 2], np.arange(count + 1))
    flat = _chained(sides, starts)
    if len(flat) == 0:
        return None
    return tuple(np.split(flat, starts[1:-1]))


@compiled
def _merged_nodes(nodes: Floats, arcs: Integers, count: int) -> Integers:
    """Return for each node the one that stands for it; ends of short arcs share one."""
    home = np.arange(len(nodes))
    for k in range(len(arcs)):
        a, b = arcs[k, 0], arcs[k, 1]
        gap = np.abs(nodes[a] - nodes[b]).max()
        if gap <= SHORT:
            while home[a] != a:
                a = home[a]
            while home[b] != b:
                b = home[b]
            if max(a, b) >= count:
                home[max(a, b)] = min(a, b)
    for k in range(len(home)):
        a = k
        while home[a] != a:
            a = home[a]
        home[k] = a
    return home


@compiled
def _chained(sides: Integers, starts: Integers) -> Integers:
    """Order the sides (from, to, face) of each face to one closed ring; empty on failure."""
    flat = np.empty(len(sides), dtype=np.int64)
    used = np.zeros(len(sides), dtype=np.bool_)
    for f in range(len(starts) - 1):
        here = sides[starts[f], 0]
        for place in range(starts[f], starts[f + 1]):
            found = -1
            for k in range(starts[f], starts[f + 1]):
                if not used[k] and sides[k, 0] == here:
                    found = k
                    break
            if found < 0:
                return flat[:0]
            flat[place] = here
            used[found] = True
            here = sides[found, 1]
        if here != sides[starts[f], 0]:
            return flat[:0]
    return flat
