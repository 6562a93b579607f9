"""Meshes that grow polygon by polygon: what the leaves of a derivation are drawn with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..geometry.arrays import Floats, Points2, Points3, Triangles
from ..geometry.mesh import Mesh
from ..geometry.triangulate import newell_normal, triangulate_face

SKIN = 0.004  # metres that a face stands off the mass, so that the mass stays closed beneath
LEAST = 1e-8  # m², a face that is smaller is not drawn


@dataclass(slots=True)
class _Part:
    points: list[Points3] = field(default_factory=list)
    faces: list[Triangles] = field(default_factory=list)
    uv: list[Points2] = field(default_factory=list)
    count: int = 0


@dataclass(slots=True)
class Skins:
    """Collects faces by name and material."""

    parts: dict[tuple[str, str], _Part] = field(default_factory=dict)

    def add(
        self,
        name: str,
        material: str,
        points: Points3,
        face: tuple[tuple[int, ...], ...],
        uv: Points2 | None = None,
    ) -> None:
        """Add a planar face: rings of indices into `points`, whose own uv is (n, 2) or None."""
        index = np.array([k for ring in face for k in ring])
        own = points[index]
        normal = unit_normal(points[list(face[0])])
        if normal is None:
            return
        rings, at = [], 0
        for ring in face:
            rings.append(np.arange(at, at + len(ring)))
            at += len(ring)
        part = self.parts.setdefault((name, material), _Part())
        part.faces.append(triangulate_face(own, rings) + part.count)
        part.points.append(own + SKIN * normal)
        if uv is not None:
            part.uv.append(uv[index])
        part.count += len(own)

    def meshes(self) -> Iterator[Mesh]:
        """Yield the meshes, parts of one name side by side."""
        order = {name: k for k, (name, _) in reversed(list(enumerate(self.parts)))}
        for name, material in sorted(self.parts, key=lambda key: order[key[0]]):
            part = self.parts[name, material]
            uv = np.concatenate(part.uv) if part.uv else None
            points, faces = np.concatenate(part.points), np.concatenate(part.faces)
            yield Mesh(name, points, faces, material, uv)


def unit_normal(ring: Points3) -> Floats | None:
    """Return the unit normal of a ring (n, 3), None where it has no area."""
    normal = newell_normal(ring)
    length = float(np.linalg.norm(normal))
    return None if length < LEAST else np.asarray(normal / length)
