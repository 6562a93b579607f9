"""CityGML 1.0 to 3.0: buildings with boundary surfaces or solids to building models."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO
from xml.etree.ElementTree import Element

import numpy as np

from ..errors import InvalidInput
from ..geometry.arrays import Floats, Points3
from . import models
from .crs import named
from .reading import HEAD_BYTES, Built, ReadOptions, Record
from .surfaces import Meaning, Model, Surface, ring
from .xmltree import iterate, local, number, text

SRS = re.compile(rb'srsName\s*=\s*"([^"]{1,300})"')
MEANINGS: dict[str, Meaning] = {
    "WallSurface": "wall",
    "RoofSurface": "roof",
    "GroundSurface": "ground",
    "Window": "window",
    "Door": "door",
    "WindowSurface": "window",
    "DoorSurface": "door",
}
BOUNDARIES = ("boundedBy", "boundary")
OPENINGS = ("opening", "fillingSurface")
PARTS = ("consistsOfBuildingPart", "buildingPart")
INSTALLATIONS = ("outerBuildingInstallation", "buildingInstallation")
LOD = re.compile(r"^lod([1-3])")


def detect(head: bytes) -> bool:
    """Tell CityGML by its root element and name space."""
    return b"CityModel" in head and b"opengis.net/citygml" in head


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a building, one city object in memory."""
    match = SRS.search(stream.read(HEAD_BYTES))
    crs = named(match[1].decode("utf-8", "replace")) if match else ""

    def read() -> Iterator[Model | InvalidInput]:
        stream.seek(0)
        for member in iterate(stream, "cityObjectMember"):
            for element in member.iter():
                element.tag = local(element.tag)
            for building in member.findall("Building"):
                yield _model(building, crs)

    yield from models.records(read)


def build(record: Record, options: ReadOptions) -> Built:
    """Return the artifacts of one building."""
    return models.build(record, options)


def _model(building: Element, crs: str) -> Model | InvalidInput:
    identity = next((v for k, v in building.attrib.items() if local(k) == "id"), "")
    try:
        if not identity:
            raise InvalidInput("a building has no gml:id")
        return _checked_model(building, identity, crs)
    except InvalidInput as error:
        return InvalidInput(error.message, pointer=f"/{identity or 'Building'}")


def _checked_model(building: Element, identity: str, crs: str) -> Model:
    elements = [building, *_below(building, PARTS, "BuildingPart")]
    origin = _origin(building)
    parts, codes = [], []
    for element in elements:
        surfaces = tuple(_surfaces(element, origin))
        if surfaces:
            parts.append(surfaces)
            codes.append(text(element, "roofType"))
    installations = [i for e in elements for i in _below(e, INSTALLATIONS, "BuildingInstallation")]
    outside = [tuple(_polygons(item, "other", 0, origin)) for item in installations]
    storeys = number(text(building, "storeysAboveGround"))
    return Model(
        id=identity,
        parts=tuple(parts),
        origin=tuple(origin.tolist()),
        crs=crs,
        function=text(building, "function"),
        roof_types=tuple(codes),
        storeys=int(storeys) if storeys and 0 < storeys < 100 else None,
        outside=tuple(surfaces for surfaces in outside if surfaces),
    )


def _below(element: Element, names: tuple[str, ...], kind: str) -> list[Element]:
    return [child for name in names for child in element.iterfind(f"{name}/{kind}")]


def _origin(building: Element) -> Floats:
    """Return a whole-metre point near the building, so that its coordinates are small."""
    for points in building.iter():
        if points.tag in ("posList", "pos") and points.text:
            return np.round(_numbers(points)[:3])
    return np.zeros(3)


def _surfaces(element: Element, origin: Floats) -> Iterator[Surface]:
    """Yield a part's own surfaces: its boundary surfaces with openings, else its solid."""
    bounded = [child for name in BOUNDARIES for holder in element.findall(name) for child in holder]
    group = 0
    found = False
    for surface in bounded:
        meaning = MEANINGS.get(surface.tag, "closure")
        for polygon in _polygons(surface, meaning, 0, origin):
            found = True
            yield polygon
        for opening in (
            child for name in OPENINGS for holder in surface.findall(name) for child in holder
        ):
            group += 1
            yield from _polygons(opening, MEANINGS.get(opening.tag, "closure"), group, origin)
    if not found:
        yield from _polygons(element, "other", 0, origin)


def _polygons(element: Element, meaning: Meaning, group: int, origin: Floats) -> Iterator[Surface]:
    """Yield the polygons of an element's highest level of detail; not those of its parts."""
    levels: dict[int, list[Element]] = {}
    for child in element:
        match = LOD.match(child.tag)
        if match and "Intersection" not in child.tag and "Curve" not in child.tag:
            levels.setdefault(int(match[1]), []).append(child)
    for level in sorted(levels, reverse=True):
        polygons = [polygon for holder in levels[level] for polygon in holder.iter("Polygon")]
        surfaces = [
            Surface(meaning, rings, group) for p in polygons if (rings := _rings(p, origin))
        ]
        if surfaces:
            yield from surfaces
            return


def _rings(polygon: Element, origin: Floats) -> tuple[Points3, ...]:
    rings = [
        points
        for linear in polygon.iter("LinearRing")
        if (points := ring(_points(linear) - origin)) is not None
    ]
    return tuple(rings)


def _points(linear: Element) -> Points3:
    found = [_numbers(item) for item in linear.iter() if item.tag in ("posList", "pos")]
    values = np.concatenate(found) if found else np.empty(0)
    if len(values) % 3:
        raise InvalidInput(f"{len(values)} coordinates; expected three a point")
    return values.reshape(-1, 3)


def _numbers(element: Element) -> Floats:
    try:
        return np.array((element.text or "").split(), dtype=np.float64)
    except ValueError:
        raise InvalidInput("a coordinate is no number") from None
