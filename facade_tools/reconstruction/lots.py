"""The ground that grammars build on: outlines and eaves of a footprint, or of a building's mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Building, Frame, Roof
from ..artifacts.footprint import Footprint
from ..errors import InvalidInput
from ..geometry.polygons import Rings, rings_of, sound
from .engine import Lot

GRID = 1e-6  # m: what touches after rounding is shared (CONTRACT 2)
LEAST_AREA = 0.01  # m²: what a lower box shows of less, beside a higher one, is no lot


@dataclass(frozen=True, slots=True)
class Plot:
    """What stands in one place: its lots, their eaves 0 where unknown, and its roof if it has one.

    roof: of the largest part. frame: how it got into its local frame.
    """

    id: str
    lots: tuple[Lot, ...]
    roof: Roof | None = None
    frame: Frame | None = None


def plot_of(ground: Footprint | Building) -> Plot:
    """Return the plot of a footprint, or of a building's mass. Raises InvalidInput on no area."""
    return _of_building(ground) if isinstance(ground, Building) else _of_footprint(ground)


def _of_footprint(footprint: Footprint) -> Plot:
    polygons = sound(footprint.polygon)
    if not polygons:
        raise InvalidInput(f"the polygon of {footprint.id!r} has no area")
    rings = max(polygons, key=lambda p: shapely.Polygon(p[0]).area)
    lots = (Lot(rings, float(footprint.height)),)
    return Plot(footprint.id, lots, footprint.roof, footprint.frame)


def _of_building(building: Building) -> Plot:
    """Return the outlines of a building's mass by their heights, the lower ones where they show."""
    boxes = [box for box in building.boxes if box.kind != "porch"]
    higher: BaseGeometry = shapely.Polygon()
    lots = []
    for height in sorted({box.height or 0.0 for box in boxes}, reverse=True):
        own = [box for box in boxes if (box.height or 0.0) == height]
        shape = shapely.union_all([
            shapely.box(b.x - b.width / 2, b.y - b.depth / 2, b.x + b.width / 2, b.y + b.depth / 2)
            for b in own
        ], grid_size=GRID)  # fmt: skip
        shown = shapely.difference(shape, higher, grid_size=GRID)
        higher = shapely.union(higher, shape, grid_size=GRID)
        lots += [
            Lot(_plain(part), float(height))
            for part in shapely.get_parts(shown)
            if isinstance(part, shapely.Polygon) and part.area > LEAST_AREA
        ]
    if not lots:
        raise InvalidInput(f"building {building.id!r} has no box")
    roof = max(boxes, key=lambda box: box.width * box.depth).roof
    return Plot(building.id, tuple(lots), roof, building.frame)


def _plain(part: shapely.Polygon) -> Rings:
    """Return the rings of a polygon without the corners that lie on a straight side."""
    return [np.round(ring, 6) for ring in rings_of(shapely.simplify(part, GRID))]
