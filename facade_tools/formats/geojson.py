"""GeoJSON, whole or a feature a line, with OSM Simple 3D Buildings tags, to footprints."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

import ijson
import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Box, Building, Frame
from ..artifacts.documents import parse_json
from ..artifacts.footprint import Footprint
from ..errors import InvalidInput
from ..geometry.arrays import Points2
from ..geometry.rectilinear import main_direction, partition, rotated, valid_polygon
from .crs import in_degrees, named
from .osm import is_building, shape_of
from .projection import crs_name, to_metres
from .reading import BY_NAME, HEAD_BYTES, Built, ReadOptions, Record

TYPE = re.compile(rb'"type"\s*:\s*"(FeatureCollection|Feature)"')
CRS = re.compile(rb'"crs"\s*:\s*\{.{0,200}?"name"\s*:\s*"([^"]{1,200})"', re.S)
LEAST_AREA, LARGEST = 4.0, 2000.0  # m², metres
LONGEST_LINE = 64 << 20
MOST_CORNERS = 100_000
RECORD_MARK = b"\x1e"


def detect(head: bytes) -> bool:
    """Tell a feature collection, or a feature a line, by the type."""
    return head.lstrip(RECORD_MARK + b" \t\r\n")[:1] == b"{" and TYPE.search(head) is not None


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a feature."""
    head = stream.read(HEAD_BYTES)
    match = CRS.search(head)
    crs = named(match[1].decode("utf-8", "replace")) if match else ""
    stream.seek(0)
    kind = TYPE.search(head)
    if kind is not None and kind[1] == b"Feature" and b'"FeatureCollection"' not in head:
        yield from _lines(stream, crs)
        return
    try:
        for index, feature in enumerate(ijson.items(stream, "features.item", use_float=True)):
            yield Record((feature, crs), pointer=f"/features/{index}")
    except ijson.JSONError as error:
        raise InvalidInput(f"not valid JSON: {str(error).splitlines()[0]}") from None


def _lines(stream: BinaryIO, crs: str) -> Iterator[Record]:
    number = 1
    while line := stream.readline(LONGEST_LINE):
        if line.strip(RECORD_MARK + b" \t\r\n"):
            yield Record((None, crs), line=number, data=line)
        number += 1


def build(record: Record, options: ReadOptions) -> Built:
    """Return the footprints (or buildings) of one feature."""
    feature, crs = record.payload
    if record.data is not None:
        feature = parse_json(record.data.lstrip(RECORD_MARK))
    notes: Counter[str] = Counter()
    if not isinstance(feature, dict) or feature.get("type") != "Feature":
        raise InvalidInput("is no Feature; expected a polygon with properties")
    tags = feature.get("properties") or {}
    polygons = list(_polygons(feature.get("geometry")))
    if not isinstance(tags, dict) or not polygons or not is_building(tags):
        notes["feature that is no building polygon: left out"] += 1
        return Built((), notes)
    identity = _identity(feature, tags, record)
    degrees = not options.metres and (not crs or in_degrees(crs))
    found = []
    for index, rings in enumerate(polygons):
        name = identity if index == 0 else f"{identity}-{index + 1}"
        found.append(_footprint(name, rings, tags, None if degrees else crs, notes))
    if options.kind in ("buildings", "attributes"):
        return Built(tuple(map(building_of, found)), notes)
    return Built(tuple(found), notes)


def _polygons(geometry: Any) -> Iterator[list[Points2]]:
    if not isinstance(geometry, dict):
        return
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    if kind not in ("Polygon", "MultiPolygon") or not isinstance(coordinates, list):
        return
    for rings in [coordinates] if kind == "Polygon" else coordinates:
        try:
            arrays = [np.array([p[:2] for p in ring], dtype=np.float64) for ring in rings]
        except (TypeError, ValueError):
            raise InvalidInput("a coordinate is no number", pointer="/geometry") from None
        if any(array.ndim != 2 or array.shape[1] != 2 for array in arrays):
            raise InvalidInput("a point has fewer than two numbers", pointer="/geometry")
        if sum(map(len, arrays)) > MOST_CORNERS or not all(np.isfinite(a).all() for a in arrays):
            raise InvalidInput("too many corners, or one at no finite place", pointer="/geometry")
        if arrays:
            yield arrays


def _identity(feature: Mapping[str, Any], tags: Mapping[str, Any], record: Record) -> str:
    for value in (feature.get("id"), tags.get("@id"), tags.get("id"), tags.get("osm_id")):
        if isinstance(value, str | int | float) and str(value).strip():
            return str(value).strip()[:180]
    place = record.line if record.line is not None else record.pointer.rpartition("/")[2]
    return f"{BY_NAME}-{place}"


def _footprint(
    identity: str,
    rings: list[Points2],
    tags: Mapping[str, Any],
    system: str | None,
    notes: Counter[str],
) -> Footprint:
    local, origin, crs = _localised(rings, system)
    polygon = _largest(valid_polygon(local), notes)
    turn = main_direction(polygon)
    turned = rotated(polygon, -turn)
    x0, y0, x1, y1 = turned.bounds
    if polygon.area < LEAST_AREA or max(x1 - x0, y1 - y0) > LARGEST:
        size = f"{polygon.area:.2f} m², {max(x1 - x0, y1 - y0):.1f} m long"
        raise InvalidInput(f"{size}; expected a building of 4 m² to 2 km (in metres?)")
    middle = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0])
    plan = shapely.transform(turned, lambda points: np.round(points - middle, 4))
    shape = shape_of(tags, plan, turn, notes)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    x, y = np.array([[c, -s], [s, c]]) @ middle
    shift = (round(origin[0] + float(x), 6), round(origin[1] + float(y), 6), 0.0)
    outline = shapely.get_rings(shapely.orient_polygons(plan))
    return Footprint(
        identity,
        tuple(tuple(map(tuple, shapely.get_coordinates(ring)[:-1].tolist())) for ring in outline),
        shape.height,
        shape.roof,
        Frame(round(turn, 9), shift, crs),
        {key: value for key, value in tags.items() if isinstance(value, str | int | float | bool)},
    )


def _localised(
    rings: list[Points2], system: str | None
) -> tuple[list[Points2], tuple[float, float], str]:
    """Return rings in metres around an origin, the origin in its system, and that system's name.

    Degrees are projected around the middle of the polygon, which is the origin of a system of its
    own; metres keep their system and only lose a whole number.
    """
    low, high = rings[0].min(axis=0), rings[0].max(axis=0)
    if system is not None:
        base = np.round((low + high) / 2.0)
        return [ring - base for ring in rings], (float(base[0]), float(base[1])), system
    if max(abs(low[0]), abs(high[0])) > 180.0 or max(abs(low[1]), abs(high[1])) > 90.0:
        raise InvalidInput("coordinates are no degrees; --metres says that they are planar")
    origin = round(float(low[0] + high[0]) / 2.0, 7), round(float(low[1] + high[1]) / 2.0, 7)
    return [to_metres(ring, origin) for ring in rings], (0.0, 0.0), crs_name(origin)


def _largest(polygon: BaseGeometry, notes: Counter[str]) -> BaseGeometry:
    parts = shapely.get_parts(polygon)
    if len(parts) > 1:
        notes["outline crosses itself: its largest part kept"] += 1
    return max(parts, key=lambda part: part.area, default=shapely.Polygon())


def building_of(footprint: Footprint) -> Building:
    """Return a footprint as boxes with its roof; its plan's residual stands in the tags."""
    polygon = valid_polygon([np.array(ring) for ring in footprint.polygon])
    parts = partition([polygon])
    boxes = tuple(
        Box(
            f"general-{index}",
            "general",
            round((x0 + x1) / 2.0, 6),
            round((y0 + y1) / 2.0, 6),
            round(x1 - x0, 6),
            round(y1 - y0, 6),
            footprint.height,
            footprint.roof,
        )
        for index, (x0, y0, x1, y1) in enumerate(parts.rectangles[0].tolist(), start=1)
    )
    return Building(
        footprint.id,
        boxes,
        storey_height=min(3.0, round(1.99 * footprint.height, 4)),
        partial=True,
        complete=("mass", "roof"),
        frame=footprint.frame,
        tags={**footprint.tags, "plan_residual": round(parts.residual, 6)},
    )
