"""The state of a shrinking wavefront: moving vertices, and the nodes and arcs they trace."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from facade_tools.compiled import compiled

from .arrays import Floats, Integers, Points2

# Columns of Front.place, Front.link and Front.size.
X, Y, T, VX, VY = 0, 1, 2, 3, 4
NODE, EIN, EOUT, PREV, NEXT, ALIVE, MATE = 0, 1, 2, 3, 4, 5, 6
V, N, A, L = 0, 1, 2, 3


class Edges(NamedTuple):
    """The polygon: direction (n, 2), inner normal (n, 2), offset (n,) and speed (n,) of edges."""

    along: Floats
    normal: Floats
    offset: Floats
    speed: Floats


class Front(NamedTuple):
    """The wavefront and what it has traced.

    place: (m, 5) where and when a vertex was born, and its velocity. link: (m, 7) birth node,
    edges before and after it, previous and next vertex, alive (2 while marked), next vertex with
    the same edge after it. head: (n,) first vertex of each edge. node: (k, 3) x, y, time. arc:
    (k, 4) from node, to node, face to the left, face to the right. size: numbers of vertices,
    nodes, arcs and live vertices. live: ids of the live vertices in any order; spot: the place
    of each in live. stub: (s, 3) edge, vertex at its far end, 1 for an edge that arrives.
    """

    place: Floats
    link: Integers
    head: Integers
    node: Floats
    arc: Integers
    size: Integers
    live: Integers
    spot: Integers
    stub: Integers


@compiled
def position(front: Front, v: int, time: float) -> tuple[float, float]:
    """Return where vertex v is at the time."""
    place = front.place
    after = time - place[v, T]
    return place[v, X] + place[v, VX] * after, place[v, Y] + place[v, VY] * after


@compiled
def add_node(front: Front, x: float, y: float, time: float) -> int:
    """Record a node of the skeleton and return its id."""
    k = front.size[N]
    front.node[k, 0], front.node[k, 1], front.node[k, 2] = x, y, time
    front.size[N] = k + 1
    return int(k)


@compiled
def add_vertex(front: Front, node: int, before: int, after: int) -> int:
    """Add a vertex at a node, between edges `before` and `after`, without neighbours yet."""
    v = front.size[V]
    front.size[V] = v + 1
    front.place[v, X], front.place[v, Y] = front.node[node, 0], front.node[node, 1]
    front.place[v, T] = front.node[node, 2]
    front.link[v, NODE], front.link[v, EIN], front.link[v, EOUT] = node, before, after
    front.link[v, ALIVE] = 1
    front.link[v, MATE] = front.head[after]
    front.head[after] = v
    front.spot[v] = front.size[L]
    front.live[front.size[L]] = v
    front.size[L] += 1
    return int(v)


@compiled
def bury(front: Front, v: int, node: int) -> None:
    """End vertex v at a node and record the arc that it traced."""
    front.link[v, ALIVE] = 0
    last = front.live[front.size[L] - 1]
    front.live[front.spot[v]] = last
    front.spot[last] = front.spot[v]
    front.size[L] -= 1
    if front.link[v, NODE] != node:
        k = front.size[A]
        front.arc[k, 0], front.arc[k, 1] = front.link[v, NODE], node
        front.arc[k, 2], front.arc[k, 3] = front.link[v, EIN], front.link[v, EOUT]
        front.size[A] = k + 1


@compiled
def set_course(edges: Edges, front: Front, v: int, near: float) -> bool:
    """Set the velocity of a vertex; False when it has to jump (edges parallel within `near`)."""
    i, o = front.link[v, EIN], front.link[v, EOUT]
    ax, ay = edges.along[i, 0], edges.along[i, 1]
    bx, by = edges.along[o, 0], edges.along[o, 1]
    cross = ax * by - ay * bx
    dot = ax * bx + ay * by
    p, q = edges.speed[i], edges.speed[o]
    front.place[v, VX] = front.place[v, VY] = 0.0
    if dot > 0.0 and abs(p - q) <= 1e-12:
        scale = p / (1.0 + dot)  # exact also where the edges are in one line
        front.place[v, VX] = scale * (edges.normal[i, 0] + edges.normal[o, 0])
        front.place[v, VY] = scale * (edges.normal[i, 1] + edges.normal[o, 1])
        return True
    if abs(cross) <= near:
        return False
    front.place[v, VX] = (bx * p - ax * q) / cross
    front.place[v, VY] = (by * p - ay * q) / cross
    return True


def wavefront(points: Points2, following: Integers) -> Front:
    """Return the wavefront at time 0: one vertex a point, edge k from point k on."""
    count = len(points)
    room = 8 * count + 64
    place = np.zeros((room, 5))
    link = np.zeros((room, 7), dtype=np.int64)
    place[:count, :2] = points
    ids = np.arange(count)
    before = np.empty(count, dtype=np.int64)
    before[following] = ids
    columns = (ids, before, ids, before, following, np.ones_like(ids), np.full(count, -1))
    link[:count] = np.column_stack(columns)
    node = np.zeros((room + 1, 3))
    node[:count, :2] = points
    live, spot = np.zeros((2, room), dtype=np.int64)
    live[:count] = spot[:count] = ids
    sizes = np.array([count, count, 0, count])
    arc = np.zeros((room, 4), dtype=np.int64)
    stub = np.zeros((2 * room, 3), dtype=np.int64)
    return Front(place, link, ids.copy(), node, arc, sizes, live, spot, stub)


def traced(front: Front) -> tuple[Floats, Integers]:
    """Return the nodes (m, 3) and arcs (k, 4) that the wavefront has traced."""
    return front.node[: front.size[N]].copy(), front.arc[: front.size[A]].copy()
