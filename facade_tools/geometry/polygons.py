"""Polygons in plan: rings of points, orientation, conversion to and from shapely."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import shapely

from .arrays import Points2

Rings = list[Points2]  # an outer ring counter-clockwise, then holes clockwise, none closed


def signed_area(ring: Points2) -> float:
    """Return the area of a ring (n, 2), positive when counter-clockwise.

    >>> signed_area(np.array([[0, 0], [2, 0], [2, 1], [0, 1]], dtype=float))
    2.0
    """
    if len(ring) < 3:
        return 0.0
    x, y = (ring[1:] - ring[0]).T
    return 0.5 * float(x[:-1] @ y[1:] - y[:-1] @ x[1:])


def oriented(rings: Iterable[Sequence[Sequence[float]] | Points2]) -> Rings:
    """Return the rings as arrays: the outer one counter-clockwise, the others clockwise."""
    arrays = [np.asarray(ring, dtype=np.float64)[:, :2] for ring in rings]
    return [
        ring if (signed_area(ring) > 0) == (place == 0) else ring[::-1]
        for place, ring in enumerate(arrays)
    ]


def rings_of(polygon: shapely.Polygon) -> Rings:
    """Return the oriented rings of a shapely polygon."""
    loops = [polygon.exterior, *polygon.interiors]
    return oriented(shapely.get_coordinates(loop)[:-1] for loop in loops)


def shape_of(rings: Sequence[Points2]) -> shapely.Polygon:
    """Return the shapely polygon of an outer ring and holes."""
    return shapely.Polygon(rings[0], list(rings[1:]))


def sound(rings: Sequence[Sequence[Sequence[float]] | Points2], grid: float = 1e-6) -> list[Rings]:
    """Return the valid polygons that the rings of a map describe, oriented, on a grid (m).

    Repeated points, spikes, crossings and touching rings are repaired; an outline that falls
    apart gives several polygons, one without area none.
    """
    loops = [np.asarray(ring, dtype=np.float64)[:, :2] for ring in rings]
    loops = [loop for loop in loops if len(loop) >= 3]
    if not loops:
        return []
    outer, *holes = [shapely.make_valid(shapely.Polygon(loop)) for loop in loops]
    shape = shapely.difference(outer, shapely.union_all(holes)) if holes else outer
    shape = shapely.set_precision(shape, grid)
    parts = shapely.get_parts(shapely.get_parts(shape))  # of a collection that holds collections
    return [rings_of(part) for part in parts if part.area > 0]
