"""Features of GeoJSON, and buildings that are mapped in parts (`building:part`)."""

from __future__ import annotations

import tempfile
import weakref
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.documents import parse_json
from ..artifacts.numbers import dump_line
from ..errors import InvalidInput
from ..geometry.arrays import Points2
from ..geometry.rectilinear import valid_polygon
from .crs import System
from .model_store import PlanBoxes
from .osm import is_building, is_part
from .reading import Record

MARK = b"building:part"  # stands in every file that maps parts
MOST_CORNERS = 100_000
MOST_PARTS = 1000  # of one building


@dataclass(frozen=True)
class Part:
    """A part of a building: its id, tags and rings, in the source's coordinates."""

    identity: str
    tags: Mapping[str, Any]
    rings: tuple[Points2, ...]


@dataclass(frozen=True)
class Feature:
    """A feature (None: the record's own line), its coordinates' system, its building's parts."""

    value: Any
    system: System
    parts: tuple[Part, ...] = ()


def tags_of(feature: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the properties of a feature, empty where it has none."""
    tags = feature.get("properties")
    return tags if isinstance(tags, dict) else {}


def polygons_of(feature: Mapping[str, Any]) -> Iterator[list[Points2]]:
    """Yield the polygons of a feature, as rings; raises InvalidInput for broken coordinates."""
    yield from _polygons(feature.get("geometry"), 0)


def _polygons(geometry: Any, depth: int) -> Iterator[list[Points2]]:
    if not isinstance(geometry, dict) or depth > 4:
        return
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    members = geometry.get("geometries")
    if kind == "GeometryCollection" and isinstance(members, list):
        for member in members:
            yield from _polygons(member, depth + 1)
    if kind not in ("Polygon", "MultiPolygon") or not isinstance(coordinates, list):
        return
    for rings in [coordinates] if kind == "Polygon" else coordinates:
        arrays = _rings(rings)
        if arrays:
            yield arrays


def _rings(rings: Any) -> list[Points2]:
    try:
        arrays = [np.array([p[:2] for p in ring], dtype=np.float64) for ring in rings]
    except (TypeError, ValueError):
        raise InvalidInput("a coordinate is no number", pointer="/geometry") from None
    if any(len(array) and (array.ndim != 2 or array.shape[1] != 2) for array in arrays):
        raise InvalidInput("a point has fewer than two numbers", pointer="/geometry")
    if arrays and len(arrays[0]) < 3:
        raise InvalidInput("an outline of fewer than three corners", pointer="/geometry")
    if sum(map(len, arrays)) > MOST_CORNERS or not all(np.isfinite(a).all() for a in arrays):
        raise InvalidInput("too many corners, or one at no finite place", pointer="/geometry")
    return [array for array in arrays if len(array)]


# --- parts ----------------------------------------------------------------------------------------
def with_parts(read: Callable[[], Iterator[Record]]) -> Iterator[Record]:
    """Yield the records of a file without its parts, which go to the building around them.

    `read` reads the file from its start: once for the parts, which wait on disk, once for the
    buildings. A part that lies in no building becomes one.
    """
    parts = _Parts()
    for record in read():
        feature = _feature(record)
        if feature is not None and _only_part(feature):
            parts.add(record, feature)
    for record in read():
        feature = _feature(record)
        if feature is None:
            yield record
        elif not _only_part(feature):
            found = parts.of(feature) if is_building(tags_of(feature)) else ()
            yield replace(record, payload=replace(record.payload, parts=found))
    yield from parts.left()


def _feature(record: Record) -> dict[str, Any] | None:
    """Return the feature of a record; None for what is none, which `build` refuses."""
    try:
        value = record.payload.value if record.data is None else parse_json(record.data)
    except InvalidInput:
        return None
    return value if isinstance(value, dict) else None


def _only_part(feature: Mapping[str, Any]) -> bool:
    tags = tags_of(feature)
    return is_part(tags) and not is_building(tags)


class _Parts:
    """Parts on disk, and their bounding boxes."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the parts)
        weakref.finalize(self, self._file.close)
        self._starts = array("Q")
        self._boxes = PlanBoxes()
        self._taken = bytearray()
        self._records: Record | None = None

    def add(self, record: Record, feature: Mapping[str, Any]) -> None:
        """Let a part wait."""
        try:
            outlines = [rings[0] for rings in polygons_of(feature)]
        except InvalidInput:
            outlines = []  # `left` refuses it
        corners = np.concatenate([np.empty((0, 2)), *outlines])
        if len(corners):
            low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
            self._boxes.add(len(self._starts), "", (*low, *high))
        self._starts.append(self._file.seek(0, 2))
        self._taken.append(0)
        self._file.write(dump_line({**feature, "pointer": record.pointer, "line": record.line}))
        self._records = self._records or replace(record, data=None)

    def _read(self, number: int) -> dict[str, Any]:
        self._file.seek(self._starts[number])
        found: dict[str, Any] = parse_json(self._file.readline())
        return found

    def of(self, building: Mapping[str, Any]) -> tuple[Part, ...]:
        """Return the parts that have a point of theirs inside the outline of a building."""
        try:
            outline = next(polygons_of(building), None)
        except InvalidInput:
            return ()
        shape = valid_polygon(outline) if outline else shapely.Polygon()
        if shape.is_empty:
            return ()
        found: list[Part] = []
        for number in self._boxes.near("", shape.bounds, 0.0):
            if self._taken[number] or len(found) == MOST_PARTS:
                continue
            feature = self._read(number)
            inside = [rings for rings in polygons_of(feature) if _within(rings, shape)]
            self._taken[number] = bool(inside)
            name = str(feature.get("id") or tags_of(feature).get("@id") or f"part-{number + 1}")
            names = (name if k == 0 else f"{name}-{k + 1}" for k in range(len(inside)))
            found += [
                Part(name, tags_of(feature), tuple(rings))
                for name, rings in zip(names, inside, strict=True)
            ]
        return tuple(found)

    def left(self) -> Iterator[Record]:
        """Yield the parts that no building took, as buildings."""
        for number, taken in enumerate(self._taken):
            if taken or self._records is None:
                continue
            feature = self._read(number)
            tags = {**tags_of(feature), "building": "yes"}
            payload = replace(
                self._records.payload, value={**feature, "properties": tags}, parts=()
            )
            yield Record(payload, feature["line"], feature["pointer"])


def _within(rings: list[Points2], outline: BaseGeometry) -> bool:
    polygon = valid_polygon(rings)
    return not polygon.is_empty and bool(outline.contains(shapely.point_on_surface(polygon)))
