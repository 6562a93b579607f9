"""Outlines of unions of rectangles as simple rings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .arrays import Points2, Rectangles
from .boxes import Grid, union_grid

Node = tuple[int, int]  # indices into the grid's xs and ys
STEPS: tuple[Node, ...] = ((1, 0), (0, 1), (-1, 0), (0, -1))  # counter-clockwise


def union_rings(rectangles: Rectangles) -> list[Points2]:
    """Return the outline of a union of rectangles as simple rings, metres.

    Outer rings run counter-clockwise, holes clockwise; no vertex is collinear with its
    neighbours and none stands twice in a ring: rings that touch do so in single points. A ring
    starts at its lowest vertex (the leftmost of those); outer rings come first, by that vertex.

    >>> [ring.tolist() for ring in union_rings(np.array([[0, 0, 2, 1], [1, 0, 3, 1.0]]))]
    [[[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]]]
    """
    grid = union_grid(rectangles)
    xs, ys = grid[:2]
    rings = []
    for loop in _loops(grid):
        for simple in _split(loop):
            corners = _corners(simple)
            rings.append(np.array([[xs[i], ys[j]] for i, j in corners]))
    return sorted(map(_from_lowest, rings), key=_rank)


def signed_area(ring: Points2) -> float:
    """Return the area of a ring (n, 2): positive counter-clockwise, negative clockwise (m²)."""
    x, y = ring[:, 0] - ring[0, 0], ring[:, 1] - ring[0, 1]
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


def _rank(ring: Points2) -> tuple[bool, float, float]:
    return signed_area(ring) < 0, ring[0, 1], ring[0, 0]


def _from_lowest(ring: Points2) -> Points2:
    first = int(np.lexsort((ring[:, 0], ring[:, 1]))[0])
    return np.roll(ring, -first, axis=0)


def _directed_edges(grid: Grid) -> set[tuple[Node, int]]:
    """Return (start node, direction) of every cell edge on the outline, the inside at its left."""
    cells = np.pad(grid[2], 1)
    inside, low, left = cells[1:, 1:], cells[1:, :-1], cells[:-1, 1:]
    edges: set[tuple[Node, int]] = set()
    for step, mask, offset in (
        (0, inside & ~low, (0, 0)),
        (2, low & ~inside, (1, 0)),
        (3, inside & ~left, (0, 1)),
        (1, left & ~inside, (0, 0)),
    ):
        starts = np.argwhere(mask) + offset
        edges |= {((i, j), step) for i, j in starts.tolist()}
    return edges


def _loops(grid: Grid) -> Iterator[list[Node]]:
    """Yield closed walks along the outline that turn left wherever there is a choice."""
    edges = _directed_edges(grid)
    for start in sorted(edges):
        loop: list[Node] = []
        node, step = start
        while (node, step) in edges:
            edges.remove((node, step))
            loop.append(node)
            node = (node[0] + STEPS[step][0], node[1] + STEPS[step][1])
            turns = ((step + turn) % 4 for turn in (1, 0, -1))
            step = next((turn for turn in turns if (node, turn) in edges), step)
        if loop:
            yield loop


def _split(loop: list[Node]) -> Iterator[list[Node]]:
    """Yield the simple rings of a closed walk: it is cut wherever it meets itself."""
    path: list[Node] = []
    at: dict[Node, int] = {}
    for node in loop:
        if node in at:
            first = at[node]
            yield path[first:]
            for gone in path[first + 1 :]:
                del at[gone]
            del path[first + 1 :]
        else:
            at[node] = len(path)
            path.append(node)
    yield path


def _corners(ring: list[Node]) -> list[Node]:
    around = zip([ring[-1], *ring[:-1]], ring, [*ring[1:], ring[0]], strict=True)
    return [b for a, b, c in around if (a[0] == b[0]) != (b[0] == c[0])]
