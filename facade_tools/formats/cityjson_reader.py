"""CityJSON 1.0 to 2.0 and CityJSONSeq: city objects to building models, in bounded memory."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import ijson
import numpy as np

from ..artifacts.documents import parse_json
from ..errors import InvalidInput
from ..geometry.arrays import Floats
from . import models
from .city import ARTIFACT
from .crs import named
from .reading import Built, ReadOptions, Record
from .surfaces import Meaning, Model, Surface, ring

TYPE = re.compile(rb'"type"\s*:\s*"CityJSON(Feature)?"')
MEANINGS: dict[str, Meaning] = {
    "WallSurface": "wall",
    "RoofSurface": "roof",
    "GroundSurface": "ground",
    "Window": "window",
    "Door": "door",
}
BATCH = 1 << 16
MOST_VERTICES = 200_000_000
LONGEST_LINE = 64 << 20


@dataclass(frozen=True)
class Frame:
    """How integer vertices become metres, and the name of the reference system."""

    scale: tuple[float, ...] = (1.0, 1.0, 1.0)
    translate: tuple[float, ...] = (0.0, 0.0, 0.0)
    crs: str = ""


def detect(head: bytes) -> bool:
    """Tell CityJSON and CityJSONSeq by the type."""
    return head.lstrip()[:1] == b"{" and TYPE.search(head) is not None


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a building, of one document or of a sequence of features."""
    first = stream.readline(LONGEST_LINE)
    second = stream.readline(LONGEST_LINE) if _is_document(first) else b""
    if second.lstrip().startswith(b"{"):
        yield from _sequence(stream, first, second)
        return
    stream.seek(0)
    frame, vertices = _vertices(stream)

    def read() -> Iterator[Model | InvalidInput]:
        stream.seek(0)
        return _models(stream, frame, vertices)

    yield from models.records(read)


def build(record: Record, options: ReadOptions) -> Built:
    """Return the artifacts of one building, or of one feature of a sequence."""
    if record.data is None:
        return models.build(record, options)
    frame: Frame = record.payload
    feature = parse_json(record.data)
    found = list(_feature_models(feature, frame))
    parts = [models.build(Record(_or_house(model)), options) for model in found]
    notes = parts[0].notes.__class__()
    for part in parts:
        notes += part.notes
    return Built(tuple(artifact for part in parts for artifact in part.artifacts), notes)


def _or_house(model: Model | InvalidInput) -> models.House | InvalidInput:
    return model if isinstance(model, InvalidInput) else models.House(model)


# --- sequences ----------------------------------------------------------------------------------


def _is_document(line: bytes) -> bool:
    return line.lstrip().startswith(b"{") and line.rstrip().endswith(b"}")


def _sequence(stream: BinaryIO, header: bytes, line: bytes) -> Iterator[Record]:
    document = parse_json(header)
    frame = _frame(document.get("transform"), document.get("metadata"))
    number = 2
    while line:
        if line.strip():
            yield Record(frame, line=number, data=line)
        line = stream.readline(LONGEST_LINE)
        number += 1


def _feature_models(feature: Any, frame: Frame) -> Iterator[Model | InvalidInput]:
    if not isinstance(feature, dict) or feature.get("type") != "CityJSONFeature":
        raise InvalidInput("is no CityJSONFeature; expected one a line after the header")
    vertices = np.array(feature.get("vertices") or [], dtype=np.float64).reshape(-1, 3)
    objects = feature.get("CityObjects")
    if not isinstance(objects, dict):
        raise InvalidInput("expected an object", pointer="/CityObjects")
    return _grouped(iter(objects.items()), frame, vertices)


# --- documents ----------------------------------------------------------------------------------


def _vertices(stream: BinaryIO) -> tuple[Frame, Floats]:
    """Read transform, reference system and vertices; the vertices lie in a temporary file."""
    try:
        transform = next(ijson.items(stream, "transform", use_float=True), None)
        stream.seek(0)
        metadata = next(ijson.items(stream, "metadata", use_float=True), None)
        stream.seek(0)
        vertices = _stored(ijson.items(stream, "vertices.item", use_float=True))
    except ijson.JSONError as error:
        reason = str(error).split("\n")[0]
        raise InvalidInput(f"not valid JSON: {reason}") from None
    return _frame(transform, metadata), vertices


def _stored(rows: Iterator[Any]) -> Floats:
    with tempfile.TemporaryFile() as file:
        batch: list[Any] = []
        count = 0
        for row in rows:
            batch.append(row)
            if len(batch) == BATCH:
                file.write(_packed(batch).tobytes())
                count += len(batch)
                batch.clear()
        file.write(_packed(batch).tobytes())
        count += len(batch)
        if count > MOST_VERTICES:
            raise InvalidInput(f"{count} vertices; expected at most {MOST_VERTICES}")
        file.flush()
        if not count:
            return np.empty((0, 3))
        return np.asarray(np.memmap(file, dtype=np.float64, mode="r", shape=(count, 3)))


def _packed(batch: list[Any]) -> Floats:
    try:
        return np.array(batch, dtype=np.float64).reshape(-1, 3)
    except (TypeError, ValueError):
        raise InvalidInput("a vertex is not three numbers", pointer="/vertices") from None


def _frame(transform: Any, metadata: Any) -> Frame:
    crs = metadata.get("referenceSystem") if isinstance(metadata, dict) else ""
    name = named(str(crs or ""))
    if not isinstance(transform, dict):
        return Frame(crs=name)
    try:
        scale = tuple(float(value) for value in transform["scale"])
        translate = tuple(float(value) for value in transform["translate"])
    except (KeyError, TypeError, ValueError):
        raise InvalidInput("expected scale and translate", pointer="/transform") from None
    if len(scale) != 3 or len(translate) != 3:
        raise InvalidInput("expected three numbers each", pointer="/transform")
    return Frame(scale, translate, name)


def _models(stream: BinaryIO, frame: Frame, vertices: Floats) -> Iterator[Model | InvalidInput]:
    try:
        yield from _grouped(ijson.kvitems(stream, "CityObjects", use_float=True), frame, vertices)
    except ijson.JSONError as error:
        yield InvalidInput(f"not valid JSON: {str(error).split(chr(10))[0]}")


def _grouped(
    objects: Iterator[tuple[str, Any]], frame: Frame, vertices: Floats
) -> Iterator[Model | InvalidInput]:
    """Yield a model a root building as soon as all its children were read."""
    waiting: dict[str, dict[str, Any]] = {}  # root -> its objects so far
    root_of: dict[str, str] = {}
    orphans: dict[str, Any] = {}
    for name, item in objects:
        if not isinstance(item, dict):
            yield InvalidInput("expected an object", pointer=f"/CityObjects/{name}")
            continue
        if not str(item.get("type", "")).startswith("Building"):
            continue
        parents = item.get("parents") or []
        root = name if not parents else root_of.get(str(parents[0]))
        if root is None:
            orphans[name] = item
            continue
        done = _take(name, item, root, waiting, root_of, orphans)
        if done:
            members = waiting.pop(root)
            for member in members:
                root_of.pop(member, None)
            yield _model(root, members, frame, vertices)
    for root, members in waiting.items():
        yield _model(root, members, frame, vertices)


def _take(
    name: str,
    item: dict[str, Any],
    root: str,
    waiting: dict[str, dict[str, Any]],
    root_of: dict[str, str],
    orphans: dict[str, Any],
) -> bool:
    """Add an object and its known children to its root; tell whether the root is complete."""
    members = waiting.setdefault(root, {})
    members[name] = item
    root_of[name] = root
    for child in item.get("children") or []:
        root_of[str(child)] = root
        if child in orphans:
            _take(str(child), orphans.pop(child), root, waiting, root_of, orphans)
    wanted = {str(child) for member in members.values() for child in member.get("children") or []}
    return wanted <= members.keys() and root in members


def _model(
    root: str, members: Mapping[str, Any], frame: Frame, vertices: Floats
) -> Model | InvalidInput:
    try:
        return _checked_model(root, members, frame, vertices)
    except InvalidInput as error:
        return error
    except (TypeError, ValueError, LookupError, AttributeError, RecursionError) as error:
        text = f"broken geometry ({type(error).__name__}: {error})"
        return InvalidInput(text, pointer=f"/CityObjects/{root}")


def _checked_model(root: str, members: Mapping[str, Any], frame: Frame, vertices: Floats) -> Model:
    parts, codes, outside = [], [], []
    origin = np.round(_first_point(members, vertices) * np.array(frame.scale))
    for item in members.values():
        surfaces = tuple(_surfaces(item, frame, vertices, origin))
        if not surfaces:
            continue
        if item["type"] in ("Building", "BuildingPart"):
            parts.append(surfaces)
            codes.append(str((item.get("attributes") or {}).get("roofType", "")))
        else:
            outside.append(surfaces)
    said = members[root].get("attributes") or {}
    total = origin + np.array(frame.translate)
    artifact = said.get(ARTIFACT)
    return Model(
        id=root,
        parts=tuple(parts),
        origin=tuple(total.tolist()),
        crs=frame.crs,
        function=_text(said.get("function")),
        roof_types=tuple(codes),
        storeys=_count(said.get("storeysAboveGround")),
        outside=tuple(outside),
        artifact=artifact if isinstance(artifact, dict) else None,
    )


def _text(value: Any) -> str:
    return "" if value is None or isinstance(value, dict | list) else str(value)


def _count(value: Any) -> int | None:
    return value if isinstance(value, int) and 0 < value < 100 else None


def _first_point(members: Mapping[str, Any], vertices: Floats) -> Floats:
    for item in members.values():
        for geometry in item.get("geometry") or []:
            for polygon, _ in _polygons(geometry.get("boundaries") or [], None):
                return np.asarray(vertices[polygon[0][0]])
    return np.zeros(3)


def _surfaces(
    item: Mapping[str, Any], frame: Frame, vertices: Floats, origin: Floats
) -> Iterator[Surface]:
    geometry = _best(item.get("geometry") or [])
    if geometry is None:
        return
    semantics = geometry.get("semantics") or {}
    kinds = [str(surface.get("type")) for surface in semantics.get("surfaces") or []]
    boundaries = geometry["boundaries"]
    if geometry["type"] == "Solid":
        boundaries, values = boundaries[:1], (semantics.get("values") or [None])[:1]
    else:
        values = semantics.get("values")
    scale = np.array(frame.scale)
    for polygon, index in _polygons(boundaries, values):
        rings = tuple(
            points
            for corners in polygon
            if (points := ring(vertices[corners] * scale - origin)) is not None
        )
        if rings and len(polygon[0]) >= 3:
            kind = kinds[index] if isinstance(index, int) else ""
            yield Surface(_meaning(kind), rings, 0 if index is None else index + 1)


def _meaning(kind: str) -> Meaning:
    """Return what a surface means; ceilings and floors outside, closures: nothing of ours."""
    return MEANINGS.get(kind, "closure") if kind else "other"


def _best(geometries: list[Any]) -> Any:
    """Return the geometry of the highest level of detail that has surfaces."""
    kinds = ("Solid", "MultiSurface", "CompositeSurface", "MultiSolid", "CompositeSolid")
    usable = [g for g in geometries if g.get("type") in kinds and g.get("boundaries")]
    return max(usable, key=lambda g: float(g.get("lod", 0)), default=None)


def _polygons(boundary: Any, values: Any) -> Iterator[tuple[list[list[int]], int | None]]:
    """Yield polygons (lists of rings of vertex numbers) with the number of their semantics."""
    if boundary and boundary[0] and isinstance(boundary[0][0], int):
        yield boundary, values if isinstance(values, int) else None
        return
    for k, child in enumerate(boundary):
        inner = values[k] if isinstance(values, list) and k < len(values) else None
        yield from _polygons(child, inner)
