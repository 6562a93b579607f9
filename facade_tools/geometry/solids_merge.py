"""Small pieces of a surface merged into large planar faces."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from .arrays import Floats, Integers, Points3
from .polygons import signed_area
from .solids_surface import Face, Label, Solid
from .triangulate import flattened, newell_normal

SLIVER = 1e-7  # m²
Edge = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Piece:
    """A face before merging; pieces that touch and have equal keys become one face."""

    rings: list[list[int]]
    key: tuple[object, ...]
    label: Label


def merged(vertices: Points3, pieces: list[Piece]) -> Solid:
    """Return the solid of the pieces: equal keys joined, needless vertices dropped."""
    groups: dict[tuple[object, ...], list[Piece]] = defaultdict(list)
    for piece in pieces:
        groups[piece.key].append(piece)
    faces: list[Face] = []
    labels: list[Label] = []
    for members in groups.values():
        for face in _joined(vertices, members):
            faces.append(face)
            labels.append(members[0].label)
    rows = zip(_without_straight(vertices, faces), labels, strict=True)
    kept = [(face, label) for face, label in rows if face]
    return _compact(vertices, [face for face, _ in kept], [label for _, label in kept])


def _joined(vertices: Points3, pieces: list[Piece]) -> list[Face]:
    """Return the faces that remain when edges inside the group cancel."""
    edges: dict[Edge, None] = {}
    for piece in pieces:
        for ring in piece.rings:
            for k, end in enumerate(ring):
                if (end, ring[k - 1]) in edges:
                    del edges[end, ring[k - 1]]
                else:
                    edges[ring[k - 1], end] = None
    if not edges:
        return []
    if len(pieces) == 1 and len(edges) == len({start for start, _ in edges}):
        return [tuple(tuple(ring) for ring in pieces[0].rings)]
    normal = np.sum([newell_normal(vertices[piece.rings[0]]) for piece in pieces], axis=0)
    return _nested(vertices, _loops(vertices, list(edges), normal), normal)


def _loops(vertices: Points3, edges: list[Edge], normal: Floats) -> list[list[int]]:
    """Trace closed loops; where several leave a vertex, take the sharpest turn to the left."""
    leaving: dict[int, list[int]] = defaultdict(list)
    for start, end in edges:
        leaving[start].append(end)
    used = sorted({k for edge in edges for k in edge})
    flat = dict(zip(used, flattened(vertices[used], normal), strict=True))
    loops = []
    for start, _ in edges:
        if leaving[start]:
            loops += _simple(_trace(start, leaving, flat))
    return loops


def _simple(loop: list[int]) -> list[list[int]]:
    """Cut a loop where it comes back to a vertex, so that no loop visits one twice."""
    found: list[list[int]] = []
    open_loop: list[int] = []
    for vertex in loop:
        if vertex in open_loop:
            place = open_loop.index(vertex)
            found.append(open_loop[place:])
            del open_loop[place:]
        open_loop.append(vertex)
    return [*found, open_loop]


def _trace(start: int, leaving: dict[int, list[int]], flat: dict[int, Floats]) -> list[int]:
    loop = [start]
    before, here = start, leaving[start].pop()
    while here != start:
        loop.append(here)
        options = leaving[here]
        pick = 0
        if len(options) > 1:
            back = flat[before] - flat[here]
            turns = [_angle(flat[end] - flat[here], back) for end in options]
            pick = int(np.argmin(turns))
        before, here = here, options.pop(pick)
    return loop


def _angle(ahead: Floats, back: Floats) -> float:
    """Return the angle from `ahead` counter-clockwise to `back`, in (0, 2π]."""
    turn = np.arctan2(back[1], back[0]) - np.arctan2(ahead[1], ahead[0])
    return float(turn % (2 * np.pi)) or 2 * np.pi


def _nested(vertices: Points3, loops: list[list[int]], normal: Floats) -> list[Face]:
    """Give each hole (clockwise loop) to the smallest outer loop around it.

    A loop without area has no direction: it is a face of its own, so that nothing is left open.
    """
    flats = [flattened(vertices[loop], normal) for loop in loops]
    areas = [signed_area(flat) for flat in flats]
    outer = [k for k in range(len(loops)) if areas[k] > -SLIVER]
    faces = {k: [tuple(loops[k])] for k in outer}
    for k in range(len(loops)):
        if areas[k] <= -SLIVER:
            around = [j for j in outer if areas[j] > SLIVER and _contains(flats[j], flats[k])]
            if around:
                faces[min(around, key=lambda j: areas[j])].append(tuple(loops[k]))
            else:
                faces[k] = [tuple(loops[k])]
    return [tuple(rings) for rings in faces.values()]


def _contains(ring: Floats, hole: Floats) -> bool:
    """Whether the middle of the hole's first edge lies in the ring."""
    x, y = (hole[0] + hole[1]) / 2
    ends = np.roll(ring, -1, axis=0)
    across = (ring[:, 1] > y) != (ends[:, 1] > y)
    a, b = ring[across], ends[across]
    at = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(at > x) % 2)


def _without_straight(vertices: Points3, faces: list[Face]) -> list[Face]:
    """Drop vertices at which every face runs straight through between the same neighbours."""
    neighbours: dict[int, set[Edge]] = defaultdict(set)
    for face in faces:
        for ring in face:
            for k, vertex in enumerate(ring):
                before, after = ring[k - 1], ring[(k + 1) % len(ring)]
                neighbours[vertex].add((min(before, after), max(before, after)))
    straight = {
        vertex
        for vertex, pairs in neighbours.items()
        if len(pairs) == 1 and _is_straight(vertices, vertex, *next(iter(pairs)))
    }
    kept = [[tuple(k for k in ring if k not in straight) for ring in face] for face in faces]
    # Of a face without width only two points may be left: then its neighbours meet there.
    return [tuple(ring for ring in face if len(ring) > 2) for face in kept]


def _is_straight(vertices: Points3, middle: int, start: int, end: int) -> bool:
    x, y, z = (vertices[end] - vertices[start]).tolist()
    u, v, w = (vertices[middle] - vertices[start]).tolist()
    aside = math.hypot(y * w - z * v, z * u - x * w, x * v - y * u)
    return aside <= 1e-5 * math.hypot(x, y, z)


def _compact(vertices: Points3, faces: list[Face], labels: list[Label]) -> Solid:
    used: Integers = np.array(
        sorted({k for face in faces for ring in face for k in ring}), dtype=np.int64
    )
    place = {int(k): new for new, k in enumerate(used)}
    renamed = tuple(tuple(tuple(place[k] for k in ring) for ring in face) for face in faces)
    return Solid(vertices[used], renamed, tuple(labels))
