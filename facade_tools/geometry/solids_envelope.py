"""The solid under the upper envelope of patches (docs/roofs.md, section 2).

First the plan is cut into cells along every edge of a patch and every line where two patches
meet, noded on a grid of 1e-6 m; then each cell takes the highest patch above it. Topology comes
from the cells alone, so that no rounding of a height can open the surface.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from .arrays import Floats, Integers, Points2
from .polygons import rings_of, shape_of
from .roofs_patch import Patch
from .solids_merge import Piece, merged
from .solids_pinch import unpinched
from .solids_surface import Label, Solid

Shapes = NDArray[np.object_]  # shapely geometries

GRID = 1e-6
SAME_HEIGHT = 1e-4  # metres: steps below this are rounding, not walls
OUTSIDE = -1


@dataclass(slots=True)
class _Plan:
    """Cells of the plan: rings as indices of points, the patch on top of each cell."""

    points: Points2
    rings: list[list[list[int]]]
    top: Integers


def envelope_solid(patches: list[Patch]) -> Solid:
    """Return the closed solid between z = 0 and the upper envelope of the patches."""
    plan = _cells(patches)
    pillars = _pillars(plan, patches)
    pieces = _caps(plan, patches, pillars) + _walls(plan, patches, pillars)
    return unpinched(merged(np.array(pillars.vertices, dtype=np.float64), pieces))


# --- the plan -------------------------------------------------------------------------------------
def _cells(patches: list[Patch]) -> _Plan:
    shapes = np.array([shape_of(patch.rings) for patch in patches], dtype=object)
    planes = np.array([patch.plane for patch in patches])
    groups = np.array([patch.group for patch in patches])
    lines = np.concatenate([shapely.boundary(shapes), _meeting_lines(shapes, planes, groups)])
    noded = shapely.unary_union(lines, grid_size=GRID)
    cells = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    cells = cells[shapely.area(cells) > 0]
    top = _topmost(shapely.point_on_surface(cells), shapes, planes)
    return _indexed(cells, top)


def _meeting_lines(shapes: Shapes, planes: Floats, groups: Integers) -> Shapes:
    """Return where the planes of two overlapping patches are equally high, within both.

    Patches that only touch cross in a point of their common border; the line within the first
    of them puts a node there.
    """
    tree = shapely.STRtree(shapes)
    first, second = tree.query(shapes)
    chosen = groups[first] < groups[second]
    first, second = first[chosen], second[chosen]
    difference = planes[first] - planes[second]
    crossing = np.hypot(difference[:, 0], difference[:, 1]) > 1e-9
    first, second, difference = first[crossing], second[crossing], difference[crossing]
    if len(first) == 0:
        return np.zeros(0, dtype=object)
    reach = np.abs(shapely.bounds(shapes)).max() * 4 + 1
    normal = difference[:, :2] / np.hypot(difference[:, 0], difference[:, 1])[:, None]
    offset = difference[:, 2] / np.hypot(difference[:, 0], difference[:, 1])
    foot = -normal * offset[:, None]
    along = np.column_stack([-normal[:, 1], normal[:, 0]])
    middle = shapely.get_coordinates(shapely.centroid(shapes[first]))
    foot = foot + along * np.sum((middle - foot) * along, axis=1)[:, None]
    ends = np.stack([foot - reach * along, foot + reach * along], axis=1)
    lines = shapely.linestrings(ends)
    inside = shapely.intersection(lines, shapes[first])
    common = shapely.intersection(inside, shapes[second])
    touching = (shapely.get_dimensions(common) < 1) & shapely.intersects(lines, shapes[second])
    parts = shapely.get_parts(np.where(touching, inside, common))
    return np.asarray(parts[shapely.get_dimensions(parts) == 1], dtype=object)


def _topmost(points: Shapes, shapes: Shapes, planes: Floats) -> Integers:
    """Return the highest patch over each point, OUTSIDE where there is none."""
    x, y = shapely.get_x(points), shapely.get_y(points)
    shapely.prepare(shapes)
    inside = shapely.intersects_xy(shapes[None, :], x[:, None], y[:, None])
    heights = np.outer(x, planes[:, 0]) + np.outer(y, planes[:, 1]) + planes[:, 2]
    heights[~inside] = -np.inf
    top = np.argmax(heights, axis=1)
    top[~inside.any(axis=1)] = OUTSIDE
    return np.asarray(top, dtype=np.int64)


def _indexed(cells: Shapes, top: Integers) -> _Plan:
    index: dict[tuple[float, float], int] = {}
    rings: list[list[list[int]]] = []
    for cell in cells[top >= 0]:
        loops = [ring.tolist() for ring in rings_of(cell)]
        rings.append([[index.setdefault((x, y), len(index)) for x, y in loop] for loop in loops])
    return _Plan(np.array(list(index), dtype=np.float64), rings, top[top >= 0])


# --- heights --------------------------------------------------------------------------------------
@dataclass(slots=True)
class _Pillars:
    """The vertices above each point of the plan, from the ground upwards."""

    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    levels: list[list[int]] = field(default_factory=list)  # per point, ids in ascending height
    at: dict[tuple[int, int], int] = field(default_factory=dict)  # (point, patch) -> id


def _pillars(plan: _Plan, patches: list[Patch]) -> _Pillars:
    meeting: list[set[int]] = [set() for _ in plan.points]
    for rings, patch in zip(plan.rings, plan.top.tolist(), strict=True):
        for ring in rings:
            for point in ring:
                meeting[point].add(patch)
    pillars = _Pillars()
    for point, (x, y) in enumerate(plan.points.tolist()):
        _raise_pillar(pillars, point, (x, y), [(k, patches[k]) for k in sorted(meeting[point])])
    return pillars


def _raise_pillar(
    pillars: _Pillars,
    point: int,
    place: tuple[float, float],
    meeting: list[tuple[int, Patch]],
) -> None:
    """Add the vertices above one point; heights closer than SAME_HEIGHT become one."""
    x, y = place
    heights = sorted(
        (patch.plane[0] * x + patch.plane[1] * y + patch.plane[2], k) for k, patch in meeting
    )
    heights.insert(0, (0.0, OUTSIDE))
    levels: list[int] = []
    last = -np.inf
    for height, k in heights:
        if height - last > SAME_HEIGHT:
            levels.append(len(pillars.vertices))
            pillars.vertices.append((x, y, height))
            last = height
        pillars.at[point, k] = levels[-1]
    pillars.levels.append(levels)


# --- pieces of the surface ------------------------------------------------------------------------
def _caps(plan: _Plan, patches: list[Patch], pillars: _Pillars) -> list[Piece]:
    """Return the roof above and the ground below each cell."""
    pieces: list[Piece] = []
    for rings, top in zip(plan.rings, plan.top.tolist(), strict=True):
        owner = patches[top].owner
        plane = tuple(round(value, 7) for value in patches[top].plane)
        roof = [[pillars.at[point, top] for point in ring] for ring in rings]
        ground = [[pillars.at[point, OUTSIDE] for point in ring[::-1]] for ring in rings]
        pieces.append(Piece(roof, ("roof", *plane), Label("roof", owner)))
        pieces.append(Piece(ground, ("ground",), Label("ground")))
    return pieces


def _walls(plan: _Plan, patches: list[Patch], pillars: _Pillars) -> list[Piece]:
    """Return a wall over each edge at whose two sides the surface is at different heights."""
    left: dict[tuple[int, int], int] = defaultdict(lambda: OUTSIDE)
    for rings, top in zip(plan.rings, plan.top.tolist(), strict=True):
        for ring in rings:
            for k, point in enumerate(ring):
                left[ring[k - 1], point] = top
    pieces = []
    for u, v in list(left):
        here, there = left[u, v], left.get((v, u), OUTSIDE)
        if here == there or (there != OUTSIDE and not _higher(plan, patches, (u, v), here, there)):
            continue
        ring = _wall_ring(pillars, (u, v), here, there)
        if len(ring) >= 3:
            owner = patches[here].owner
            key = ("wall", owner, *_line_of(plan.points[u], plan.points[v]))
            pieces.append(Piece([ring], key, Label("wall", owner)))
    return pieces


def _higher(
    plan: _Plan, patches: list[Patch], edge: tuple[int, int], here: int, there: int
) -> bool:
    (x0, y0), (x1, y1) = plan.points[edge[0]].tolist(), plan.points[edge[1]].tolist()
    (a, b, c), (d, e, f) = patches[here].plane, patches[there].plane
    difference = (a - d) * (x0 + x1) / 2 + (b - e) * (y0 + y1) / 2 + c - f
    return difference > 0 or (difference == 0 and here > there)


def _wall_ring(pillars: _Pillars, edge: tuple[int, int], high: int, low: int) -> list[int]:
    """Return the ring of the wall above edge (u, v), whose left side is the higher one."""
    u, v = edge
    up = _chain(pillars, v, low, high)
    down = _chain(pillars, u, high, low)
    ring = up + down
    return [k for place, k in enumerate(ring) if k != ring[place - 1]]


def _chain(pillars: _Pillars, point: int, start: int, stop: int) -> list[int]:
    levels = pillars.levels[point]
    first = levels.index(pillars.at[point, start])
    last = levels.index(pillars.at[point, stop])
    return levels[first : last + 1] if first <= last else levels[last : first + 1][::-1]


def _line_of(start: Points2, end: Points2) -> tuple[float, float, float]:
    """Return the unit normal and offset of the line, rounded, equal for pieces of one wall."""
    (x0, y0), (x1, y1) = start.tolist(), end.tolist()
    length = math.hypot(x1 - x0, y1 - y0)
    a, b = round((y1 - y0) / length, 5), round((x0 - x1) / length, 5)
    return a, b, round(a * x0 + b * y0, 4)
