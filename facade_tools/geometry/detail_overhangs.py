"""Overhangs cut back where they would run into another part of the roof.

Of two slabs that cross, the higher one goes on at each point; an overhang ends at a mass that
rises above it. A roof's own face is never cut, so that the solid stays covered.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from .arrays import Floats
from .polygons import Rings, rings_of
from .rectilinear import areas, valid_polygon
from .roofs_patch import Plane

LEAST = 1e-3  # m²: slabs that share less do not meet
SNAP = 1e-7  # metres: grid of the cuts


@dataclass(slots=True)
class Slab:
    """A roof face and its slab in plan.

    plane: z = a·x + b·y + c of the face. face: the polygon of the solid. rings: of the slab.
    exposed: lines along which a fascia shows.
    """

    plane: Plane
    face: BaseGeometry
    rings: Rings
    exposed: BaseGeometry


def trimmed(slabs: Sequence[Slab], thickness: float) -> list[list[Rings]]:
    """Return what is left of each slab: itself in most cases, else one or more polygons."""
    grown = [valid_polygon(slab.rings) for slab in slabs]
    tree = shapely.STRtree(grown)
    first, second = tree.query(grown, predicate="intersects")
    cuts: list[list[BaseGeometry]] = [[] for _ in slabs]
    for i, j in zip(first.tolist(), second.tolist(), strict=True):
        if i < j:
            # On a grid: of polygons whose common border differs in the last digit GEOS 3.14 may
            # otherwise return the whole of one.
            shared = areas(shapely.intersection(grown[i], grown[j], grid_size=SNAP))
            if shared.area > LEAST:
                _meet(slabs, (i, j), shared, cuts, thickness)
    return [
        _left(slab, shape, cut) if cut else [slab.rings]
        for slab, shape, cut in zip(slabs, grown, cuts, strict=True)
    ]


def _meet(
    slabs: Sequence[Slab],
    pair: tuple[int, int],
    shared: BaseGeometry,
    cuts: list[list[BaseGeometry]],
    thickness: float,
) -> None:
    """Note what each of two slabs loses where both stand over one area."""
    i, j = pair
    a, b = slabs[i], slabs[j]
    difference = np.subtract(a.plane, b.plane)
    heights = shapely.get_coordinates(shared) @ difference[:2] + difference[2]
    crossing = heights.min() < thickness and heights.max() > -thickness
    over, under = _split(shared, difference)  # where a is higher, and where b is
    for lower, higher, area, k in ((a, b, under, i), (b, a, over, j)):
        if area.is_empty:
            continue
        # On a grid GEOS refuses areas with the points and lines where two only touch.
        inside = area if crossing else shapely.intersection(area, higher.face, grid_size=SNAP)
        inside = areas(inside)
        lost = areas(shapely.difference(inside, lower.face, grid_size=SNAP))
        if lost.area > LEAST:
            cuts[k].append(lost)


def _split(area: BaseGeometry, difference: Floats) -> tuple[BaseGeometry, BaseGeometry]:
    """Return the parts of an area where a·x + b·y + c is at least 0, and where it is below."""
    slope = difference[:2]
    steep = float(np.hypot(*slope))
    if steep < 1e-9:
        empty = shapely.Polygon()
        return (area, empty) if difference[2] >= -1e-9 else (empty, area)
    normal = slope / steep
    along = np.array([-normal[1], normal[0]])
    foot = -normal * difference[2] / steep
    middle = shapely.get_coordinates(shapely.centroid(area))[0]
    foot = foot + along * float((middle - foot) @ along)
    reach = 4.0 * float(np.ptp(shapely.get_coordinates(area), axis=0).sum()) + 1.0
    reach += float(np.hypot(*(middle - foot)))
    corners = [foot - reach * along, foot + reach * along]
    half = shapely.Polygon([*corners, *(corner + reach * normal for corner in corners[::-1])])
    above = areas(shapely.intersection(area, half, grid_size=SNAP))
    return above, areas(shapely.difference(area, half, grid_size=SNAP))


def _left(slab: Slab, shape: BaseGeometry, cuts: Sequence[BaseGeometry]) -> list[Rings]:
    """Return the polygons that remain of a slab: those that hang together with its face."""
    gone = areas(shapely.union_all(cuts, grid_size=SNAP))
    kept = areas(shapely.difference(shape, gone, grid_size=SNAP))
    whole = shapely.union(kept, slab.face, grid_size=SNAP)
    parts = [p for p in shapely.get_parts(whole) if isinstance(p, shapely.Polygon)]
    found = [p for p in parts if shapely.intersection(p, slab.face).area > 1e-6]
    return [rings_of(shapely.simplify(part, 1e-6)) for part in found]


def exposed_edges(slab: Slab, rings: Rings) -> list[bool]:
    """Return for each edge of the rings whether a fascia shows along it."""
    found: list[bool] = []
    for ring in rings:
        middles = (ring + np.roll(ring, -1, axis=0)) / 2
        apart = np.asarray(shapely.distance(np.array(shapely.points(middles)), slab.exposed))
        found += [bool(value < 1e-5) for value in apart]  # NaN where nothing is exposed
    return found
