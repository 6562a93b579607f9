"""IFC building models, through the optional ifcopenshell, to building models."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from typing import Any, BinaryIO

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..errors import InvalidInput
from ..geometry.arrays import Floats, Points3, Triangles
from ..geometry.rectilinear import areas
from . import models
from .reading import BY_NAME, Built, ReadOptions, Record, read_whole
from .surfaces import Meaning, Model, Surface

WALLS = ("IfcWall", "IfcCurtainWall")
ROOFS = ("IfcRoof", "IfcSlab")
OPENINGS: tuple[tuple[str, Meaning], ...] = (("IfcWindow", "window"), ("IfcDoor", "door"))
CLOSING = 0.6  # metres: gaps of the plan of the walls that are closed (doors, thick joints)
LEAST_STEP = 0.3  # metres a roof's surface rises over the walls' middle to count as roof
UPWARD = 0.17  # z of a unit normal above which a triangle is seen from above (80° steep)
OUTER = 0.45  # metres from the outline: an opening nearer to it is in an outer wall
MOST_TRIANGLES = 2_000_000


def detect(head: bytes) -> bool:
    """Tell a STEP file with an IFC schema."""
    return head.lstrip().startswith(b"ISO-10303-21") and b"IFC" in head


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a building of the model.

    Raises InvalidInput unless there is one.
    """
    opened = _opened(read_whole(stream))
    buildings = opened.by_type("IfcBuilding")
    if len(buildings) != 1:
        raise InvalidInput(f"{len(buildings)} buildings; expected one IfcBuilding a file")
    yield Record(models.House(_model(opened)), pointer="/IfcBuilding")


def build(record: Record, options: ReadOptions) -> Built:
    """Return the artifacts of one building."""
    return models.build(record, options)


def _opened(data: bytes) -> Any:
    try:
        import ifcopenshell
    except ImportError:
        message = "an IFC file; reading it needs: pip install 'facade-tools[ifc]'"
        raise InvalidInput(message) from None
    with tempfile.NamedTemporaryFile(suffix=".ifc") as file:
        file.write(data)
        file.flush()
        try:
            return ifcopenshell.open(file.name)
        except (OSError, RuntimeError, ifcopenshell.Error) as error:
            raise InvalidInput(f"not a readable IFC file: {error}") from None


def _model(opened: Any) -> Model:
    walls = _triangles(opened, WALLS)
    if not walls:
        raise InvalidInput("has no walls with geometry; expected a building")
    outline = _outline(walls)
    roofs = _roof_surfaces(_triangles(opened, ROOFS), _eaves(walls))
    ground = float(min(points[:, 2].min() for points, _ in _on_ground(walls, opened)))
    surfaces = [*roofs, *_ground_surfaces(outline, ground)]
    for group, (points, meaning) in enumerate(_openings(opened), start=1):
        rectangle = _rectangle(points, outline)
        if rectangle is not None:
            surfaces.append(Surface(meaning, (rectangle,), group))
    if not roofs:
        surfaces += [Surface("roof", s.rings) for s in _ground_surfaces(outline, _eaves(walls))]
    return Model(id=BY_NAME, parts=(tuple(surfaces),), origin=(0.0, 0.0, 0.0))


Shape = tuple[Points3, Triangles]


def _triangles(opened: Any, kinds: tuple[str, ...]) -> list[Shape]:
    """Return vertices (metres) and triangles of all elements of some kinds."""
    import ifcopenshell.geom

    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    found: list[Shape] = []
    total = 0
    for element in _with_bodies(e for kind in kinds for e in opened.by_type(kind)):
        try:
            geometry = ifcopenshell.geom.create_shape(settings, element).geometry
        except RuntimeError:  # ifcopenshell's word for an element whose geometry it cannot make
            continue
        points = np.array(geometry.verts, dtype=np.float64).reshape(-1, 3)
        faces = np.array(geometry.faces, dtype=np.int64).reshape(-1, 3)
        total += len(faces)
        if total > MOST_TRIANGLES:
            raise InvalidInput(f"more than {MOST_TRIANGLES} triangles; expected a house")
        if len(faces):
            found.append((points, faces))
    return found


def _with_bodies(elements: Iterable[Any]) -> Iterator[Any]:
    """Yield the elements that have geometry: themselves, or else the parts they consist of."""
    seen: set[int] = set()
    for element in elements:
        parts = [p for relation in element.IsDecomposedBy for p in relation.RelatedObjects]
        found = [element] if element.Representation is not None else _with_bodies(parts)
        for body in found:
            if body.id() not in seen:
                seen.add(body.id())
                yield body


def _outline(walls: list[Shape]) -> BaseGeometry:
    """Return the plan inside the outer walls: all walls from above, gaps closed, rooms filled."""
    corners = np.concatenate([points[faces][:, :, :2] for points, faces in walls])
    union = shapely.union_all(np.array(shapely.polygons(corners)), grid_size=1e-4)
    closed = areas(union.buffer(CLOSING, join_style="mitre"))
    filled = shapely.union_all(
        [shapely.Polygon(part.exterior) for part in shapely.get_parts(closed)]
    )
    plan = areas(filled.buffer(-CLOSING, join_style="mitre"))
    largest = max(shapely.get_parts(plan), key=lambda part: part.area, default=shapely.Polygon())
    return largest.simplify(0.05)


def _eaves(walls: list[Shape]) -> float:
    return float(np.median([points[:, 2].max() for points, _ in walls]))


def _on_ground(walls: list[Shape], opened: Any) -> list[Shape]:
    """Return the walls that stand on the ground floor or above: not the foundation's."""
    entry = [float(points[:, 2].min()) for points, _ in _triangles(opened, ("IfcDoor",))]
    if not entry:
        return walls
    lowest = min(entry) - 0.5
    above = [wall for wall in walls if wall[0][:, 2].min() >= lowest]
    return above or walls


def _roof_surfaces(shapes: list[Shape], eaves: float) -> list[Surface]:
    """Return upward triangles that lie about as high as the walls end, or higher."""
    found = []
    for points, faces in shapes:
        for corners in points[faces]:
            surface = Surface("roof", (corners,))
            if surface.normal[2] > UPWARD and corners[:, 2].mean() > eaves - LEAST_STEP:
                found.append(surface)
    return found


def _ground_surfaces(outline: BaseGeometry, height: float) -> list[Surface]:
    rings = [
        np.column_stack([points, np.full(len(points), height)])
        for ring in shapely.get_rings(shapely.orient_polygons(outline))
        if len(points := shapely.get_coordinates(ring)[:-1]) >= 3
    ]
    return [Surface("ground", tuple(rings))] if rings else []


def _openings(opened: Any) -> Iterator[tuple[Points3, Meaning]]:
    for kind, meaning in OPENINGS:
        for points, _ in _triangles(opened, (kind,)):
            yield points, meaning


def _rectangle(points: Points3, outline: BaseGeometry) -> Points3 | None:
    """Return the upright rectangle of an opening in an outer wall, facing out; None inside."""
    low, high = points[:, 2].min(), points[:, 2].max()
    hull = shapely.MultiPoint(points[:, :2]).minimum_rotated_rectangle
    if hull.geom_type != "Polygon" or outline.boundary.distance(hull) > OUTER:
        return None
    corners = shapely.get_coordinates(hull)
    edges = [(corners[k], corners[k + 1]) for k in range(4)]
    longest = sorted(edges, key=lambda edge: -float(np.linalg.norm(edge[1] - edge[0])))[:2]
    start, stop = min(longest, key=lambda edge: _inside(edge, outline))
    ring = np.array([[*start, low], [*stop, low], [*stop, high], [*start, high]])
    normal = np.cross(ring[1] - ring[0], ring[3] - ring[0])
    outward = (start + stop) / 2.0 - corners[:4].mean(axis=0)
    return ring if float(normal[:2] @ outward) >= 0.0 else ring[::-1].copy()


def _inside(edge: tuple[Floats, Floats], outline: BaseGeometry) -> float:
    """Return how deep the middle of an edge lies inside the outline, metres."""
    middle = shapely.Point((edge[0] + edge[1]) / 2.0)
    depth = outline.boundary.distance(middle)
    return float(depth if outline.contains(middle) else -depth)
