"""What happens at one place and time: loose ends of the wavefront are linked anew by angle."""

from __future__ import annotations

import math

import numpy as np

from facade_tools.compiled import compiled

from .arrays import Integers
from .wavefront_front import (
    ALIVE,
    EOUT,
    NEXT,
    NODE,
    PREV,
    Edges,
    Front,
    L,
    N,
    V,
    add_node,
    add_vertex,
    bury,
    position,
)


@compiled
def gather(edges: Edges, front: Front, forced: Integers, time: float, near: float) -> int:
    """Mark (ALIVE = 2) the vertices at the place size[N]; collect the stubs that end there.

    Returns the number of stubs. Edges that pass through give two stubs.
    """
    x, y = front.node[front.size[N], 0], front.node[front.size[N], 1]
    for k in range(front.size[L]):
        v = front.live[k]
        px, py = position(front, v, time)
        if abs(px - x) <= near and abs(py - y) <= near:
            front.link[v, ALIVE] = 2
    for v in forced:
        if v >= 0:
            front.link[v, ALIVE] = 2
    stubs = 0
    for k in range(front.size[L]):
        v = front.live[k]
        u = front.link[v, NEXT]
        here, there = front.link[v, ALIVE] == 2, front.link[u, ALIVE] == 2
        if here and there:
            continue
        through = not here and not there and passes(edges, front, v, time, near)
        e = front.link[v, EOUT]
        if there or through:
            front.stub[stubs, 0], front.stub[stubs, 1], front.stub[stubs, 2] = e, v, 1
            stubs += 1
        if here or through:
            front.stub[stubs, 0], front.stub[stubs, 1], front.stub[stubs, 2] = e, u, 0
            stubs += 1
    return stubs


@compiled
def passes(edges: Edges, front: Front, v: int, time: float, near: float) -> bool:
    """Whether the edge after v runs through the place size[N]."""
    x, y = front.node[front.size[N], 0], front.node[front.size[N], 1]
    e = front.link[v, EOUT]
    aside = edges.normal[e, 0] * x + edges.normal[e, 1] * y
    if abs(aside - edges.offset[e] - edges.speed[e] * time) > near:
        return False
    dx, dy = edges.along[e, 0], edges.along[e, 1]
    x0, y0 = position(front, v, time)
    x1, y1 = position(front, front.link[v, NEXT], time)
    return bool((x - x0) * dx + (y - y0) * dy > 0.0 and (x1 - x) * dx + (y1 - y) * dy > 0.0)


@compiled
def settle(front: Front, time: float, near: float) -> int:
    """Bury the marked vertices at the place size[N]; return the node there."""
    x, y = front.node[front.size[N], 0], front.node[front.size[N], 1]
    node = -1
    for k in range(front.size[L]):
        v = front.live[k]
        if front.link[v, ALIVE] == 2:
            born = front.link[v, NODE]
            close = abs(front.node[born, 0] - x) <= near and abs(front.node[born, 1] - y) <= near
            if close and abs(front.node[born, 2] - time) <= near:
                node = born
    if node < 0:
        node = add_node(front, x, y, time)
    k = 0
    while k < front.size[L]:
        v = front.live[k]
        if front.link[v, ALIVE] == 2:
            bury(front, v, node)
        else:
            k += 1
    return int(node)


@compiled
def sort_stubs(edges: Edges, front: Front, stubs: int, near: float) -> None:
    """Sort stubs counter-clockwise by direction; of equal ones the leaving edge comes first."""
    angle = np.empty(stubs)
    stub = front.stub
    for k in range(stubs):
        sign = -1.0 if stub[k, 2] == 1 else 1.0
        e = stub[k, 0]
        angle[k] = math.atan2(sign * edges.along[e, 1], sign * edges.along[e, 0])
        if angle[k] < -math.pi + near:
            angle[k] += 2.0 * math.pi
    for k in range(1, stubs):
        j = k
        while j > 0:
            gap = angle[j - 1] - angle[j]
            if not (gap > near or (gap >= -near and stub[j - 1, 2] > stub[j, 2])):
                break
            angle[j - 1], angle[j] = angle[j], angle[j - 1]
            for c in range(3):
                stub[j - 1, c], stub[j, c] = stub[j, c], stub[j - 1, c]
            j -= 1


@compiled
def relink(edges: Edges, front: Front, node: int, stubs: int, near: float) -> int:
    """Join each leaving stub with the next arriving one; return the first new vertex or -1."""
    sort_stubs(edges, front, stubs, near)
    first = front.size[V]
    for k in range(stubs):
        if front.stub[k, 2] == 1:
            continue
        other = (k + 1) % stubs
        if front.stub[other, 2] == 0:
            return -1
        v = add_vertex(front, node, front.stub[other, 0], front.stub[k, 0])
        before, after = front.stub[other, 1], front.stub[k, 1]
        front.link[v, PREV], front.link[v, NEXT] = before, after
        front.link[before, NEXT] = v
        front.link[after, PREV] = v
    return int(first)
