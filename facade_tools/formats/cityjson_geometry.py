"""What city objects of CityJSON look like: vertices on disk, semantic surfaces, templates."""

from __future__ import annotations

import tempfile
import weakref
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..geometry.arrays import Floats, Points3
from .city import ARTIFACT
from .crs import System
from .surfaces import Meaning, Model, Surface, ring

MEANINGS: dict[str, Meaning] = {
    "WallSurface": "wall",
    "RoofSurface": "roof",
    "GroundSurface": "ground",
    "Window": "window",
    "Door": "door",
}
BATCH = 1 << 13
MOST_VERTICES = 200_000_000
GAP = 4096  # vertices: of two runs nearer than this the ones between are read too
SOLIDS = ("Solid", "MultiSolid", "CompositeSolid")
GEOMETRIES = (*SOLIDS, "MultiSurface", "CompositeSurface")
PARTS = ("Building", "BuildingPart")
INSTALLATIONS = ("BuildingInstallation", "BuildingConstructiveElement")


class Vertices:
    """Vertices (n, 3) in a temporary file, or in memory where they are few."""

    def __init__(self, rows: Iterator[Any]) -> None:
        """Take all rows; raise InvalidInput for what is no vertex, and for too many."""
        self._file = tempfile.SpooledTemporaryFile(1 << 20)  # noqa: SIM115 (kept open)
        weakref.finalize(self, self._file.close)
        self.count = 0
        batch: list[Any] = []
        for row in rows:
            batch.append(row)
            if len(batch) == BATCH:
                self._write(batch)
                batch.clear()
        self._write(batch)

    def _write(self, batch: list[Any]) -> None:
        try:
            points = np.array(batch, dtype=np.float64).reshape(-1, 3)
        except (TypeError, ValueError):
            raise InvalidInput("a vertex is not three numbers", pointer="/vertices") from None
        self._file.write(points.tobytes())
        self.count += len(points)
        if self.count > MOST_VERTICES:
            raise InvalidInput(f"more than {MOST_VERTICES} vertices; split the file")

    def __getitem__(self, numbers: array[int]) -> Points3:
        """Return the vertices (k, 3) of these numbers; raises IndexError for others."""
        wanted, where = np.unique(np.asarray(numbers, dtype=np.int64), return_inverse=True)
        if not len(wanted):
            return np.empty((0, 3))
        if wanted[0] < 0 or wanted[-1] >= self.count:
            raise IndexError(f"vertex {wanted[0] if wanted[0] < 0 else wanted[-1]}")
        runs = np.split(wanted, np.flatnonzero(np.diff(wanted) > GAP) + 1)
        found = [self._run(int(run[0]), int(run[-1]) + 1)[run - run[0]] for run in runs]
        return np.concatenate(found)[where]

    def _run(self, start: int, stop: int) -> Points3:
        self._file.seek(24 * start)
        return np.frombuffer(self._file.read(24 * (stop - start))).reshape(-1, 3)


@dataclass(frozen=True)
class Header:
    """How numbers become coordinates; geometry templates and their vertices (n, 3), metres."""

    scale: Floats = field(default_factory=lambda: np.ones(3))
    translate: Floats = field(default_factory=lambda: np.zeros(3))
    system: System = field(default_factory=System)
    templates: Sequence[Any] = ()
    corners: Points3 = field(default_factory=lambda: np.empty((0, 3)))

    @classmethod
    def of(cls, transform: Any, metadata: Any, templates: Any) -> Header:
        """Return the header of a document; raises InvalidInput where it is broken."""
        crs = metadata.get("referenceSystem") if isinstance(metadata, dict) else ""
        system = System.of(str(crs or ""))
        scale, translate = _transform(transform)
        if not isinstance(templates, dict):
            return cls(scale, translate, system)
        try:
            corners = np.array(templates["vertices-templates"], dtype=np.float64).reshape(-1, 3)
            return cls(scale, translate, system, list(templates["templates"]), corners)
        except (KeyError, TypeError, ValueError):
            raise InvalidInput("expected templates", pointer="/geometry-templates") from None


def _transform(transform: Any) -> tuple[Floats, Floats]:
    if not isinstance(transform, dict):
        return np.ones(3), np.zeros(3)
    try:
        scale, translate = (
            np.array([float(value) for value in transform[name]]) for name in ("scale", "translate")
        )
    except (KeyError, TypeError, ValueError):
        raise InvalidInput("expected scale and translate", pointer="/transform") from None
    if len(scale) != 3 or len(translate) != 3:
        raise InvalidInput("expected three numbers each", pointer="/transform")
    return scale, translate


def model_of(root: str, members: Mapping[str, Any], header: Header, vertices: Vertices) -> Model:
    """Return the model of a building with its parts and installations.

    Raises InvalidInput, TypeError, ValueError, LookupError or AttributeError where it is broken.
    """
    gathered = _Gathered(header, vertices)
    parts, codes, outside = [], [], []
    for item in members.values():
        kind = kind_of(item)
        faces = list(_faces(item, header, gathered)) if kind in PARTS + INSTALLATIONS else []
        if faces and kind in PARTS:
            parts.append(faces)
            codes.append(str((item.get("attributes") or {}).get("roofType", "")))
        elif faces:
            outside.append(faces)
    points, origin, crs = header.system.local(gathered.points(), header.translate)
    said = members[root].get("attributes") or {}
    artifact = said.get(ARTIFACT)
    return Model(
        id=root,
        parts=tuple(_surfaces(faces, points) for faces in parts),
        origin=tuple(origin.tolist()),
        crs=crs,
        function=_text(said.get("function")),
        roof_types=tuple(codes),
        storeys=_count(said.get("storeysAboveGround")),
        outside=tuple(_surfaces(faces, points) for faces in outside),
        artifact=artifact if isinstance(artifact, dict) else None,
    )


def kind_of(item: Mapping[str, Any]) -> str:
    """Return the type of a city object; of an extension (`+…Building`) what it extends."""
    kind = str(item.get("type", ""))
    if kind.startswith("+"):
        return next((name for name in reversed(PARTS) if kind.endswith(name)), kind)
    return kind


def _text(value: Any) -> str:
    if isinstance(value, list) and value:  # several functions: the first
        value = value[0]
    return "" if value is None or isinstance(value, dict | list) else str(value)


def _count(value: Any) -> int | None:
    return value if isinstance(value, int) and 0 < value < 100 else None


# --- faces ----------------------------------------------------------------------------------------
Face = tuple[Meaning, list[slice], int]  # meaning, places of its rings' points, group


class _Gathered:
    """The corners of all faces of a model, read at once."""

    def __init__(self, header: Header, vertices: Vertices) -> None:
        self.header = header
        self.vertices = vertices
        self.numbers = array("q")
        self.instances: list[tuple[slice, Floats]] = []  # corners of templates, and their matrix

    def ring(self, corners: Any) -> slice:
        start = len(self.numbers)
        self.numbers.extend(corners)
        return slice(start, len(self.numbers))

    def points(self) -> Points3:
        """Return corners (n, 3) scaled, not yet translated."""
        numbers = self.numbers
        kept = array("q", numbers)
        for place, _ in self.instances:
            first = place.start  # the anchor stands before the corners of its template
            kept[first : place.stop] = array("q", [numbers[first]] * (place.stop - first))
        points = np.asarray(self.vertices[kept] * self.header.scale)
        for place, matrix in self.instances:
            corners = self.header.corners[np.array(numbers[place.start + 1 : place.stop])]
            points[place.start + 1 : place.stop] += corners @ matrix[:3, :3].T + matrix[:3, 3]
        return points


def _surfaces(faces: Sequence[Face], points: Points3) -> tuple[Surface, ...]:
    found = []
    for meaning, places, group in faces:
        rings = tuple(r for place in places if (r := ring(points[place])) is not None)
        if rings and places[0].stop - places[0].start >= 3:
            found.append(Surface(meaning, rings, group))
    return tuple(found)


def _faces(item: Mapping[str, Any], header: Header, gathered: _Gathered) -> Iterator[Face]:
    """Yield the faces of an object's geometry of the highest level of detail."""
    geometry = _best(item.get("geometry") or [], header)
    if geometry is None:
        return
    if geometry["type"] != "GeometryInstance":
        yield from _of_geometry(geometry, gathered)
        return
    start = gathered.ring(geometry["boundaries"][:1]).start
    yield from _of_geometry(header.templates[geometry["template"]], gathered)
    matrix = np.array(geometry["transformationMatrix"], dtype=np.float64).reshape(4, 4)
    gathered.instances.append((slice(start, len(gathered.numbers)), matrix))


def _of_geometry(geometry: Mapping[str, Any], gathered: _Gathered) -> Iterator[Face]:
    semantics = geometry.get("semantics") or {}
    kinds = [str(surface.get("type")) for surface in semantics.get("surfaces") or []]
    boundaries, values = _outer(geometry, semantics.get("values"))
    for polygon, index in _polygons(boundaries, values):
        kind = kinds[index] if isinstance(index, int) else ""
        group = 0 if index is None else index + 1
        yield _meaning(kind), [gathered.ring(corners) for corners in polygon], group


def _outer(geometry: Mapping[str, Any], values: Any) -> tuple[Any, Any]:
    """Return boundaries and semantics without the inner shells of solids."""
    boundaries, kind = geometry["boundaries"], geometry["type"]
    if kind == "Solid":
        nested = isinstance(values, list) and len(values) > 0 and isinstance(values[0], list)
        return boundaries[:1], values if nested else [values]
    if kind in SOLIDS:
        shells = [solid[:1] for solid in boundaries]
        return shells, values
    return boundaries, values


def _meaning(kind: str) -> Meaning:
    """Return what a surface means; ceilings and floors outside, closures: nothing of ours."""
    if kind.startswith("+"):
        return "other"
    return MEANINGS.get(kind, "closure") if kind else "other"


def _best(geometries: list[Any], header: Header) -> Any:
    """Return the geometry of the highest level of detail that has surfaces."""
    best, highest = None, -1.0
    for geometry in geometries:
        shape = geometry
        if geometry.get("type") == "GeometryInstance":
            shape = header.templates[geometry["template"]]
        level = _level(shape.get("lod"))
        if shape.get("type") in GEOMETRIES and shape.get("boundaries") and level > highest:
            best, highest = geometry, level
    return best


def _level(lod: Any) -> float:
    try:
        return float(lod or 0)
    except (TypeError, ValueError):
        return 0.0


def _polygons(boundary: Any, values: Any) -> Iterator[tuple[list[list[int]], int | None]]:
    """Yield polygons (lists of rings of vertex numbers) with the number of their semantics."""
    if boundary and boundary[0] and isinstance(boundary[0][0], int):
        yield boundary, values if isinstance(values, int) else None
        return
    for k, child in enumerate(boundary):
        inner = values[k] if isinstance(values, list) and k < len(values) else None
        yield from _polygons(child, inner)
