"""A closed surface of planar faces with a meaning on each face."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .arrays import Integers, Points3, Triangles
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
    return solid.vertices, triangles, owners
