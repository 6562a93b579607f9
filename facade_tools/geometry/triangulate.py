"""Triangles of planar polygons with holes, in plan or in space."""

from __future__ import annotations

from collections.abc import Sequence

import mapbox_earcut
import numpy as np

from .arrays import Floats, Integers, Points2, Points3, Triangles


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

    rings: an outer ring, then holes, none closed. No point is added and every edge of a ring
    is an edge of exactly one triangle, also where points lie in one line (earcut alone drops
    such points). Points at one place, where rings touch, are taken as one.
    """
    points = np.ascontiguousarray(np.concatenate(rings), dtype=np.float64)
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    points = points - points.min(axis=0)
    found = np.asarray(mapbox_earcut.triangulate_float64(points, ends), dtype=np.int64)
    triangles = found.reshape(-1, 3)
    if len(triangles) != len(points) + 2 * len(rings) - 4:
        triangles = _conforming(points, _without_copies(points, triangles))
    a, b, c = (points[triangles[:, k]] for k in range(3))
    turned = _cross(b - a, c - a) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles


def _without_copies(points: Points2, triangles: Triangles) -> Triangles:
    """Let points at one place be one (where rings touch), and drop triangles that vanish."""
    _, first, place = np.unique(points, axis=0, return_index=True, return_inverse=True)
    triangles = first[place.ravel()][triangles]
    a, b, c = triangles.T
    return np.asarray(triangles[(a != b) & (b != c) & (c != a)], dtype=np.int64)


def _cross(a: Points2, b: Points2) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _conforming(points: Points2, triangles: Triangles) -> Triangles:
    """Split triangles at the points on their edges; the halves cover what flat ones did."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    reach = np.maximum(((b - a) ** 2).sum(axis=1), ((c - a) ** 2).sum(axis=1))
    flat = np.abs(_cross(b - a, c - a)) <= 1e-9 * reach
    _, first = np.unique(points, axis=0, return_index=True)
    pending = [tuple(row) for row in triangles[~flat].tolist()]
    done = []
    while pending:
        triangle = pending.pop()
        halves = _split(points, triangle, first)
        if halves:
            pending += halves
        else:
            done.append(triangle)
    return np.array(done, dtype=np.int64).reshape(-1, 3)


def _split(
    points: Points2, triangle: tuple[int, ...], candidates: Integers
) -> list[tuple[int, ...]]:
    """Return the two halves of a triangle at the first candidate inside one of its edges."""
    for k in range(3):
        a, b, c = triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]
        edge = points[b] - points[a]
        length = float(edge @ edge)
        offset = points[candidates] - points[a]
        along = offset @ edge / length
        aside = np.abs(offset[:, 0] * edge[1] - offset[:, 1] * edge[0])
        inside = (along > 0) & (along < 1) & (aside <= 1e-9 * length)
        inside &= (candidates != a) & (candidates != b) & (candidates != c)
        if inside.any():
            middle = int(candidates[np.flatnonzero(inside)[0]])
            return [(a, middle, c), (middle, b, c)]
    return []


def triangulate_face(vertices: Points3, rings: Sequence[Integers]) -> Triangles:
    """Return triangles of a planar face in space, as indices of `vertices`.

    rings: indices of the outer ring (counter-clockwise from outside), then of the holes.
    """
    if len(rings) == 1 and len(rings[0]) == 3:
        return np.asarray(rings[0], dtype=np.int64).reshape(1, 3)
    index = np.concatenate([np.asarray(ring, dtype=np.int64) for ring in rings])
    normal = newell_normal(vertices[np.asarray(rings[0], dtype=np.int64)])
    local = triangulate_rings([flattened(vertices[list(ring)], normal) for ring in rings])
    return index[local]
