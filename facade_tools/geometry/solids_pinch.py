"""Edges at which four faces meet are opened, so that every reader sees a manifold.

Two parts of a building that touch in a vertical line only (corner to corner) share an edge of
four faces. There the vertices are doubled and each copy is drawn a tenth of a millimetre into
its own part.
"""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np
import shapely

from .arrays import Floats, Points2, Points3
from .polygons import signed_area
from .solids_surface import Face, Solid
from .triangulate import flattened, newell_normal

NUDGE = 1e-4  # metres
Edge = tuple[int, int]
Corner = tuple[int, int, int]  # face, ring, place in the ring


def unpinched(solid: Solid) -> Solid:
    """Return the solid with every edge shared by exactly two faces."""
    edges = _half_edges(solid.faces)
    pinched = {edge for edge, corners in edges.items() if len(corners) > 1}
    if not pinched:
        return solid
    solid = _resewn(solid, {vertex for edge in pinched for vertex in edge})
    edges = _half_edges(solid.faces)
    normals = [_unit(newell_normal(solid.vertices[list(face[0])])) for face in solid.faces]
    parent: dict[Corner, Corner] = {}
    for edge, corners in edges.items():
        for corner in corners:
            partner = _partner(solid.vertices, normals, edge, corner, edges[edge[::-1]])
            _unite(parent, corner, _following(solid.faces, partner))
            _unite(parent, _following(solid.faces, corner), partner)
    return _opened(solid, normals, parent, {k for edge in pinched for k in edge})


def _resewn(solid: Solid, pinched: set[int]) -> Solid:
    """Return the solid with rings whose every corner at a pinched vertex is one wedge of its face.

    Where a hole touches the outer ring, the corner of neither is: each runs over into the other.
    """
    faces: list[Face] = []
    labels = []
    for face, label in zip(solid.faces, solid.labels, strict=True):
        visits = Counter(vertex for ring in face for vertex in ring)
        if any(count > 1 and vertex in pinched for vertex, count in visits.items()):
            parts = _sewn(solid.vertices, face, {v for v, count in visits.items() if count > 1})
            faces += parts
            labels += [label] * len(parts)
        else:
            faces.append(face)
            labels.append(label)
    return Solid(solid.vertices, tuple(faces), tuple(labels))


def _sewn(vertices: Points3, face: Face, shared: set[int]) -> list[Face]:
    """Return a face, or several, with the same edges, linked by angle at the shared vertices."""
    normal = newell_normal(vertices[list(face[0])])
    plan = flattened(vertices, normal)
    edges = [(a, b) for ring in face for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    leaving: dict[int, list[Edge]] = defaultdict(list)
    for edge in edges:
        leaving[edge[0]].append(edge)
    following = {}
    for a, b in edges:
        choices = leaving[b]
        if b in shared:
            back = plan[a] - plan[b]
            choices = sorted(choices, key=lambda edge: _clockwise(back, plan[edge[1]] - plan[b]))
        following[a, b] = choices[0]
    rings = []
    left = dict.fromkeys(edges)
    while left:
        edge = next(iter(left))
        ring = []
        while edge in left:
            del left[edge]
            ring.append(edge[0])
            edge = following[edge]
        rings.append(tuple(ring))
    return _with_holes(plan, rings)


def _clockwise(first: Floats, second: Floats) -> float:
    """Return the angle clockwise from one direction to another, in (0, 2π]."""
    turn = np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second)
    angle = float(-turn % (2 * np.pi))
    return angle if angle > 1e-12 else 2 * np.pi


def _with_holes(plan: Points2, rings: list[tuple[int, ...]]) -> list[Face]:
    """Return the faces that rings make: outer ones, each with the holes inside it."""
    areas = [signed_area(plan[list(ring)]) for ring in rings]
    outer = [ring for ring, area in zip(rings, areas, strict=True) if area > 0]
    found: list[Face] = [(ring,) for ring in outer]
    shapes = [shapely.make_valid(shapely.Polygon(plan[list(ring)])) for ring in outer]
    for ring, area in zip(rings, areas, strict=True):
        if area <= 0:
            shared = [shapely.Polygon(plan[list(ring)]).intersection(s).area for s in shapes]
            home = int(np.argmax(shared))
            found[home] = (*found[home], ring)
    return found


def _half_edges(faces: tuple[Face, ...]) -> dict[Edge, list[Corner]]:
    """Return, per directed edge, the corners at which it starts."""
    edges: dict[Edge, list[Corner]] = defaultdict(list)
    for f, face in enumerate(faces):
        for r, ring in enumerate(face):
            for k, vertex in enumerate(ring):
                edges[vertex, ring[(k + 1) % len(ring)]].append((f, r, k))
    return dict(edges)


def _following(faces: tuple[Face, ...], corner: Corner) -> Corner:
    f, r, k = corner
    return f, r, (k + 1) % len(faces[f][r])


def _partner(
    vertices: Points3, normals: list[Floats], edge: Edge, corner: Corner, opposite: list[Corner]
) -> Corner:
    """Return the face across the edge that bounds the same wedge of the solid."""
    if len(opposite) == 1:
        return opposite[0]
    along = _unit(vertices[edge[1]] - vertices[edge[0]])
    normal = normals[corner[0]]
    ahead = np.cross(normal, along)
    angles = []
    for other in opposite:
        towards = np.cross(normals[other[0]], -along)
        turn = np.arctan2(-float(towards @ normal), float(towards @ ahead))
        angles.append(turn % (2 * np.pi))
    return opposite[int(np.argmin(angles))]


def _opened(
    solid: Solid, normals: list[Floats], parent: dict[Corner, Corner], open_at: set[int]
) -> Solid:
    """Give each fan of faces around a pinched vertex a vertex of its own."""
    fans: dict[tuple[int, Corner], set[int]] = defaultdict(set)
    for f, face in enumerate(solid.faces):
        for r, ring in enumerate(face):
            for k, vertex in enumerate(ring):
                if vertex in open_at:
                    fans[vertex, _root(parent, (f, r, k))].add(f)
    copies = Counter(vertex for vertex, _ in fans)
    vertices = [tuple(row) for row in solid.vertices.tolist()]
    renamed: dict[tuple[int, Corner], int] = {}
    for (vertex, fan), faces in fans.items():
        if copies[vertex] > 1:
            walls = [normals[f] for f in faces if solid.labels[f].semantic == "wall"]
            inwards = -np.sum(walls, axis=0)
            renamed[vertex, fan] = len(vertices)
            vertices.append(tuple((solid.vertices[vertex] + NUDGE * _unit(inwards)).tolist()))
    faces_ = tuple(
        tuple(
            tuple(
                renamed.get((vertex, _root(parent, (f, r, k))), vertex)
                for k, vertex in enumerate(ring)
            )
            for r, ring in enumerate(face)
        )
        for f, face in enumerate(solid.faces)
    )
    return Solid(*_used(vertices, faces_), solid.labels)


def _used(
    vertices: list[tuple[float, ...]], faces: tuple[Face, ...]
) -> tuple[Points3, tuple[Face, ...]]:
    used = sorted({k for face in faces for ring in face for k in ring})
    place = {k: new for new, k in enumerate(used)}
    kept = np.array([vertices[k] for k in used], dtype=np.float64)
    return kept, tuple(tuple(tuple(place[k] for k in ring) for ring in face) for face in faces)


def _unit(vector: Floats) -> Floats:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0 else vector


def _root(parent: dict[Corner, Corner], corner: Corner) -> Corner:
    while parent.get(corner, corner) != corner:
        corner = parent[corner]
    return corner


def _unite(parent: dict[Corner, Corner], a: Corner, b: Corner) -> None:
    root_a, root_b = _root(parent, a), _root(parent, b)
    if root_a != root_b:
        parent[max(root_a, root_b)] = min(root_a, root_b)
