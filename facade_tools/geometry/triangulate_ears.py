"""Ear clipping that never drops a point: for what the fast triangulation cannot take.

Slower (cubic), but points in one line, touching rings and slivers all get n + 2h − 2 triangles
that close the surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .arrays import Floats, Integers, Points2, Triangles


def clipped_ears(points: Points2, ends: Integers) -> Triangles:
    """Return triangles over the points; ring k ends before point ends[k], holes clockwise."""
    points, ends = np.ascontiguousarray(points), np.asarray(ends, dtype=np.int64)
    starts = np.concatenate([[0], ends[:-1]]).astype(np.int64)
    return np.asarray(_clipped(points, _joined(points, starts, ends)), dtype=np.int64)


@compiled
def _joined(points: Points2, starts: Integers, ends: Integers) -> Integers:
    """Return one ring: each hole joined to it by a bridge, the one of the shortest bridge first.

    A hole's bridge is sought only when nothing else could be shorter: until then its distance
    from the ring is a bound. What is found holds until a later bridge takes it or comes as near.
    """
    holes, size = len(ends) - 1, int(ends[0])
    ring = np.empty(ends[-1] + 2 * holes, dtype=np.int64)
    ring[:size] = np.arange(size)
    left, known = np.ones(holes, dtype=np.bool_), np.zeros(holes, dtype=np.bool_)
    length, at, to = np.empty(holes), np.zeros(holes, np.int64), np.zeros(holes, np.int64)
    for k in range(holes):
        length[k] = _distance(points, ring[:size], starts[k + 1], ends[k + 1])
    for _ in range(holes):
        best = _first(length, left)
        while not known[best]:
            length[best], at[best], to[best] = _bridge(points, ring[:size], best + 1, starts, ends)
            known[best] = True
            best = _first(length, left)
        left[best] = False
        place, added = int(at[best]), int(ends[best + 1] - starts[best + 1]) + 2
        _spliced(ring, size, place, (starts[best + 1], ends[best + 1], to[best]))
        size += added
        for k in range(holes):
            if not left[k]:
                continue
            near = _distance(points, ring[place : place + added + 1], starts[k + 1], ends[k + 1])
            if near <= length[k] or at[k] == place:
                known[k] = False
            elif known[k] and length[k] < np.inf:
                at[k] += added if at[k] > place else 0
                known[k] = not _taken(points, ring, place, (ring[at[k]], starts[k + 1] + to[k]))
            length[k] = min(length[k], near)
    return ring


@compiled
def _first(length: Floats, left: NDArray[np.bool_]) -> int:
    """Return the place of the least length of what is left."""
    best = -1
    for k in range(len(length)):
        if left[k] and (best < 0 or length[k] < length[best]):
            best = k
    return best


@compiled
def _distance(points: Points2, ring: Integers, start: int, end: int) -> float:
    """Return the least squared distance between points of the ring and of a hole."""
    least = np.inf
    for i in ring:
        for j in range(start, end):
            gap = points[i] - points[j]
            least = min(least, gap[0] * gap[0] + gap[1] * gap[1])
    return least


@compiled
def _spliced(ring: Integers, size: int, place: int, hole: tuple[int, int, int]) -> None:
    """Put a hole (start, end, first) into the ring after a place: there, round it, and back."""
    start, end, first = hole
    count = end - start
    for k in range(size - 1, place - 1, -1):
        ring[k + count + 2] = ring[k]
    for k in range(count + 1):
        ring[place + 1 + k] = start + (first + k) % count


@compiled
def _taken(points: Points2, ring: Integers, place: int, bridge: tuple[int, int]) -> bool:
    """Whether the bridge that begins at a place of the ring crosses another one, either way."""
    a, b = bridge
    c, d = ring[place], ring[place + 1]
    return _cross(points, a, b, c, d) or _cross(points, a, b, d, c)


@compiled
def _turn(points: Points2, a: int, b: int, c: int) -> float:
    """Return twice the area of the triangle, positive when counter-clockwise."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    return float(ux * vy - uy * vx)


@compiled
def _bridge(
    points: Points2, ring: Integers, hole: int, starts: Integers, ends: Integers
) -> tuple[float, int, int]:
    """Return length and places of the shortest bridge from ring to hole that crosses no edge."""
    best, at, to = np.inf, 0, 0
    every = np.arange(ends[-1])
    own = every[starts[hole] : ends[hole]]
    for i in range(len(ring)):
        for j in range(len(own)):
            a, b = ring[i], own[j]
            gap = points[a] - points[b]
            length = gap[0] * gap[0] + gap[1] * gap[1]
            if length >= best:
                continue
            if length > 0.0:
                if not (_ahead(points, ring, i, b) and _ahead(points, own, j, a)):
                    continue
                if _crosses(points, a, b, ring, 0, len(ring)):
                    continue
                if _crosses_any(points, a, b, every, starts, ends):
                    continue
            best, at, to = length, i, j
    return best, at, to


@compiled
def _ahead(points: Points2, ring: Integers, place: int, goal: int) -> bool:
    """Whether the goal lies in the inner angle of the ring at a place."""
    before, here = ring[place - 1 if place else len(ring) - 1], ring[place]
    after = ring[place + 1 if place + 1 < len(ring) else 0]
    first, second = _turn(points, before, here, goal) > 0, _turn(points, here, after, goal) > 0
    if _turn(points, before, here, after) > 0:
        return first and second
    return first or second


@compiled
def _crosses(points: Points2, a: int, b: int, ring: Integers, start: int, end: int) -> bool:
    """Whether the segment from a to b properly crosses an edge of ring[start:end]."""
    for k in range(start, end):
        if _cross(points, a, b, ring[k], ring[k + 1 if k + 1 < end else start]):
            return True
    return False


@compiled
def _cross(points: Points2, a: int, b: int, c: int, d: int) -> bool:
    """Whether the segments from a to b and from c to d properly cross."""
    return (
        _turn(points, a, b, c) * _turn(points, a, b, d) < 0.0
        and _turn(points, c, d, a) * _turn(points, c, d, b) < 0.0
    )


@compiled
def _crosses_any(
    points: Points2, a: int, b: int, every: Integers, starts: Integers, ends: Integers
) -> bool:
    """Whether the segment from a to b properly crosses an edge of any ring."""
    crossed = False
    for r in range(len(ends)):
        crossed = crossed or _crosses(points, a, b, every, starts[r], ends[r])
    return crossed


@compiled
def _clipped(points: Points2, ring: Integers) -> Triangles:
    """Cut off the best-shaped ear until a triangle is left."""
    ring = ring.copy()
    size = len(ring)
    triangles = np.empty((max(size - 2, 0), 3), dtype=np.int64)
    for t in range(len(triangles)):
        best, tip = -np.inf, 0
        for k in range(size):
            a, b, c = ring[k - 1 if k else size - 1], ring[k], ring[k + 1 if k + 1 < size else 0]
            quality = _quality(points, a, b, c)
            if quality > best:
                if quality > 0.0 and _occupied(points, ring, size, a, b, c):
                    quality -= 2.0  # worse than any ear without points inside
                if quality > best:
                    best, tip = quality, k
        a = ring[tip - 1 if tip else size - 1]
        c = ring[tip + 1 if tip + 1 < size else 0]
        triangles[t, 0], triangles[t, 1], triangles[t, 2] = a, ring[tip], c
        for k in range(tip, size - 1):
            ring[k] = ring[k + 1]
        size -= 1
    return triangles


@compiled
def _quality(points: Points2, a: int, b: int, c: int) -> float:
    """Return the doubled area over the longest edge's square: 0.87 if equilateral, < 0 if bad."""
    longest = 0.0
    for p, q in ((a, b), (b, c), (c, a)):
        gap = points[p] - points[q]
        longest = max(longest, gap[0] * gap[0] + gap[1] * gap[1])
    if longest == 0.0:
        return 0.0
    return _turn(points, a, b, c) / longest


@compiled
def _occupied(points: Points2, ring: Integers, size: int, a: int, b: int, c: int) -> bool:
    """Whether another point of the ring lies in the triangle or on its diagonal."""
    for k in range(size):
        p = ring[k]
        if p in (a, b, c):
            continue
        x, y = points[p, 0], points[p, 1]
        if (
            (x == points[a, 0] and y == points[a, 1])
            or (x == points[b, 0] and y == points[b, 1])
            or (x == points[c, 0] and y == points[c, 1])
        ):
            continue
        inside = _turn(points, a, b, p) >= 0.0 and _turn(points, b, c, p) >= 0.0
        if inside and _turn(points, c, a, p) >= 0.0:
            return True
    return False
