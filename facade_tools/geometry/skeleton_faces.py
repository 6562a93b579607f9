"""Faces of a skeleton, put together from the arcs that the wavefront traced."""

from __future__ import annotations

import numpy as np

from facade_tools.compiled import compiled

from .arrays import Floats, Integers

SHORT = 1e-9  # arcs below this share of the polygon's size become one node


Rings = list[tuple[int, Integers]]  # the edge whose face it bounds, and the ring


def faces_of(nodes: Floats, arcs: Integers, following: Integers) -> Rings | None:
    """Return the rings of the edges' faces, or None when some face does not close.

    The ring of face k that begins with edge k is at place k; rings inside a face follow. (With
    unequal speeds a fast edge may sweep around a slow hole and meet itself behind it.)

    nodes: (m, 3) x, y, time; the first n are the polygon's points. arcs: (k, 4) from node, to
    node, face to the left, face to the right. following: (n,) next point of each point.
    """
    count = len(following)
    home = _merged_nodes(nodes, arcs, count)
    base = np.column_stack([np.arange(count), following, np.arange(count)])
    arcs = arcs[arcs[:, 2] != arcs[:, 3]]
    left, right = arcs[:, [0, 1, 2]], arcs[:, [1, 0, 3]]
    sides = np.concatenate([base, left, right])
    sides[:, :2] = home[sides[:, :2]]
    sides = sides[sides[:, 0] != sides[:, 1]]
    sides = sides[np.argsort(sides[:, 2], kind="stable")]
    starts = np.searchsorted(sides[:, 2], np.arange(count + 1))
    flat, ends = _chained(sides, starts)
    if len(flat) == 0:
        return None
    edges = np.searchsorted(starts, np.concatenate([[0], ends[:-1]]), side="right") - 1
    again = np.concatenate([[False], edges[1:] == edges[:-1]])
    rings = list(zip(edges.tolist(), np.split(flat, ends[:-1]), strict=True))
    return [rings[k] for k in np.argsort(again, kind="stable")]


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
def _chained(sides: Integers, starts: Integers) -> tuple[Integers, Integers]:
    """Order the sides (from, to, face) of each face to closed rings; empty on failure.

    Returns the nodes of all rings and where each ring ends.
    """
    flat = np.empty(len(sides), dtype=np.int64)
    ends = np.empty(len(sides), dtype=np.int64)
    used = np.zeros(len(sides), dtype=np.bool_)
    rings = 0
    for f in range(len(starts) - 1):
        first = here = -1
        for place in range(starts[f], starts[f + 1]):
            found = -1
            for k in range(starts[f], starts[f + 1]):
                if not used[k] and (here == first or sides[k, 0] == here):
                    found = k
                    break
            if found < 0:
                return flat[:0], ends[:0]
            if here == first:
                first = sides[found, 0]
            flat[place] = sides[found, 0]
            used[found] = True
            here = sides[found, 1]
            if here == first:
                ends[rings] = place + 1
                rings += 1
        if here != first:
            return flat[:0], ends[:0]
    return flat, ends[:rings]
