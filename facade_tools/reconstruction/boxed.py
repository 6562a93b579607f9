"""From a derivation to a parametric building: boxes, pieces, elements."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.building import SIDES, Box, Building, Element, Facade, Piece, Side
from ..artifacts.building import Roof as BoxRoof
from ..errors import InvalidInput
from ..geometry.arrays import Floats
from ..geometry.checks import building_problems
from ..geometry.detail_boxes import side_frame
from ..geometry.pieces import facade_pieces
from ..geometry.polygons import shape_of
from ..geometry.rectilinear import partition
from .axes import on_axes
from .drawing import opening_of
from .engine import Derived, Leaf
from .volumes import Volume, standing

log = logging.getLogger("facade_tools.reconstruction")

EDGE = 0.02  # metres that an element keeps from its piece's border and from the next
LEAST = 0.25  # metres, a smaller element is left out
PLANE = 0.8  # metres off its wall at which an element still belongs to it
MOST_TRIES = 60  # elements that may be dropped to meet the rules of buildings
MOST_STOREYS = 1000
MOST_PIECES = 200_000
DORMER = 8.0  # m², a smaller volume on a roof is a dormer, no box


@dataclass(frozen=True, slots=True)
class Placed:
    """An element of a side: its kind and style, middle (3,) in the world, width, height (m)."""

    side: Side
    kind: str
    style: str
    middle: Floats
    width: float
    height: float
    known: bool = False


def derived_building(
    derived: Derived,
    identity: str,
    storey_height: float,
    known: Iterable[Side] = (),
    *,
    axes: bool = False,
) -> Building:
    """Return the building of a derivation; one without an entrance is partial.

    Oblique walls become stairs; dormers, balconies and what does not stand on the ground are left
    out. known: sides whose elements were observed. axes: whether windows come from a parse, and
    those nearly above one another stand on common axes. Raises InvalidInput where there is no
    volume.
    """
    volumes = standing(derived.volumes)
    boxes = tuple(_boxes(volumes))
    if not boxes:
        raise InvalidInput("no volume is wide and high enough for a box (0.6 m, 0.5 m)")
    storey = min(storey_height, round(1.99 * min(box.height or 0.0 for box in boxes), 4))
    _check_storeys(boxes, storey)
    bare = Building(identity, boxes, {}, storey)
    sides = frozenset(known)
    placed = [p for leaf in derived.leaves for p in _placed(leaf, sides)]
    facades = {
        side: Facade(tuple(on_axes(side, pieces) if axes else pieces))
        for side, pieces in _filled(bare, placed).items()
    }
    building = _sound(replace(bare, facades=facades))
    if any(element.main for element in _elements(building)):
        return building
    return replace(building, partial=True, complete=("mass", "garage", "porch", "roof"))


def _check_storeys(boxes: Sequence[Box], storey: float) -> None:
    """Raise InvalidInput where the pieces of the storeys would fill the memory."""
    heights = [box.height or 0.0 for box in boxes]
    if not max(heights) <= MOST_STOREYS * storey:
        message = f"{max(heights):g} m are more than {MOST_STOREYS} storeys of {storey:g} m"
        raise InvalidInput(message, pointer="/storey_height")
    pieces = round(sum(len(SIDES) * max(1.0, height / storey) for height in heights))
    if pieces > MOST_PIECES:
        message = f"{len(boxes)} boxes have some {pieces:,} pieces of wall; at most {MOST_PIECES:,}"
        raise InvalidInput(message, pointer="/storey_height")


# --- boxes ----------------------------------------------------------------------------------------
def _boxes(volumes: Sequence[Volume]) -> Iterator[Box]:
    roofs = [volume for volume in volumes if volume.style]
    eaves = min((roof.bottom for roof in roofs), default=np.inf)
    number = 0
    for volume in volumes:
        area = float(shape_of(volume.rings).area)
        dormer = volume.bottom >= eaves - 1e-6 and area < DORMER
        if volume.style or dormer or volume.top <= 0.5:
            continue
        roof = _roof(volume, roofs)
        for rectangle in partition([shape_of(volume.rings)]).rectangles[0].tolist():
            number += 1
            yield _box(f"general-{number}", rectangle, volume.top, roof)


def _box(name: str, rectangle: Sequence[float], top: float, roof: BoxRoof) -> Box:
    x0, y0, x1, y1 = (round(value, 6) for value in rectangle)
    x, y, w, d = (round(v, 6) for v in ((x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0))
    own = roof
    if roof.style == "gable" and roof.direction == "x" and w < d:
        own = replace(roof, direction="y")
    return Box(name, "general", x, y, w, d, round(top, 6), own)


def _roof(volume: Volume, roofs: Sequence[Volume]) -> BoxRoof:
    """Return the roof that lies on a prism, as a building has it."""
    shape = shape_of(volume.rings)
    for roof in roofs:
        over = shape_of(roof.rings).intersection(shape).area > 0.5 * shape.area
        if over and abs(roof.bottom - volume.top) < 1e-3:
            slopes = [float(np.hypot(*patch.plane[:2])) for patch in roof.patches]
            rising = [slope for slope in slopes if slope > 1e-3] or [0.0]
            slope = min(rising) if roof.style == "mansard" else max(rising)
            if slope == 0.0:
                return BoxRoof("flat")
            return BoxRoof(roof.style, round(float(np.degrees(np.arctan(slope))), 4))  # type: ignore[arg-type]
    return BoxRoof("flat")


# --- elements -------------------------------------------------------------------------------------
def _placed(leaf: Leaf, known: frozenset[Side]) -> Iterator[Placed]:
    """Yield the element that a leaf is."""
    opening = opening_of(leaf)
    if opening is None:
        return
    out = opening.frame.axes[2]
    side: Side = ("front" if out[1] < 0 else "back") if abs(out[1]) > abs(out[0]) else (
        "right" if out[0] > 0 else "left"
    )  # fmt: skip
    width, height = opening.rectangle[2:]
    middle = opening.frame.world(np.array([[width / 2, height / 2, 0.0]]))[0]
    style = opening.style or {"window": "casement", "door": "panel"}.get(opening.kind, "sectional")
    yield Placed(side, opening.kind, style, middle, width, height, side in known)


def _filled(bare: Building, placed: Sequence[Placed]) -> dict[Side, list[Piece]]:
    """Return the pieces of all sides with the elements that lie in them."""
    out: dict[Side, list[Piece]] = {}
    entrance = True
    for side, pieces in facade_pieces(bare).items():
        held: list[list[Element]] = [[] for _ in pieces]
        for item in sorted((p for p in placed if p.side == side), key=_order):
            where = _piece_of(side, pieces, item)
            element = None if where is None else _fitted(side, pieces[where], item)
            if where is None or element is None or _hits(held[where], element):
                log.info("%s: a %s of %.2f × %.2f m finds no wall of its own",
                         side, item.kind, item.width, item.height)  # fmt: skip
                continue
            ground = pieces[where].origin[2] < 1e-6 and element.v < 0.3
            if entrance and side == "front" and element.kind == "door" and ground:
                element, entrance = replace(element, main=True), False
            held[where].append(element)
        out[side] = [replace(p, elements=tuple(rows)) for p, rows in zip(pieces, held, strict=True)]
    return out


def _order(item: Placed) -> tuple[bool, float, float, float]:
    """Doors first, then from the ground upwards."""
    x, y, z = (round(float(v), 6) for v in item.middle)
    return item.kind == "window", z, x, y


def _piece_of(side: Side, pieces: Sequence[Piece], item: Placed) -> int | None:
    """Return the piece that an element's middle lies in, or is nearest to along its wall."""
    best, least = None, np.inf
    for number, piece in enumerate(pieces):
        frame = side_frame(side, piece.origin)
        u, v, w = (item.middle - frame.origin) @ frame.axes.T
        inside = -1e-6 <= u <= piece.width + 1e-6 and -1e-6 <= v <= piece.height + 1e-6
        if inside and abs(w) < min(least, PLANE):
            best, least = number, abs(w)
    return best


def _fitted(side: Side, piece: Piece, item: Placed) -> Element | None:
    """Return an element inside its piece: moved up or down first, then cut; None if too small."""
    frame = side_frame(side, piece.origin)
    u, v, _ = (item.middle - frame.origin) @ frame.axes.T
    width, height = min(item.width, piece.width - 2 * EDGE), min(item.height, piece.height - EDGE)
    if min(width, height) < LEAST:
        return None
    low = max(0.0 if item.kind != "window" else EDGE, v - height / 2)
    low = min(low, piece.height - height)
    if item.kind != "window" and low < 0.3:
        height, low = height + low, 0.0
    left = min(max(u - width / 2, EDGE), piece.width - width - EDGE)
    u0, v0, w, h = (round(float(value), 6) for value in (left, low, width, height))
    return Element(item.kind, item.style, u0, v0, w, h, known=item.known)  # type: ignore[arg-type]


def _hits(others: Sequence[Element], element: Element) -> bool:
    return any(
        min(o.u + o.width, element.u + element.width) - max(o.u, element.u) > 1e-4
        and min(o.v + o.height, element.v + element.height) - max(o.v, element.v) > 1e-4
        for o in others
    )


# --- rules ----------------------------------------------------------------------------------------
def _sound(building: Building) -> Building:
    """Return the building without the elements that break a rule (behind a lower roof, ...)."""
    for _ in range(MOST_TRIES):
        bad = {
            problem.pointer for problem in building_problems(building)
            if "/elements/" in problem.pointer
        }  # fmt: skip
        if not bad:
            break
        building = replace(building, facades=dict(_without(building, bad)))
    return building


def _without(building: Building, bad: set[str]) -> Iterator[tuple[Side, Facade]]:
    for side in SIDES:
        if side not in building.facades:
            continue
        pieces = []
        for j, piece in enumerate(building.facades[side].pieces):
            prefix = f"/facades/{side}/pieces/{j}/elements/"
            kept = tuple(e for k, e in enumerate(piece.elements) if f"{prefix}{k}" not in bad)
            pieces.append(replace(piece, elements=kept))
        yield side, Facade(tuple(pieces))


def _elements(building: Building) -> Iterator[Element]:
    for facade in building.facades.values():
        for piece in facade.pieces:
            yield from piece.elements
