"""Footprints for `facade derive` and `facade reconstruct`: GeoJSON, footprints, buildings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from facade_tools.artifacts.building import Building, Frame, Roof
from facade_tools.artifacts.footprint import Footprint
from facade_tools.artifacts.store import read_raw
from facade_tools.errors import InvalidInput, Place
from facade_tools.formats.importing import items
from facade_tools.formats.reading import BY_NAME, ReadOptions
from facade_tools.geometry.polygons import Rings, rings_of, sound

GEOJSON = (".geojson", ".geojsonl")


@dataclass(frozen=True)
class Plot:
    """What stands on a footprint: outlines (m) with the heights of their eaves, 0 where unknown."""

    id: str
    lots: tuple[tuple[Rings, float], ...]
    roof: Roof | None = None
    frame: Frame | None = None


def plots(path: str, metres: bool = False) -> Iterator[Plot]:
    """Yield the plots of a file. Raises InvalidInput where it holds none."""
    found = False
    for artifact in artifacts_of(path, metres):
        found = True
        yield _of_building(artifact) if isinstance(artifact, Building) else _of_footprint(artifact)
    if not found:
        raise InvalidInput("holds no polygon of a building").at(path)


def artifacts_of(path: str, metres: bool) -> Iterator[Footprint | Building]:
    """Yield the footprints and buildings of a file, GeoJSON or artifacts."""
    if Path(path).suffix.lower() in GEOJSON or _is_geojson(path):
        options = ReadOptions(kind="footprints", metres=metres)
        for item in items([path], options):
            if item.error is not None or item.format is None or item.record is None:
                raise item.error or InvalidInput("cannot be read").at(path)
            try:
                built = item.format.build(item.record, options).artifacts
            except InvalidInput as error:
                place = Place(path, item.record.line, item.record.pointer or error.place.pointer)
                raise InvalidInput(error.message, place) from None
            for artifact in built:
                if isinstance(artifact, Footprint):
                    stem = Path(path).name.split(".")[0]
                    name = f"{stem}{artifact.id.removeprefix(BY_NAME)}"
                    yield replace(artifact, id=name) if BY_NAME in artifact.id[:1] else artifact
        return
    for raw in read_raw([path]):
        yield raw.artifact("footprint", "building")


def _is_geojson(path: str) -> bool:
    try:
        with Path(path).open("rb") as file:
            head = file.read(4096)
    except OSError:
        return False
    return b'"Feature' in head and b"facade-tools/" not in head


def _of_footprint(footprint: Footprint) -> Plot:
    polygons = sound(footprint.polygon)
    if not polygons:
        raise InvalidInput(f"the polygon of {footprint.id!r} has no area")
    rings = max(polygons, key=lambda p: shapely.Polygon(p[0]).area)
    lots = ((rings, float(footprint.height)),)
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
        ], grid_size=1e-6)  # fmt: skip
        shown = shapely.difference(shape, higher, grid_size=1e-6)
        higher = shapely.union(higher, shape, grid_size=1e-6)
        lots += [
            (_plain(part), float(height))
            for part in shapely.get_parts(shown)
            if isinstance(part, shapely.Polygon) and part.area > 0.01
        ]
    if not lots:
        raise InvalidInput(f"building {building.id!r} has no box")
    roof = max(boxes, key=lambda box: box.width * box.depth).roof
    return Plot(building.id, tuple(lots), roof, building.frame)


def _plain(part: shapely.Polygon) -> Rings:
    return [np.round(ring, 6) for ring in rings_of(shapely.simplify(part, 1e-6))]
