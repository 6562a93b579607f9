"""Roof slabs: the roof faces of a solid, thickened and carried out over the walls.

Every roof face grows within its own plane: edges above a wall move outward by the overhang, edges
shared with another roof face stay on their line, so that neighbours still meet after the growth.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import shapely

from .arrays import Floats, Points2, Points3, Triangles
from .detail_overhangs import Slab, exposed_edges, trimmed
from .mesh import Mesh
from .patterns import pattern_uv
from .polygons import shape_of
from .solids import Solid
from .triangulate import newell_normal, triangulate_rings

THICKNESS = 0.15  # vertical, metres
RAKE = 0.75  # overhang of a gable's edge relative to that of the eaves
PATTERN = "shingle"
MOST_DROP = 0.5  # metres, or the overhang if that is more: what eaves hang down at most
MITER = 4.0  # a corner moves at most this many overhangs


@dataclass(frozen=True, slots=True)
class Border:
    """One edge of a roof face in plan: start point, unit direction, how far it moves outward.

    exposed: there is a wall below, so that the slab's edge shows as a fascia.
    """

    start: Floats
    direction: Floats
    offset: float
    exposed: bool

    @property
    def normal(self) -> Floats:
        """Unit vector out of the face."""
        return np.array([self.direction[1], -self.direction[0]])


def roof_slabs(solid: Solid, overhang: Mapping[str, float], name: str = "roof") -> list[Mesh]:
    """Return the slab over all roof faces: meshes of material `roof` (top) and `fascia`.

    overhang: metres by owner of the face; an owner that is not listed has none.
    """
    slabs = list(_slabs(solid, overhang))
    tops, edges = _Collected(), _Collected()
    for slab, parts in zip(slabs, trimmed(slabs, THICKNESS), strict=True):
        for rings in parts:
            flat = np.concatenate(rings)
            triangles = triangulate_rings(rings)
            raised = _lifted(flat, slab.plane, THICKNESS)
            tops.add(raised, triangles, pattern_uv(PATTERN, raised, _normal(slab.plane)))
            edges.add(_lifted(flat, slab.plane, 0.0), triangles[:, ::-1])
            exposed = exposed_edges(slab, rings)
            edges.add(*_fascia([_lifted(ring, slab.plane, 0.0) for ring in rings], exposed))
    return [tops.mesh(name, "roof"), edges.mesh(name, "fascia")]


def _slabs(solid: Solid, overhang: Mapping[str, float]) -> Iterator[Slab]:
    """Yield the slab over each roof face, before it meets the others."""
    neighbours = _neighbours(solid)
    for index, (face, label) in enumerate(zip(solid.faces, solid.labels, strict=True)):
        if label.semantic != "roof":
            continue
        rings, lines = [], []
        plane = _plane(solid.vertices[list(face[0])])
        reach = overhang.get(label.owner, 0.0)
        for ring in face:
            borders = [
                _raised(border, plane, reach)
                for border in _borders(solid, index, ring, neighbours, reach)
            ]
            outline, exposed = grown(borders)
            ends = np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)
            lines.append(ends[exposed])
            rings.append(outline)
        shape = shape_of([solid.vertices[list(ring)][:, :2] for ring in face])
        edges = shapely.MultiLineString(list(np.concatenate(lines)))
        yield Slab(plane, shape, rings, edges)


class _Collected:
    """Pieces of one mesh."""

    def __init__(self) -> None:
        self.vertices: list[Points3] = []
        self.faces: list[Triangles] = []
        self.uv: list[Points2] = []
        self.count = 0

    def add(self, vertices: Points3, faces: Triangles, uv: Points2 | None = None) -> None:
        self.vertices.append(vertices)
        self.faces.append(faces + self.count)
        self.count += len(vertices)
        self.uv += [] if uv is None else [uv]

    def mesh(self, name: str, material: str) -> Mesh:
        vertices = np.concatenate([np.zeros((0, 3)), *self.vertices])
        faces = np.concatenate([np.zeros((0, 3), dtype=np.int64), *self.faces])
        uv = np.concatenate(self.uv) if self.uv else None
        return Mesh(name, vertices, faces, material, uv)


def _neighbours(solid: Solid) -> dict[tuple[int, int], int]:
    """Return the face on the other side of each directed edge."""
    found = {}
    for index, face in enumerate(solid.faces):
        for ring in face:
            for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
                found[b, a] = index
    return found


def _plane(points: Points3) -> tuple[float, float, float]:
    """Return a, b, c of z = a x + b y + c through a face."""
    nx, ny, nz = newell_normal(points)
    a, b = -nx / nz, -ny / nz
    x, y, z = points.mean(axis=0)
    return float(a), float(b), float(z - a * x - b * y)


def _normal(plane: tuple[float, float, float]) -> Floats:
    normal = np.array([-plane[0], -plane[1], 1.0])
    return np.asarray(normal / np.linalg.norm(normal))


def _lifted(points: Points2, plane: tuple[float, float, float], rise: float) -> Points3:
    a, b, c = plane
    return np.column_stack([points, points @ np.array([a, b]) + c + rise])


def _borders(
    solid: Solid,
    index: int,
    ring: tuple[int, ...],
    neighbours: Mapping[tuple[int, int], int],
    overhang: float,
) -> Iterator[Border]:
    for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
        start, end = solid.vertices[a], solid.vertices[b]
        step = (end - start)[:2]
        length = float(np.hypot(*step))
        if length < 1e-9:
            continue
        direction = step / length
        outward = np.array([direction[1], -direction[0]])
        exposed = _stands_on_wall(solid, neighbours.get((a, b), index), outward)
        rake = RAKE if abs(end[2] - start[2]) > 1e-3 * length else 1.0
        yield Border(start[:2], direction, overhang * rake if exposed else 0.0, exposed)


def _raised(border: Border, plane: tuple[float, float, float], overhang: float) -> Border:
    """Return a border that moves less far where its steep face would hang down before the wall.

    It falls by the overhang, as a roof of 45 degrees, or by MOST_DROP; flatter roofs fall by less.
    """
    fall = -float(border.normal @ np.array(plane[:2])) * border.offset
    most = max(MOST_DROP, overhang)
    return border if fall <= most else replace(border, offset=border.offset * most / fall)


def _stands_on_wall(solid: Solid, face: int, outward: Floats) -> bool:
    """Tell whether a neighbour is a wall that faces the way in which the roof's edge would grow."""
    if solid.labels[face].semantic != "wall":
        return False
    normal = newell_normal(solid.vertices[list(solid.faces[face][0])])
    return bool(normal[:2] @ outward > 0.0)


def grown(borders: list[Border]) -> tuple[Points2, list[bool]]:
    """Return the outline of moved borders, and for each of its edges whether it is exposed."""
    points: list[Floats] = []
    exposed: list[bool] = []
    for before, after in zip(borders[-1:] + borders[:-1], borders, strict=True):
        corner = _corner(before, after)
        for point in corner[:-1]:
            points.append(point)
            exposed.append(before.exposed or after.exposed)
        points.append(corner[-1])
        exposed.append(after.exposed)
    return np.array(points), exposed


def _corner(before: Border, after: Border) -> list[Floats]:
    """Return where two moved borders meet; two points where they run parallel."""
    turn = before.direction[0] * after.direction[1] - before.direction[1] * after.direction[0]
    first = after.start + before.normal * before.offset
    second = after.start + after.normal * after.offset
    if abs(turn) > 1e-6:
        gap = second - first
        along = (gap[0] * after.direction[1] - gap[1] * after.direction[0]) / turn
        meet = first + along * before.direction
        reach = MITER * max(before.offset, after.offset, 1e-9)
        if float(np.hypot(*(meet - after.start))) <= reach:
            return [meet]
    if abs(before.offset - after.offset) < 1e-9 and abs(turn) <= 1e-6:
        return [second]
    return [first, second]


def _fascia(rings: list[Points3], exposed: list[bool]) -> tuple[Points3, Triangles]:
    """Return upright quads of the slab's thickness along the exposed edges."""
    start = np.concatenate(rings)[exposed]
    end = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])[exposed]
    rise = np.array([0.0, 0.0, THICKNESS])
    vertices = np.stack([start, end, end + rise, start + rise], axis=1).reshape(-1, 3)
    quads = 4 * np.arange(len(start), dtype=np.int64)[:, None, None]
    return vertices, (quads + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
