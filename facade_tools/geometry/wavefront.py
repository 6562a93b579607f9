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

import numpy as np

from facade_tools.compiled import compiled

from .arrays import Integers
from .wavefront_front import (
    ALIVE,
    EIN,
    EOUT,
    MATE,
    NEXT,
    PREV,
    VX,
    VY,
    Edges,
    Front,
    L,
    N,
    T,
    V,
    X,
    Y,
    position,
    set_course,
)
from .wavefront_node import gather, relink, settle

DONE, UNLINKED, UNBOUNDED, EXHAUSTED = 0, 1, 2, 3
JUMP, COLLAPSE, SPLIT = 0, 1, 2  # kinds of events, in the order at equal times

Event = tuple[float, int, int, int]


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
