"""Parts with a volume of their own: bay windows, porches, chimneys, steps."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..artifacts.building import Box, Building, Chimney, Element
from .arrays import Floats, Points2, Points3, Triangles
from .blocked import porch_posts
from .detail_boxes import WORLD, Box6, LocalFrame, Parts, meshes_of
from .detail_roofs import roof_slabs
from .detail_windows import sash_leaf
from .mesh import Mesh
from .solids import Solid, building_solid, triangulated
from .triangulate import triangulate_rings

DECK = 0.05  # a porch's floor lies below the door's threshold, metres
POST = 0.16
BEAM = 0.24
BAY_DEPTH = 0.6


def prism(
    outline: Points2, low: float, high: float, inset: float = 0.0
) -> tuple[Points3, Triangles]:
    """Return the closed prism over a convex outline (n, 2), tapered to share `inset` of its size.

    The taper is towards the middle of the first edge's line, so that a roof leans on its wall.
    """
    count = len(outline)
    anchor = (outline[0] + outline[-1]) / 2
    top = outline + inset * (anchor - outline)
    vertices = np.concatenate(
        [np.column_stack([ring, np.full(count, z)]) for ring, z in ((outline, low), (top, high))]
    )
    cap = triangulate_rings([outline])
    i = np.arange(count)
    j = (i + 1) % count
    sides = np.concatenate([np.stack([i, j, j + count], 1), np.stack([i, j + count, i + count], 1)])
    return vertices, np.concatenate([cap[:, ::-1], cap + count, sides])


def bay_window(name: str, element: Element, frame: LocalFrame, ground: float) -> list[Mesh]:
    """Return a three-sided bay: body, windows on its facets, small roof. ground: z of the soil."""
    depth = min(BAY_DEPTH, element.width / 3)
    u0, u1 = element.u, element.u + element.width
    v0, v1 = element.v, element.v + element.height
    outline = np.array([(u0, 0.0), (u0 + depth, depth), (u1 - depth, depth), (u1, 0.0)])
    base = max(v0 - 0.55, ground - frame.origin[2])
    upright = LocalFrame(frame.origin, frame.axes[[0, 2, 1]])
    body = prism(outline[::-1], base, v1 + 0.12)
    eaves = _spread(outline, 0.12)
    roof = prism(eaves[::-1], v1 + 0.12, v1 + 0.5, 0.6)
    plate = prism(_spread(outline, 0.07)[::-1], v0 - 0.06, v0 - 0.005)
    meshes = [
        Mesh(name, upright.world(points), faces[:, ::-1], material)
        for (points, faces), material in ((body, "wall"), (plate, "trim"), (roof, "roof"))
    ]
    for a, b in pairwise(outline):
        meshes += _facet(name, a, b, (v0, v1), frame)
    return meshes


def _spread(outline: Points2, by: float) -> Points2:
    """Return the bay's outline carried out by `by` at the front and the sides."""
    steps = np.array([(-by, 0.0), (-by / 2, by), (by / 2, by), (by, 0.0)])
    return np.asarray(outline + steps)


def _facet(
    name: str, a: Floats, b: Floats, v: tuple[float, float], frame: LocalFrame
) -> list[Mesh]:
    along = b - a
    length = float(np.hypot(*along))
    right = (along[0] * frame.axes[0] + along[1] * frame.axes[2]) / length
    out = np.cross(right, frame.axes[1])
    origin = frame.origin + a[0] * frame.axes[0] + a[1] * frame.axes[2]
    local = LocalFrame(origin, np.array([right, frame.axes[1], out]))
    side = 0.07
    frames, panes = sash_leaf(side, v[0], length - side, v[1], depth=0.02, grid=(1, 2))
    posts: list[Box6] = [
        (0.0, v[0] - 0.03, 0.0, side, v[1] + 0.1, 0.045),
        (length - side, v[0] - 0.03, 0.0, length, v[1] + 0.1, 0.045),
        (side, v[1], 0.0, length - side, v[1] + 0.1, 0.045),
    ]
    return meshes_of(name, {"trim": frames + posts, "glass": panes}, local)


def chimney(name: str, chimney: Chimney, floor: float) -> list[Mesh]:
    """Return shaft, corbelled cap and flues of a chimney; floor: z where the shaft starts."""
    half_w, half_d = chimney.width / 2, chimney.depth / 2
    top = chimney.top

    def block(grow: float, low: float, high: float) -> Box6:
        w, d = half_w + grow, half_d + grow
        return (chimney.x - w, chimney.y - d, low, chimney.x + w, chimney.y + d, high)

    flue = 0.26 * min(chimney.width, chimney.depth)
    parts: Parts = {
        "brick": [block(0.0, floor, top - 0.16), block(0.05, top - 0.3, top - 0.16)],
        "stone": [block(0.08, top - 0.16, top - 0.08)],
        "clay": [block(flue - min(half_w, half_d), top - 0.08, top + 0.14)],
    }
    return meshes_of(name, parts, WORLD)


def porch(name: str, box: Box, building: Building) -> list[Mesh]:
    """Return floor, posts, beam with roof, and slab of a porch; its attached sides stay open."""
    height = box.height or 2.4
    x0, x1 = box.x - box.width / 2, box.x + box.width / 2
    y0, y1 = box.y - box.depth / 2, box.y + box.depth / 2
    posts: list[tuple[float, float]] = porch_posts(building, box).tolist()
    floor: list[Box6] = [(x0, y0, 0.0, x1, y1, DECK)]
    columns: list[Box6] = []
    for x, y in posts:
        for half, low, high in (
            (POST / 2, DECK, height - BEAM),
            (POST / 2 + 0.04, DECK, DECK + 0.18),
            (POST / 2 + 0.04, height - BEAM - 0.1, height - BEAM),
        ):
            columns.append((x - half, y - half, low, x + half, y + half, high))
    lone = replace(building, boxes=(replace(box, kind="general", height=height),))
    body = _raised(building_solid(lone), height - BEAM)
    points, triangles, _ = triangulated(body)
    overhang = {box.id: 0.0 if box.roof is None else box.roof.overhang}
    return [
        *meshes_of(f"{name}/floor", {"wood": floor}, WORLD),
        *meshes_of(f"{name}/posts", {"trim": columns}, WORLD),
        Mesh(f"{name}/beam", points, triangles, "trim"),
        *roof_slabs(body, overhang, f"{name}/roof"),
    ]


def _raised(solid: Solid, floor: float) -> Solid:
    vertices = solid.vertices.copy()
    vertices[:, 2] = np.maximum(vertices[:, 2], floor)
    return replace(solid, vertices=vertices)
