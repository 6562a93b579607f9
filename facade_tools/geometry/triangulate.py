"""Triangles of planar polygons with holes, in plan or in space."""

from __future__ import annotations

from collections.abc import Sequence

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

from .arrays import Floats, Integers, Points2, Points3, Triangles
from .polygons import signed_area
from .triangulate_ears import clipped_ears


def newell_normal(points: Points3) -> Floats:
    """Return twice the area vector (3,) of the closed ring `points` (n, 3)."""
    local = points[1:] - points[0]
    (x, y, z), (u, v, w) = local[:-1].T, local[1:].T
    return np.array([y @ w - z @ v, z @ u - x @ w, x @ v - y @ u])


def flattened(points: Points3, normal: Floats) -> Points2:
    """Drop the coordinate that `normal` is largest in; orientation about the normal is kept."""
    axis = int(np.argmax(np.abs(normal)))
    u, v = [(1, 2), (2, 0), (0, 1)][axis]
    flat = points[:, [u, v]]
    return flat if normal[axis] >= 0 else flat[:, ::-1]


def triangulate_rings(rings: Sequence[Points2]) -> Triangles:
    """Return triangles (m, 3), counter-clockwise, over the concatenated points of the rings.

    rings: an outer ring, then holes, none closed. No point is added and every edge of a ring is
    an edge of exactly one triangle, also where points lie in one line (earcut alone drops such
    points). Points at one place, where rings touch, are taken as one.
    """
    points = np.concatenate(rings)
    _, first, place = np.unique(points, axis=0, return_index=True, return_inverse=True)
    triangles = _triangles(rings)
    return triangles if len(first) == len(points) else _named(triangles, first[place.ravel()])


def _triangles(rings: Sequence[Points2]) -> Triangles:
    """Return triangles over the points, of which those at one place stay apart."""
    points = np.ascontiguousarray(np.concatenate(rings), dtype=np.float64)
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    points = points - points.min(axis=0)
    found = np.asarray(mapbox_earcut.triangulate_float64(points, ends), dtype=np.int64)
    triangles = found.reshape(-1, 3)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    turned = _cross(b - a, c - a) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    whole = len(triangles) == len(points) + 2 * len(rings) - 4
    if not (whole and _covers(points, ends, triangles) and _pair(triangles, len(points))):
        order = _counter_clockwise(points, ends)
        return order[clipped_ears(points[order], ends.astype(np.int64))]
    return triangles


def _pair(triangles: Triangles, count: int) -> bool:
    """Whether no directed edge stands twice, and all but those of the rings stand both ways."""
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    forth, back = start * count + end, end * count + start
    alone = len(forth) - len(np.intersect1d(forth, back, assume_unique=True))
    return len(np.unique(forth)) == len(forth) and alone == count


def _counter_clockwise(points: Points2, ends: NDArray[np.uint32]) -> Integers:
    """Return the points' indices, the outer ring counter-clockwise and the holes clockwise."""
    rings = np.split(np.arange(len(points)), ends[:-1])
    right = [(signed_area(points[ring]) > 0) == (k == 0) for k, ring in enumerate(rings)]
    return np.concatenate([r if good else r[::-1] for r, good in zip(rings, right, strict=True)])


def _covers(points: Points2, ends: NDArray[np.uint32], triangles: Triangles) -> bool:
    """Whether the triangles have the area of the rings, and none is empty."""
    rings = np.split(points, ends[:-1])
    whole = abs(signed_area(rings[0])) - sum(abs(signed_area(ring)) for ring in rings[1:])
    a, b, c = (points[triangles[:, k]] for k in range(3))
    areas = np.abs(_cross(b - a, c - a)) / 2
    return bool(areas.min(initial=np.inf) > 0 and abs(areas.sum() - whole) <= 1e-9 * abs(whole))


def _named(triangles: Triangles, names: Integers) -> Triangles:
    """Return triangles under the names of their points, without those that vanish."""
    triangles = names[triangles]
    a, b, c = triangles.T
    return np.asarray(triangles[(a != b) & (b != c) & (c != a)], dtype=np.int64)


def _cross(a: Points2, b: Points2) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def triangulate_face(vertices: Points3, rings: Sequence[Integers]) -> Triangles:
    """Return triangles of a planar face in space, as indices of `vertices`.

    rings: indices of the outer ring (counter-clockwise from outside), then of the holes.
    """
    if len(rings) == 1 and len(rings[0]) == 3:
        return np.asarray(rings[0], dtype=np.int64).reshape(1, 3)
    index = np.concatenate([np.asarray(ring, dtype=np.int64) for ring in rings])
    normal = newell_normal(vertices[np.asarray(rings[0], dtype=np.int64)])
    # Which points are one, their vertices say: seen flat, others fall together too.
    flat = [flattened(vertices[list(ring)], normal) for ring in rings]
    return _named(_triangles(flat), index)
