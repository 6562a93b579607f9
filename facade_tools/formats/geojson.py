"""GeoJSON, whole or a feature a line, with OSM Simple 3D Buildings tags, to footprints."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, BinaryIO

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Box, Building, Frame, Roof
from ..artifacts.documents import parse_json
from ..artifacts.footprint import Footprint
from ..errors import InvalidInput
from ..geometry.arrays import Points2
from ..geometry.rectilinear import areas, main_direction, partition, rotated, valid_polygon
from .crs import System
from .geojson_parts import MARK, Feature, Part, polygons_of, tags_of, with_parts
from .json_stream import values
from .osm import Shape, is_building, shape_of
from .reading import BY_NAME, HEAD_BYTES, Built, ReadOptions, Record, read_whole, without_mark

GEOMETRIES = "Polygon|MultiPolygon|GeometryCollection"
TYPE = re.compile(rf'"type"\s*:\s*"(FeatureCollection|Feature|{GEOMETRIES})"'.encode())
CRS = re.compile(rb'"crs"\s*:\s*\{.{0,200}?"name"\s*:\s*"([^"]{1,200})"', re.S)
LAST_TYPE = re.compile(rb'\]\s*,\s*"type"\s*:\s*"FeatureCollection"\s*\}\s*$')
LEAST_AREA, LEAST_PART, LARGEST = 4.0, 1.0, 2000.0  # m², m², metres
LONGEST_LINE = 64 << 20
LEFT_OVER = 0.1  # of an outline: what no part covers and is larger stays a footprint
RECORD_MARK = b"\x1e"
Row = tuple[str, BaseGeometry, Mapping[str, Any]]  # name, polygon and tags of what stands there


def detect(head: bytes) -> bool:
    """Tell a feature collection, a feature a line, a feature or a geometry, by the type."""
    return head.lstrip(RECORD_MARK + b" \t\r\n")[:1] == b"{" and TYPE.search(head) is not None


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a feature; a building that is mapped in parts is one with them."""
    source = _Source(stream, options)
    yield from with_parts(source) if source.mentions(MARK) else source()


class _Source:
    """A file of features, which can be read again and again."""

    def __init__(self, stream: BinaryIO, options: ReadOptions) -> None:
        self.stream, self.start = stream, without_mark(stream)
        head = stream.read(HEAD_BYTES)
        size = stream.seek(0, 2)
        stream.seek(max(size - HEAD_BYTES, self.start))
        tail = stream.read()
        match = CRS.search(head) or CRS.search(tail)
        named = match[1].decode("utf-8", "replace") if match else ""
        system = System.of(named) if named else System("", degrees=True)
        self.system = replace(system, degrees=False, metres=1.0) if options.metres else system
        first = head.lstrip(RECORD_MARK + b" \t\r\n").split(b"\n")[0].rstrip()
        # Where keys are sorted, the type stands behind the features.
        self.collection = b'"FeatureCollection"' in head or LAST_TYPE.search(tail) is not None
        self.lines = not self.collection and (first.endswith(b"}") or len(first) == len(head))

    def mentions(self, word: bytes) -> bool:
        """Tell whether a word stands in the file."""
        self.stream.seek(self.start)
        before = b""
        while block := self.stream.read(1 << 20):
            if word in before + block:
                return True
            before = block[-len(word) :]
        return False

    def __call__(self) -> Iterator[Record]:
        """Yield a record a feature."""
        self.stream.seek(self.start)
        if self.collection:
            yield from self._items()
        elif self.lines:
            yield from self._lines()
        else:
            value = parse_json(read_whole(self.stream))
            if isinstance(value, dict) and value.get("type") != "Feature":
                value = {"type": "Feature", "properties": None, "geometry": value}
            yield Record(Feature(value, self.system), pointer="/0")

    def _items(self) -> Iterator[Record]:
        for index, value in enumerate(values(self.stream, "features.item")):
            yield Record(Feature(value, self.system), pointer=f"/features/{index}")

    def _lines(self) -> Iterator[Record]:
        number = 1
        while line := self.stream.readline(LONGEST_LINE):
            if data := line.strip(RECORD_MARK + b" \t\r\n"):
                yield Record(Feature(None, self.system), line=number, data=data)
            number += 1


def build(record: Record, options: ReadOptions) -> Built:
    """Return the footprints (or buildings) of one feature.

    Raises InvalidInput on what is no feature.
    """
    payload: Feature = record.payload
    feature = payload.value if record.data is None else parse_json(record.data)
    notes: Counter[str] = Counter()
    if not isinstance(feature, dict) or feature.get("type") not in ("Feature", *_GEOMETRIES):
        raise InvalidInput("is no Feature; expected a polygon with properties")
    if feature["type"] != "Feature":
        feature = {"type": "Feature", "properties": None, "geometry": feature}
    tags = tags_of(feature)
    polygons = list(polygons_of(feature))
    if not polygons or not is_building(tags):
        notes["feature that is no building polygon: left out"] += 1
        return Built((), notes)
    identity = _identity(feature, tags, record)
    boxes = options.kind in ("buildings", "attributes")
    found: list[Footprint | Building] = []
    for index, rings in enumerate(polygons):
        name = f"{identity}-{index + 1}" if found else identity
        parts = payload.parts if index == 0 else ()
        shapes = [rings, *(part.rings for part in parts)]
        (polygon, *others), origin, crs = _localised(shapes, payload.system, notes)
        if polygon.area < LEAST_AREA and len(polygons) > 1:
            notes["piece smaller than 4 m² beside others: left out"] += 1
            continue
        site = _Site.of(polygon, origin, crs)
        rows: list[Row] = [(name, polygon, tags)]
        if parts:
            rows = _in_parts(name, polygon, list(zip(parts, others, strict=True)), tags, notes)
        if boxes:
            masses = [
                (plan := site.plan(p), shape_of(t, plan, site.turn, notes)) for _, p, t in rows
            ]
            found.append(_boxed(name, masses, site.frame, tags))
        else:
            sites = [
                site if p is polygon else _Site.of(p, origin, crs, LEAST_PART) for _, p, _ in rows
            ]
            found += [
                _footprint(n, at, p, t, notes) for at, (n, p, t) in zip(sites, rows, strict=True)
            ]
    if not found:
        raise InvalidInput("several polygons, none of 4 m²; expected a building (in metres?)")
    return Built(tuple(found), notes)


_GEOMETRIES = tuple(GEOMETRIES.split("|"))


def _identity(feature: Mapping[str, Any], tags: Mapping[str, Any], record: Record) -> str:
    for value in (feature.get("id"), tags.get("@id"), tags.get("id"), tags.get("osm_id")):
        if isinstance(value, str | int | float) and str(value).strip():
            return str(value).strip()[:180]
    place = record.line if record.line is not None else record.pointer.rpartition("/")[2]
    return f"{BY_NAME}-{place}"


# --- frames ---------------------------------------------------------------------------------------
@dataclass(frozen=True)
class _Site:
    """The frame in which a footprint lies along the axes, its middle at the origin.

    turn: degrees from there to the source; middle: of the turned polygon, metres.
    """

    turn: float
    middle: Points2
    frame: Frame

    @classmethod
    def of(
        cls, polygon: BaseGeometry, origin: Points2, crs: str, least: float = LEAST_AREA
    ) -> _Site:
        """Return the frame of a polygon in metres around an origin; raises InvalidInput."""
        if polygon.is_empty:
            raise InvalidInput("an outline without area; expected at least three corners")
        turn = main_direction(polygon)
        x0, y0, x1, y1 = rotated(polygon, -turn).bounds
        size = max(x1 - x0, y1 - y0)
        if polygon.area < least or size > LARGEST:
            text = f"{polygon.area:.2f} m², {size:.1f} m long"
            raise InvalidInput(f"{text}; expected a building of 4 m² to 2 km (in metres?)")
        middle = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0])
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        x, y = (origin[:2] + np.array([[c, -s], [s, c]]) @ middle).tolist()
        return cls(turn, middle, Frame(round(turn, 9), (round(x, 6), round(y, 6), 0.0), crs))

    def plan(self, polygon: BaseGeometry) -> BaseGeometry:
        """Return a polygon in this frame, rounded to 0.1 mm."""
        turned = rotated(polygon, -self.turn)
        return shapely.transform(turned, lambda points: np.round(points - self.middle, 4))


def _localised(
    polygons: Sequence[Sequence[Points2]], system: System, notes: Counter[str]
) -> tuple[list[BaseGeometry], Points2, str]:
    """Return polygons in metres, repaired, their common origin, and the name of its system."""
    rings = [ring for rings in polygons for ring in rings]
    flat = np.concatenate(rings)
    points, origin, crs = system.local(np.column_stack([flat, np.zeros(len(flat))]), np.zeros(3))
    local = iter(np.split(points[:, :2], np.cumsum([len(ring) for ring in rings])[:-1]))
    found = [_largest(valid_polygon([next(local) for _ in rings]), notes) for rings in polygons]
    return found, origin, crs


def _largest(polygon: BaseGeometry, notes: Counter[str]) -> BaseGeometry:
    parts = shapely.get_parts(polygon)
    if len(parts) > 1:
        notes["outline crosses itself: its largest part kept"] += 1
    return max(parts, key=lambda part: part.area, default=shapely.Polygon())


# --- artifacts ------------------------------------------------------------------------------------
def _footprint(
    identity: str, site: _Site, polygon: BaseGeometry, tags: Mapping[str, Any], notes: Counter[str]
) -> Footprint:
    plan = site.plan(polygon)
    shape = shape_of(tags, plan, site.turn, notes)
    outline = shapely.get_rings(shapely.orient_polygons(plan))
    return Footprint(
        identity,
        tuple(tuple(map(tuple, shapely.get_coordinates(ring)[:-1].tolist())) for ring in outline),
        shape.height,
        shape.roof,
        site.frame,
        _kept(tags),
    )


def _kept(tags: Mapping[str, Any]) -> dict[str, Any]:
    return {
        key: value for key, value in tags.items() if isinstance(value, str | int | float | bool)
    }


def _in_parts(
    identity: str,
    polygon: BaseGeometry,
    parts: Sequence[tuple[Part, BaseGeometry]],
    tags: Mapping[str, Any],
    notes: Counter[str],
) -> list[Row]:
    """Return name, polygon and tags of what a building consists of, highest first.

    What no part covers is one more, with the tags of the whole, where it is worth a place.
    """
    rows: list[Row] = []
    for part, shape in parts:
        if shape.area < LEAST_PART:
            notes["building part smaller than 1 m²: left out"] += 1
            continue
        rows.append((part.identity, shape, {**part.tags, "part_of": identity}))
    rest = areas(polygon.difference(shapely.union_all([shape for _, shape, _ in rows])))
    large = [
        p for p in shapely.get_parts(rest) if p.area > max(LEAST_AREA, LEFT_OVER * polygon.area)
    ]
    names = [identity, *(f"{identity}-{k}" for k in range(2, len(large) + 1))]
    rows += [(name, piece, tags) for name, piece in zip(names, large, strict=False)]
    return rows


def building_of(footprint: Footprint) -> Building:
    """Return a footprint as boxes with its roof; its plan's residual stands in the tags."""
    polygon = valid_polygon([np.array(ring) for ring in footprint.polygon])
    shape = Shape(footprint.height, footprint.roof or Roof("flat"))
    return _boxed(footprint.id, [(polygon, shape)], footprint.frame, footprint.tags)


def _boxed(
    identity: str,
    masses: Sequence[tuple[BaseGeometry, Shape]],
    frame: Frame | None,
    tags: Mapping[str, Any],
) -> Building:
    """Return the boxes of masses; where they overlap, the higher one stands."""
    ordered = sorted(masses, key=lambda row: -row[1].height)
    free: list[BaseGeometry] = []
    for polygon, _ in ordered:
        free.append(areas(polygon.difference(shapely.union_all(free))))
    found = partition(free)
    boxes: list[Box] = []
    for (_, shape), rectangles in zip(ordered, found.rectangles, strict=True):
        for x0, y0, x1, y1 in rectangles.tolist():
            middle = round((x0 + x1) / 2.0, 6), round((y0 + y1) / 2.0, 6)
            size = round(x1 - x0, 6), round(y1 - y0, 6)
            name = f"general-{len(boxes) + 1}"
            boxes.append(Box(name, "general", *middle, *size, shape.height, shape.roof))
    if not boxes:
        raise InvalidInput("no wall is long enough for a box; expected a building")
    lowest = min(shape.height for _, shape in masses)
    return Building(
        identity,
        tuple(boxes),
        storey_height=min(3.0, round(1.99 * lowest, 4)),
        partial=True,
        complete=("mass", "roof"),
        frame=frame,
        tags={**_kept(tags), "plan_residual": round(found.residual, 6)},
    )
