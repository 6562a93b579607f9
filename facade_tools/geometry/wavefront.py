"""The shrinking wavefront of a polygon: state, events and the compiled event loop.

Every edge k of the polygon moves inwards at its speed; a wavefront vertex moves along the
intersection of its two edges' lines. The loop takes the earliest event, gathers *everything*
that is at its place at its time (vertices, and edges that pass through), and links the ends anew
by angle. So edge events, split events, vertex events and any mixture of them that happen at once
are one case. Two edges that meet face to face are closed like a zip: a vertex that jumps to the
nearer of their other ends, which leaves a horizontal ridge.

Aichholzer, Aurenhammer, Alberts, Gärtner: A novel type of skeleton for polygons (1995); Biedl,
Held, Huber, Kaaser, Palfrader: Weighted straight skeletons in the plane (2015).
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np

from facade_tools.compiled import compiled

from .arrays import Floats, Integers, Points2

DONE, UNLINKED, UNBOUNDED, EXHAUSTED = 0, 1, 2, 3

# Columns of Front.place and Front.link.
X, Y, T, VX, VY = 0, 1, 2, 3, 4
NODE, EIN, EOUT, PREV, NEXT, ALIVE, MATE = 0, 1, 2, 3, 4, 5, 6
JUMP, COLLAPSE, SPLIT = 0, 1, 2  # kinds of events, in the order at equal times

Event = tuple[float, int, int, int]


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


V, N, A, L = 0, 1, 2, 3  # columns of Front.size


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


# --- events ---------------------------------------------------------------------------------------
@compiled
def push_collapse(edges: Edges, front: Front, heap: list[Event], v: int, now: float) -> None:
    """Queue the time at which the edge from v to the next vertex has no length."""
    u = front.link[v, NEXT]
    e = front.link[v, EOUT]
    dx, dy = edges.along[e, 0], edges.along[e, 1]
    rate = (front.place[u, VX] - front.place[v, VX]) * dx
    rate += (front.place[u, VY] - front.place[v, VY]) * dy
    if rate < -1e-14:
        x0, y0 = position(front, v, now)
        x1, y1 = position(front, u, now)
        length = (x1 - x0) * dx + (y1 - y0) * dy
        heapq.heappush(heap, (now + max(length, 0.0) / -rate, COLLAPSE, v, u))


@compiled
def push_splits(
    edges: Edges, front: Front, heap: list[Event], v: int, near: float, limit: float
) -> None:
    """Queue the times at which a reflex vertex reaches the lines of the other edges."""
    i, o = front.link[v, EIN], front.link[v, EOUT]
    turn = edges.along[i, 0] * edges.along[o, 1] - edges.along[i, 1] * edges.along[o, 0]
    if turn >= -1e-12:
        return
    x, y, time = front.place[v, X], front.place[v, Y], front.place[v, T]
    for e in range(len(edges.speed)):
        if e in (i, o) or front.head[e] < 0:
            continue
        rate = edges.normal[e, 0] * front.place[v, VX] + edges.normal[e, 1] * front.place[v, VY]
        rate -= edges.speed[e]
        if rate < -1e-14:
            away = edges.normal[e, 0] * x + edges.normal[e, 1] * y
            away -= edges.offset[e] + edges.speed[e] * time
            if away > near and time + away / -rate < limit:
                heapq.heappush(heap, (time + away / -rate, SPLIT, v, e))


@compiled
def segment_at(edges: Edges, front: Front, e: int, time: float, near: float) -> int:
    """Return the vertex that starts the part of edge e nearest to node size[N], or -1.

    The place looked for is the last row of front.node that is not yet counted.
    """
    x, y = front.node[front.size[N], 0], front.node[front.size[N], 1]
    dx, dy = edges.along[e, 0], edges.along[e, 1]
    v, last = front.head[e], -1
    while v >= 0:
        following = front.link[v, MATE]
        if front.link[v, ALIVE] == 0:
            if last < 0:
                front.head[e] = following
            else:
                front.link[last, MATE] = following
        else:
            last = v
            x0, y0 = position(front, v, time)
            x1, y1 = position(front, front.link[v, NEXT], time)
            before = (x - x0) * dx + (y - y0) * dy
            after = (x1 - x) * dx + (y1 - y) * dy
            if before >= -near and after >= -near:
                return int(v)
        v = following
    return -1


@compiled
def jump_target(edges: Edges, front: Front, v: int, time: float) -> int:
    """Return the neighbour to which a vertex between parallel edges jumps."""
    i, o = front.link[v, EIN], front.link[v, EOUT]
    a, b = front.link[v, PREV], front.link[v, NEXT]
    dx, dy = edges.along[o, 0], edges.along[o, 1]
    if edges.along[i, 0] * dx + edges.along[i, 1] * dy > 0.0 and front.link[b, NEXT] != v:
        return int(a if edges.speed[i] < edges.speed[o] else b)
    ax, ay = position(front, a, time)
    bx, by = position(front, b, time)
    far_a = abs((ax - front.place[v, X]) * dx + (ay - front.place[v, Y]) * dy)
    far_b = abs((bx - front.place[v, X]) * dx + (by - front.place[v, Y]) * dy)
    return int(a if far_a < far_b else b)


# --- one node -------------------------------------------------------------------------------------
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


@compiled
def launch(
    edges: Edges, front: Front, heap: list[Event], first: int, near: float, limit: float
) -> None:
    """Set vertices from `first` on moving and queue their events."""
    for v in range(first, front.size[V]):
        if front.link[v, ALIVE] == 0:
            continue
        straight = set_course(edges, front, v, near)
        if not straight or front.link[front.link[v, NEXT], NEXT] == v:
            front.place[v, VX] = front.place[v, VY] = 0.0
            heapq.heappush(heap, (front.place[v, T], JUMP, v, 0))
    for v in range(first, front.size[V]):
        if front.link[v, ALIVE] == 0:
            continue
        now = front.place[v, T]
        push_collapse(edges, front, heap, v, now)
        if front.link[v, PREV] < first:
            push_collapse(edges, front, heap, front.link[v, PREV], now)
        push_splits(edges, front, heap, v, near * 0.01, limit)


@compiled
def locate(edges: Edges, front: Front, event: Event, forced: Integers, near: float) -> bool:
    """Write the event's place into front.node and its vertices into `forced`; False if void."""
    time, kind, v, w = event
    forced[0], forced[1] = v, -1
    if front.link[v, ALIVE] == 0:
        return False
    at = v
    if kind == COLLAPSE:
        if front.link[w, ALIVE] == 0 or front.link[v, NEXT] != w:
            return False
        forced[1] = w
        slow = front.place[v, VX] ** 2 + front.place[v, VY] ** 2
        if front.place[w, VX] ** 2 + front.place[w, VY] ** 2 < slow:
            at = w
    elif kind == JUMP:
        at = jump_target(edges, front, v, time)
        forced[1] = at
    x, y = position(front, at, time)
    front.node[front.size[N], 0], front.node[front.size[N], 1] = x, y
    return kind != SPLIT or segment_at(edges, front, w, time, near) >= 0


@compiled
def part_touching(edges: Edges, front: Front, forced: Integers, near: float) -> bool:
    """Link anew where rings of the polygon touch one another or themselves."""
    for v in range(len(front.head)):
        if front.link[v, ALIVE] == 0:
            continue
        forced[0], forced[1] = v, -1
        front.node[front.size[N]] = front.node[v]
        stubs = gather(edges, front, forced, 0.0, near)
        if stubs == 2:
            front.link[v, ALIVE] = 1
        elif relink(edges, front, settle(front, 0.0, near), stubs, near) < 0:
            return False
    return True


@compiled
def propagate(edges: Edges, front: Front, near: float, limit: float) -> int:
    """Run all events; front.link and front.place hold the polygon's vertices at time 0."""
    heap = [(0.0, JUMP, 0, 0)]
    heap.pop()
    forced = np.full(2, -1, dtype=np.int64)
    if not part_touching(edges, front, forced, near):
        return UNLINKED
    launch(edges, front, heap, 0, near, limit)
    now = 0.0
    room = len(front.place) - 8
    while len(heap) > 0 and front.size[L] > 0:
        time, kind, v, w = heapq.heappop(heap)
        time = max(time, now)
        if not locate(edges, front, (time, kind, v, w), forced, near):
            continue
        now = time
        stubs = gather(edges, front, forced, now, near)
        node = settle(front, now, near)
        if front.size[V] + stubs > room:
            return EXHAUSTED
        first = relink(edges, front, node, stubs, near)
        if first < 0:
            return UNLINKED
        launch(edges, front, heap, first, near, limit)
    return DONE if front.size[L] == 0 else UNBOUNDED


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
