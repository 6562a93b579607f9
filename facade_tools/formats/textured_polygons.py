"""Polygons of any size as triangles: by ear clipping, never fanned, none of them twice."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import repeat

import numpy as np

from ..errors import InvalidInput
from ..geometry.arrays import Floats, Integers, Points3
from ..geometry.triangulate import triangulate_face
from .textured import Paint, TexturedMesh

MAX_CORNERS = 20_000_000
ALIKE = 4  # decimals of a coordinate (m) that tell two faces apart


def polygonal_mesh(
    vertices: Points3,
    rings: Sequence[Integers],
    uv: Sequence[Floats] | None,
    paint: Sequence[int],
    paints: tuple[Paint, ...],
) -> TexturedMesh:
    """Return the mesh of polygons, those that stand twice (also with opposite winding) once.

    rings: indices of `vertices` around each; uv: its corners' coordinates (k, 2), None where there
    are none at all; paint: of each, an index of `paints`. Raises InvalidInput where coordinates
    are not finite or an index lies outside.
    """
    _check(vertices, rings)
    names = np.unique(np.round(vertices, ALIKE), axis=0, return_inverse=True)[1].ravel().tolist()
    faces, corners, colors = [], [], []
    seen: set[tuple[int, ...]] = set()
    doubled = 0
    for ring, places, color in zip(rings, repeat(None) if uv is None else uv, paint, strict=False):
        key = tuple(sorted([names[k] for k in ring.tolist()]))
        if key in seen:
            doubled += 1
            continue
        seen.add(key)
        for triangle in _ears(vertices, ring):
            faces.append(ring[triangle])
            colors.append(color)
            if places is not None:
                corners.append(places[triangle])
    count = len(faces)
    return TexturedMesh(
        vertices,
        np.array(faces, dtype=np.int64).reshape(-1, 3),
        np.full((count, 3, 2), np.nan) if uv is None else np.array(corners).reshape(-1, 3, 2),
        np.array(colors, dtype=np.int64),
        paints,
        (f"{doubled} faces stand twice: kept once",) if doubled else (),
    )


def _check(vertices: Points3, rings: Sequence[Integers]) -> None:
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
        raise InvalidInput("vertices need three finite coordinates")
    if sum(map(len, rings)) > MAX_CORNERS:
        raise InvalidInput(f"more than {MAX_CORNERS:,} face corners")
    every = np.concatenate(rings) if len(rings) else np.empty(0, dtype=np.int64)
    if len(every) and not 0 <= every.min() <= every.max() < len(vertices):
        raise InvalidInput("a face names a vertex that is not there")


def _ears(vertices: Points3, ring: Integers) -> Integers:
    """Return the triangles (k, 3) of one polygon as positions in its ring."""
    if len(ring) == 3:
        return TRIANGLE
    points = vertices[ring]
    if len(ring) < 3 or np.ptp(points, axis=0).max() <= 0:
        return np.empty((0, 3), dtype=np.int64)
    return triangulate_face(points, [np.arange(len(ring))])


TRIANGLE = np.array([[0, 1, 2]], dtype=np.int64)
