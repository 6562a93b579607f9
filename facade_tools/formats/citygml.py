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
from .crs import System
from .reading import HEAD_BYTES, Built, ReadOptions, Record, without_mark
from .surfaces import Meaning, Model, Surface, localised, ring
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
MEMBERS = ("cityObjectMember", "featureMember", "featureMembers")
BOUNDARIES = ("boundedBy", "boundary")
OPENINGS = ("opening", "fillingSurface")
PARTS = ("consistsOfBuildingPart", "buildingPart")
INSTALLATIONS = ("outerBuildingInstallation", "buildingInstallation")
LOD = re.compile(r"^lod([1-4])")
POLYGONS = ("Polygon", "PolygonPatch", "Triangle", "Rectangle")
POSITIONS = ("posList", "pos", "coordinates")


def detect(head: bytes) -> bool:
    """Tell CityGML by its root element and name space."""
    return b"CityModel" in head and b"opengis.net/citygml" in head


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a building, one city object in memory."""
    start = without_mark(stream)
    match = SRS.search(stream.read(HEAD_BYTES))
    system = System.of(match[1].decode("utf-8", "replace") if match else "", formal_order=True)

    def read() -> Iterator[Model | InvalidInput]:
        stream.seek(start)
        for member in iterate(stream, MEMBERS):
            for element in member.iter():
                element.tag = local(element.tag)
            for building in member.iterfind("Building"):
                yield _model(building, system)

    yield from models.records(read, options)


def build(record: Record, options: ReadOptions) -> Built:
    """Return the artifacts of one building."""
    return models.build(record, options)


def _model(building: Element, system: System) -> Model | InvalidInput:
    identity = next((v for k, v in building.attrib.items() if local(k) == "id"), "")
    try:
        if not identity:
            raise InvalidInput("a building has no gml:id")
        return _checked_model(building, identity, system)
    except InvalidInput as error:
        return InvalidInput(error.message, pointer=f"/{identity or 'Building'}")


def _checked_model(building: Element, identity: str, system: System) -> Model:
    elements = [building, *_below(building, PARTS, "BuildingPart")]
    base = _base(building)
    parts, codes = [], []
    for element in elements:
        surfaces = tuple(_surfaces(element, base))
        if surfaces:
            parts.append(surfaces)
            codes.append(text(element, "roofType"))
    installations = [i for e in elements for i in _below(e, INSTALLATIONS, "BuildingInstallation")]
    outside = [found for item in installations if (found := tuple(_installation(item, base)))]
    storeys = number(text(building, "storeysAboveGround"))
    (near, around), origin, crs = localised((parts, outside), system, base)
    return Model(
        id=identity,
        parts=near,
        origin=tuple(origin.tolist()),
        crs=crs,
        function=text(building, "function"),
        roof_types=tuple(codes),
        storeys=int(storeys) if storeys and 0 < storeys < 100 else None,
        outside=around,
    )


def _below(element: Element, names: tuple[str, ...], kind: str) -> list[Element]:
    return [child for name in names for child in element.iterfind(f"{name}/{kind}")]


def _base(building: Element) -> Floats:
    """Return whole numbers near the building, so that its coordinates are small."""
    for points in building.iter():
        if points.tag in POSITIONS and points.text:
            return np.round(_numbers(points)[:3])
    return np.zeros(3)


def _installation(element: Element, base: Floats) -> Iterator[Surface]:
    """Yield the polygons of an installation: its own, else those of its boundary surfaces."""
    found = list(_polygons(element, "other", 0, base))
    yield from found or (
        polygon
        for name in BOUNDARIES
        for holder in element.findall(name)
        for surface in holder
        for polygon in _polygons(surface, MEANINGS.get(surface.tag, "other"), 0, base)
    )


def _surfaces(element: Element, base: Floats) -> Iterator[Surface]:
    """Yield a part's own surfaces: its boundary surfaces with openings, else its solid."""
    bounded = [child for name in BOUNDARIES for holder in element.findall(name) for child in holder]
    group = 0
    found = False
    for surface in bounded:
        meaning = MEANINGS.get(surface.tag, "closure")
        for polygon in _polygons(surface, meaning, 0, base):
            found = True
            yield polygon
        for opening in (
            child for name in OPENINGS for holder in surface.findall(name) for child in holder
        ):
            group += 1
            yield from _polygons(opening, MEANINGS.get(opening.tag, "closure"), group, base)
    if not found:
        yield from _polygons(element, "other", 0, base)


def _polygons(element: Element, meaning: Meaning, group: int, base: Floats) -> Iterator[Surface]:
    """Yield the polygons of an element's highest level of detail; not those of its parts."""
    levels: dict[int, list[Element]] = {}
    for child in element:
        match = LOD.match(child.tag)
        if match and "Intersection" not in child.tag and "Curve" not in child.tag:
            levels.setdefault(int(match[1]), []).append(child)
    for level in sorted(levels, reverse=True):
        polygons = [p for holder in levels[level] for p in holder.iter() if p.tag in POLYGONS]
        surfaces = [Surface(meaning, rings, group) for p in polygons if (rings := _rings(p, base))]
        if surfaces:
            yield from surfaces
            return


def _rings(polygon: Element, base: Floats) -> tuple[Points3, ...]:
    rings = [
        points
        for linear in polygon.iter("LinearRing")
        if (points := ring(_points(linear) - base)) is not None
    ]
    return tuple(rings)


def _points(linear: Element) -> Points3:
    found = [_numbers(item) for item in linear.iter() if item.tag in POSITIONS]
    values = np.concatenate(found) if found else np.empty(0)
    if len(values) % 3:
        raise InvalidInput(f"{len(values)} coordinates; expected three a point")
    return values.reshape(-1, 3)


def _numbers(element: Element) -> Floats:
    words = element.text or ""
    if element.tag == "coordinates":  # of GML 2: tuples apart by blanks
        words = words.replace(",", " ")
    try:
        return np.array(words.split(), dtype=np.float64)
    except ValueError:
        raise InvalidInput("a coordinate is no number") from None
