"""Openings cut into a solid's walls: each becomes a recess with reveals and a closing face."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from ..artifacts.building import Building
from .arrays import Floats, Points3
from .detail_boxes import LocalFrame, side_frame
from .pieces import named_elements, named_pieces
from .solids import Face, Label, Solid
from .triangulate import newell_normal

RECESS = 0.12  # how deep a window stands in its wall, metres
MARGIN = 0.02  # an opening keeps this distance from the wall's edges

log = logging.getLogger("facade_tools.geometry")


@dataclass(frozen=True, slots=True)
class Opening:
    """A rectangle (u0, v0, u1, v1, metres) in a wall's frame.

    wall: key of the wall that holds it. ring: its outline there (n, 2), counter-clockwise, which
    is the rectangle cut to what of it is wall.
    """

    name: str
    kind: str
    style: str
    frame: LocalFrame
    rectangle: tuple[float, float, float, float]
    wall: str = ""
    ring: tuple[tuple[float, float], ...] = ()


def openings_of(building: Building) -> list[Opening]:
    """Return all elements of a building's facades as openings, named like the scene's parts."""
    out = []
    for start, side, piece in named_pieces(building):
        frame = side_frame(side, piece.origin)
        for name, e in named_elements(start, piece):
            rectangle = (e.u, e.v, e.u + e.width, e.v + e.height)
            out.append(Opening(name, e.kind, e.style, frame, rectangle))
    return out


def pierced(solid: Solid, openings: Sequence[Opening]) -> tuple[Solid, list[Opening | None]]:
    """Return the solid with recessed openings, and for each face the opening that it closes.

    The recess is at most RECESS deep and shallower near a corner, so that two never meet. An
    opening keeps MARGIN from its wall's edges; where a lower roof covers a part of it, the rest
    remains; one of which less than a fifth remains is left out with a warning. Walls with
    openings are owned by `wall-<number>`, their reveals too.
    """
    walls = [index for index, label in enumerate(solid.labels) if label.semantic == "wall"]
    held: dict[int, list[tuple[Opening, float]]] = {}
    for opening in openings:
        found = max(_places(solid, walls, opening, held), key=_area, default=None)
        if found is None:
            log.warning("%s lies in no wall; left out of LoD3", opening.name)
        else:
            index, shape, depth = found
            ring = tuple((float(u), float(v)) for u, v in shape.exterior.coords[:-1])
            fitted = replace(opening, wall=f"wall-{index}", ring=ring)
            held.setdefault(index, []).append((fitted, depth))
    return _assembled(solid, held)


def _area(place: tuple[int, Polygon, float]) -> float:
    return float(place[1].area)


def _places(
    solid: Solid,
    walls: Sequence[int],
    opening: Opening,
    held: dict[int, list[tuple[Opening, float]]],
) -> Iterator[tuple[int, Polygon, float]]:
    """Yield the walls that can hold an opening, its shape there and how deep it may be."""
    whole = box(*opening.rectangle)
    for index in walls:
        outline = _outline(solid, index, opening.frame)
        if outline is None:
            continue
        free: BaseGeometry = outline.buffer(-MARGIN, join_style="mitre")
        for other, _ in held.get(index, ()):
            if _near(other, opening):
                free = free.difference(_in_frame(other, opening.frame).buffer(MARGIN / 2))
        shape = _simple(whole.intersection(free))
        if shape is not None and shape.area > 0.2 * whole.area:
            yield index, shape, min(RECESS, 0.7 * float(outline.boundary.distance(shape)))


def _simple(found: BaseGeometry) -> Polygon | None:
    """Return the largest polygon, counter-clockwise, without its holes and needless corners."""
    polygons = [part for part in getattr(found, "geoms", [found]) if isinstance(part, Polygon)]
    largest = max(polygons, key=lambda part: part.area, default=None)
    if largest is None or largest.is_empty:
        return None
    plain = Polygon(largest.exterior).simplify(1e-4)
    return orient(plain) if isinstance(plain, Polygon) else None


def _in_frame(other: Opening, frame: LocalFrame) -> Polygon:
    """Return the other opening's outline in a parallel frame of the same wall."""
    shift = ((other.frame.origin - frame.origin) @ frame.axes.T)[:2]
    return Polygon(np.array(other.ring) + shift)


def _near(other: Opening, opening: Opening) -> bool:
    """Whether two openings of one wall may touch: hundreds stand in a tower's wall."""
    shift = ((other.frame.origin - opening.frame.origin) @ opening.frame.axes.T)[:2]
    (u0, v0, u1, v1), (a0, b0, a1, b1) = opening.rectangle, other.rectangle
    du, dv = float(shift[0]), float(shift[1])
    across = min(u1, a1 + du) - max(u0, a0 + du)
    up = min(v1, b1 + dv) - max(v0, b0 + dv)
    return min(across, up) > -MARGIN


def _outline(solid: Solid, index: int, frame: LocalFrame) -> Polygon | None:
    """Return a wall face in a frame's (u, v), or None where it lies in another plane."""
    face = solid.faces[index]
    points = solid.vertices[list(face[0])]
    local = (points - frame.origin) @ frame.axes.T
    if np.abs(local[:, 2]).max() > 1e-5 or newell_normal(points) @ frame.axes[2] <= 0.0:
        return None
    holes = [((solid.vertices[list(r)] - frame.origin) @ frame.axes.T)[:, :2] for r in face[1:]]
    return Polygon(local[:, :2], holes)


def _assembled(
    solid: Solid, held: dict[int, list[tuple[Opening, float]]]
) -> tuple[Solid, list[Opening | None]]:
    points: list[Points3] = [solid.vertices]
    count = len(solid.vertices)
    faces: list[Face] = []
    labels: list[Label] = []
    closes: list[Opening | None] = []
    for index, (face, label) in enumerate(zip(solid.faces, solid.labels, strict=True)):
        rows = held.get(index, [])
        owner = f"wall-{index}" if rows else label.owner
        holes = []
        extra: list[tuple[Face, Opening | None]] = []
        for opening, depth in rows:
            size = len(opening.ring)
            outer = tuple(range(count, count + size))
            inner = tuple(range(count + size, count + 2 * size))
            points.append(_corners(opening, depth))
            count += 2 * size
            holes.append(outer[::-1])
            extra += [((quad,), None) for quad in _reveals(outer, inner)]
            extra.append(((inner,), opening))
        faces.append((*face, *holes))
        labels.append(Label(label.semantic, owner))
        closes.append(None)
        for added, closed in extra:
            faces.append(added)
            labels.append(Label("wall", owner))
            closes.append(closed)
    return Solid(np.concatenate(points), tuple(faces), tuple(labels)), closes


def _corners(opening: Opening, depth: float) -> Floats:
    ring = np.array(opening.ring)
    local = [np.column_stack([ring, np.full(len(ring), w)]) for w in (0.0, -depth)]
    # Openings in one line shall lie in one line to the last bit: triangulations depend on it.
    return np.round(opening.frame.world(np.concatenate(local)), 9)


def _reveals(outer: tuple[int, ...], inner: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    for k in range(len(outer)):
        j = (k + 1) % len(outer)
        yield outer[k], outer[j], inner[j], inner[k]
