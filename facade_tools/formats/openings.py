"""Windows and doors of a city model, laid onto the facade pieces of its boxes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from shapely import Point
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Building, Element, ElementKind, Facade, Piece, Side
from ..geometry.arrays import Floats, Points3
from ..geometry.floors import storeys
from ..geometry.pieces import facade_pieces
from .surfaces import Surface

LEAST = 0.2  # metres: a part of an opening smaller than this is dropped
DEEPEST = 2.0  # metres between an opening and the wall that takes it
STOREYS = np.round(np.arange(2.4, 4.61, 0.05), 2)  # metres: heights that a storey may have
USUAL_STOREY = 3.0
CROSSING = 0.12  # metres of an opening on both sides of a storey line: it crosses


@dataclass(frozen=True)
class Opening:
    """A window or door in the building's frame: its side and its rectangle on that side.

    u runs to the right as seen from outside, v is the height above the ground; plane is the
    coordinate across the wall. Metres.
    """

    kind: ElementKind
    side: Side
    rectangle: tuple[float, float, float, float]
    plane: float

    @property
    def area(self) -> float:
        """Area of the rectangle, m²."""
        u0, v0, u1, v1 = self.rectangle
        return (u1 - u0) * (v1 - v0)


def opening_of(
    kind: ElementKind, polygons: Sequence[Surface], footprint: BaseGeometry
) -> Opening | None:
    """Return the opening made of `polygons` (panes, frames); None where it lies in a roof."""
    normal = _outward(polygons, footprint)
    if abs(float(normal[2])) > 0.5:
        return None
    side = side_of(normal)
    points = np.concatenate([ring for polygon in polygons for ring in polygon.rings])
    u, v, plane = wall_frame(points, side)
    rectangle = (float(u.min()), float(v.min()), float(u.max()), float(v.max()))
    return Opening(kind, side, rectangle, float(np.median(plane)))


def _outward(polygons: Sequence[Surface], footprint: BaseGeometry) -> Floats:
    """Return the unit normal that points away from the building."""
    total: Floats = np.sum([polygon.vector_area for polygon in polygons], axis=0)
    if np.linalg.norm(total) < 0.3 * sum(polygon.area for polygon in polygons):
        total = max(polygons, key=lambda polygon: polygon.area).vector_area
    normal: Floats = total / max(float(np.linalg.norm(total)), 1e-12)
    middle = np.concatenate([polygon.rings[0] for polygon in polygons]).mean(axis=0)
    ahead, behind = (Point((middle + step * normal)[:2]) for step in (0.8, -0.8))
    wrong = footprint.contains(ahead) and not footprint.contains(behind)
    return -normal if wrong else normal


def side_of(normal: Floats) -> Side:
    """Return the side that faces most along a normal (FW16's axes: the front faces −y)."""
    if abs(normal[0]) > abs(normal[1]):
        return "right" if normal[0] > 0.0 else "left"
    return "back" if normal[1] > 0.0 else "front"


def wall_frame(points: Points3, side: Side) -> tuple[Floats, Floats, Floats]:
    """Return u (to the right from outside), v (up) and the position across the wall of points."""
    x, y, z = points.T
    u = {"front": x, "right": y, "back": -x, "left": -y}[side]
    return u, z, y if side in ("front", "back") else x


def storey_height(openings: Sequence[Opening], eaves: float, count: int | None) -> float:
    """Return the storey height (m) whose lines cross the fewest openings.

    count: the number of storeys that the source states, else None. Without openings it is the
    eaves' height over that number where this is plausible, else 3 m; of equal heights the one
    nearest to that wins.
    """
    stated = eaves / count if count else USUAL_STOREY
    usual = stated if STOREYS[0] <= stated <= STOREYS[-1] else USUAL_STOREY
    if not openings:
        return round(usual, 4)
    spans = np.array([opening.rectangle[1::2] for opening in openings])
    costs = [_crossings(spans, float(s), eaves) + 0.01 * abs(s - usual) for s in STOREYS]
    return float(STOREYS[int(np.argmin(costs))])


def _crossings(spans: Floats, storey: float, eaves: float) -> int:
    lines = storey * np.arange(1, max(storeys(eaves, storey), 1))
    below, above = lines - spans[:, :1], spans[:, 1:] - lines
    return int(((below > CROSSING) & (above > CROSSING)).sum())


def placed(
    building: Building, openings: Iterable[Opening], notes: Counter[str]
) -> dict[Side, Facade]:
    """Return the facades of the sides that have openings, each opening cut to its pieces.

    An opening goes to the pieces of its side that it overlaps, in the plane nearest to its own;
    one that crosses a storey line is cut there. What is outside all pieces is dropped; of two that
    overlap the later, smaller one gives way. All rules are counted.
    """
    pieces = facade_pieces(building)
    kept: dict[str, list[Element]] = {}
    observed: set[Side] = set()
    for opening in sorted(openings, key=lambda item: (-item.area, item.rectangle)):
        cuts = list(_cuts(opening, pieces[opening.side]))
        if not cuts:
            notes[f"{opening.kind} on no wall of the boxes: left out"] += 1
            continue
        if len(cuts) > 1:
            notes["opening across a storey line or a corner: cut there"] += 1
        observed.add(opening.side)
        for piece, element in cuts:
            _add(kept.setdefault(piece.id, []), element, notes)
    return {
        side: Facade(tuple(_with(piece, kept.get(piece.id, [])) for piece in pieces[side]))
        for side in pieces
        if side in observed
    }


def _with(piece: Piece, elements: list[Element]) -> Piece:
    return replace(piece, elements=tuple(sorted(elements, key=lambda e: (e.v, e.u))))


def _cuts(opening: Opening, pieces: Sequence[Piece]) -> list[tuple[Piece, Element]]:
    """Return the parts of an opening on the wall nearest to it."""
    rows = []
    for piece in pieces:
        left, plane = _place(piece, opening.side)
        distance = abs(plane - opening.plane)
        element = _cut(opening, piece, left)
        if element is not None and distance <= DEEPEST:
            rows.append((round(distance, 2), piece, element))
    if not rows:
        return []
    nearest = min(distance for distance, _, _ in rows)
    return [(piece, element) for distance, piece, element in rows if distance <= nearest + 0.3]


def _place(piece: Piece, side: Side) -> tuple[float, float]:
    u, _, plane = wall_frame(np.array([piece.origin]), side)
    return float(u[0]), float(plane[0])


def _cut(opening: Opening, piece: Piece, left: float) -> Element | None:
    u0, v0, u1, v1 = opening.rectangle
    bottom = piece.origin[2]
    low_u, high_u = max(u0 - left, 0.0), min(u1 - left, piece.width)
    low_v, high_v = max(v0 - bottom, 0.0), min(v1 - bottom, piece.height)
    whole = u1 - u0 <= 2.0 * LEAST or v1 - v0 <= 2.0 * LEAST
    least = 0.05 if whole else LEAST
    if high_u - low_u < least or high_v - low_v < least:
        return None
    size = round(high_u - low_u, 6), round(high_v - low_v, 6)
    return Element(opening.kind, "unknown", round(low_u, 6), round(low_v, 6), *size, known=True)


def _add(elements: list[Element], fresh: Element, notes: Counter[str]) -> None:
    """Add an element, cut back or dropped where it overlaps the larger ones before it."""
    for other in elements:
        cut = _beside(fresh, other)
        if cut is None:
            notes["opening overlaps a larger one: left out"] += 1
            return
        fresh = cut
    elements.append(fresh)


def _beside(fresh: Element, other: Element) -> Element | None:
    """Return the largest part of `fresh` beside `other`; None where too little is left."""
    u0, v0, u1, v1 = fresh.u, fresh.v, fresh.u + fresh.width, fresh.v + fresh.height
    a0, b0, a1, b1 = other.u, other.v, other.u + other.width, other.v + other.height
    if min(u1, a1) - max(u0, a0) <= 1e-6 or min(v1, b1) - max(v0, b0) <= 1e-6:
        return fresh
    parts = [(u0, v0, a0, v1), (a1, v0, u1, v1), (u0, v0, u1, b0), (u0, b1, u1, v1)]
    best = max(parts, key=lambda p: max(p[2] - p[0], 0.0) * max(p[3] - p[1], 0.0))
    width, height = round(best[2] - best[0], 6), round(best[3] - best[1], 6)
    if width < LEAST or height < LEAST or width * height < 0.5 * fresh.width * fresh.height:
        return None
    return replace(fresh, u=best[0], v=best[1], width=width, height=height)
