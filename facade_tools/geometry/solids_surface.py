"""A closed surface of planar faces with a meaning on each face."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .arrays import Floats, Integers, Points3, Triangles
from .triangulate import triangulate_face

Semantic = Literal["ground", "wall", "roof"]
Face = tuple[tuple[int, ...], ...]  # outer ring, then holes: indices of vertices


@dataclass(frozen=True, slots=True)
class Label:
    """What a face is and which box it belongs to ("" where there is no box)."""

    semantic: Semantic
    owner: str = ""


@dataclass(frozen=True, slots=True)
class Solid:
    """A closed surface of planar faces.

    vertices: (n, 3) metres, z up. faces: outer ring counter-clockwise seen from outside, holes
    clockwise. labels: one a face. Every edge belongs to exactly two faces, which run along it in
    opposite directions.
    """

    vertices: Points3
    faces: tuple[Face, ...]
    labels: tuple[Label, ...]


def triangulated(solid: Solid) -> tuple[Points3, Triangles, Integers]:
    """Return vertices, triangles (m, 3) and the face of each triangle (m,).

    Triangles lie in the planes of their faces and use only their vertices, so that the surface
    stays closed.
    """
    parts = [
        triangulate_face(solid.vertices, [np.array(ring, dtype=np.int64) for ring in face])
        for face in solid.faces
    ]
    counts = [len(part) for part in parts]
    owners = np.repeat(np.arange(len(parts), dtype=np.int64), counts)
    triangles = np.concatenate(parts) if parts else np.zeros((0, 3), dtype=np.int64)
    return solid.vertices, _with_single_edges(solid.vertices, triangles, owners), owners


def _with_single_edges(vertices: Points3, triangles: Triangles, owners: Integers) -> Triangles:
    """Flip diagonals that two faces have in common.

    Where two faces share three points that are nearly in one line, both may be cut from the first
    to the third; the one with the thinner triangle there is cut the other way.
    """
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    code = edges[:, 0] * len(vertices) + edges[:, 1]
    values, counts = np.unique(code, return_counts=True)
    for value in values[counts > 2]:
        meeting = np.flatnonzero(code == value) // 3
        faces = [meeting[owners[meeting] == face] for face in np.unique(owners[meeting])]
        pairs = [pair for pair in faces if len(pair) == 2]
        if pairs:
            thin = min(pairs, key=lambda pair: _areas(vertices, triangles[pair]).min())
            triangles[thin] = _flipped(triangles[thin], set(divmod(int(value), len(vertices))))
    return triangles


def _areas(vertices: Points3, triangles: Triangles) -> Floats:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _flipped(pair: Triangles, diagonal: set[int]) -> Triangles:
    """Return the two triangles (2, 3) cut along their other diagonal."""
    first, second = pair.tolist()
    top = next(k for k in range(3) if first[k] not in diagonal)
    c, a, b = first[top], first[(top + 1) % 3], first[(top + 2) % 3]
    d = next(vertex for vertex in second if vertex not in diagonal)
    return np.array([[c, a, d], [c, d, b]], dtype=np.int64)
