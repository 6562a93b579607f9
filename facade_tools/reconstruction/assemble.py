"""Parses of a building's sides, a footprint and a hint from above: one building.

What no picture shows stays open: the building is partial, its unseen sides are absent.
"""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.building import (
    SIDES,
    Box,
    Building,
    Element,
    ElementKind,
    Facade,
    MassPart,
    Piece,
    Roof,
    Side,
)
from ..errors import InvalidInput
from ..geometry.boxes import box_rectangles
from ..geometry.floors import mass_boxes
from ..geometry.pieces import facade_pieces
from .axes import meets, on_axes
from .doors import USUAL, door_head
from .sides import SideView

log = logging.getLogger("facade_tools.reconstruction")

STOREY = 3.0  # m: a storey where nothing says how high it is
STOREYS = (2.2, 6.0)  # m: storeys that a given height may have
LEAST_DEPTH = 4.0  # m: of a building of which one side only is seen
LEAST_OPENING = 0.25  # m: smaller ones are left out
MARGIN = 0.02  # m between an opening and its piece's borders


@dataclass(frozen=True, slots=True)
class Assembly:
    """What is known beside the pictures.

    mass: boxes from a footprint or a building; None: a rectangle as wide as the pictures show.
    storey: height of a storey (m). roof: of all boxes. style: of windows. door: put a main door
    into the front where none is seen. depth: of that rectangle, from the seen side to the unseen
    one (m); where it is said, the mass is known. porch: there may be porches, of which pictures
    do not tell.
    """

    mass: Building | None = None
    storey: float | None = None
    roof: Roof | None = None
    style: str = "unknown"
    door: bool = True
    depth: float | None = None
    porch: bool = True


def assemble(identity: str, views: Mapping[Side, SideView], known: Assembly) -> Building:
    """Return the building that the views show. Raises InvalidInput where there is no view.

    All storeys get one height, in which every picture's storeys are fitted one by one from the
    ground; the eaves are those that most pictures show, in case of a draw the front's.
    """
    if not views:
        raise InvalidInput("no side is seen; expected at least one picture")
    storey = _storey_height(views, known)
    count = _storey_count(views)
    mass = _mass(identity, views, known, storey, count)
    pieces = facade_pieces(mass)
    facades = {
        side: Facade(tuple(on_axes(side, _filled(mass, side, pieces[side], views[side], known))))
        for side in SIDES
        if side in views
    }
    if known.door and "front" in facades:
        facades["front"] = _with_door(facades["front"], mass.storey_height)
    tags = {**mass.tags, "assembled": {side: view.storeys for side, view in views.items()}}
    complete = mass.complete if known.porch else _ordered({*mass.complete, "porch"})
    return replace(mass, id=identity, facades=facades, complete=complete, tags=tags)


def _storey_height(views: Mapping[Side, SideView], known: Assembly) -> float:
    """Return the height of a storey, metres: given, or as the scaled pictures show it."""
    if known.storey is not None:
        return known.storey
    shown = [view.storey * view.scale for view in views.values() if view.scale is not None]
    return round(float(np.median(shown)), 3) if shown else STOREY


def _storey_count(views: Mapping[Side, SideView]) -> int:
    """Return how many storeys most views show; of a draw the front's, else the greatest."""
    counts = [view.storeys for view in views.values()]
    most = max(counts.count(value) for value in counts)
    drawn = {value for value in counts if counts.count(value) == most}
    front = views["front"].storeys if "front" in views else None
    return front if front in drawn and front is not None else max(drawn)


def _mass(
    identity: str, views: Mapping[Side, SideView], known: Assembly, storey: float, count: int
) -> Building:
    if known.mass is not None:
        return _fitted(known, storey, count)
    sizes = [
        [_width(views[side], storey) for side in pair if side in views]
        for pair in (("front", "back"), ("left", "right"))
    ]
    unseen = LEAST_DEPTH if known.depth is None else known.depth
    width, depth = (round(sum(s) / len(s), 3) if s else unseen for s in sizes)
    height = round(count * storey, 3)
    box = Box("main", "general", width / 2, depth / 2, width, depth, height, known.roof)
    seen = known.depth is not None or all(map(bool, sizes))
    complete = _complete(views, seen=seen, roof=known.roof is not None)
    return Building(identity, (box,), storey_height=storey, partial=True, complete=complete)


def _width(view: SideView, storey: float) -> float:
    scale = view.scale if view.scale is not None else storey / view.storey
    return (view.x1 - view.x0) * scale


def _complete(views: Mapping[Side, SideView], *, seen: bool, roof: bool) -> tuple[MassPart, ...]:
    parts: list[MassPart] = ["mass"] if seen else []
    parts += ["garage"] if seen and len(views) == len(SIDES) else []
    parts += ["roof"] if roof else []
    return tuple(parts)


def _fitted(known: Assembly, storey: float, count: int) -> Building:
    """Return the given mass with its heights and storeys reconciled with what is seen.

    A given height stays: its storeys get what makes the seen number fill it, where that is
    possible. Boxes of no height get the seen number of storeys.
    """
    mass = known.mass
    assert mass is not None
    heights = [box.height for box in mass.boxes if box.kind != "porch" and box.height]
    if heights and known.storey is None:
        share = max(heights) / count
        storey = share if STOREYS[0] <= share <= STOREYS[1] else storey
    lowest = min(heights, default=storey)
    storey = min(round(storey, 6), round(1.99 * lowest, 6))
    boxes = tuple(_completed(box, round(count * storey, 3), known.roof) for box in mass.boxes)
    roofs = all(box.roof is not None for box in boxes)
    complete = _ordered({"mass", *mass.complete} | ({"roof"} if roofs else set()))
    return replace(mass, boxes=boxes, storey_height=storey, partial=True, complete=complete)


def _ordered(parts: Collection[str]) -> tuple[MassPart, ...]:
    order: tuple[MassPart, ...] = ("mass", "garage", "porch", "roof")
    return tuple(part for part in order if part in parts)


def _completed(box: Box, height: float, roof: Roof | None) -> Box:
    if box.kind == "porch":
        return box
    return replace(box, height=box.height or height, roof=roof or box.roof)


# --- openings -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Opening:
    """An opening in the frame of its side: from the left end as seen from outside, metres."""

    kind: ElementKind
    storey: int
    left: float
    right: float
    low: float
    high: float


def _filled(
    mass: Building, side: Side, pieces: tuple[Piece, ...], view: SideView, known: Assembly
) -> tuple[Piece, ...]:
    """Return the pieces of a side with the openings of its picture."""
    low, high = _extent(mass, side)
    own: dict[str, list[Element]] = {piece.id: [] for piece in pieces}
    dropped = 0
    for opening in _openings(view, high - low, mass.storey_height):
        piece = _home(pieces, side, opening, (low, high), mass.storey_height)
        element = None
        if piece is not None:
            element = _placed(piece, side, opening, (low, high), known.style)
        if piece is None or element is None or meets(element, own[piece.id]):
            dropped += 1
        else:
            own[piece.id].append(element)
    if dropped:
        log.info("%s: %d openings have no wall and are left out", side, dropped)
    return tuple(replace(piece, elements=tuple(own[piece.id])) for piece in pieces)


def _extent(mass: Building, side: Side) -> tuple[float, float]:
    """Return where a side begins and ends along its axis, metres in plan."""
    rectangles = box_rectangles(mass_boxes(mass))
    axis = 0 if side in ("front", "back") else 1
    return float(rectangles[:, axis].min()), float(rectangles[:, axis + 2].max())


def _openings(view: SideView, width: float, storey: float) -> list[_Opening]:
    """Return the openings of a view, large ones first, in storeys of one height."""
    across = width / (view.x1 - view.x0)
    out = []
    kinds: tuple[tuple[ElementKind, np.ndarray], ...] = (
        ("door", view.doors), ("window", view.windows),
    )  # fmt: skip
    for kind, boxes in kinds:
        for x0, y0, x1, y1 in boxes.tolist():
            floor = _floor_of(view, (y0 + y1) / 2)
            if kind == "door" and floor > 0:
                continue
            ground, ceiling = view.lines[floor], view.lines[floor + 1]
            low, high = ((ground - y) / (ground - ceiling) * storey for y in (y1, y0))
            place = ((x0 - view.x0) * across, (x1 - view.x0) * across)
            if kind == "door":
                head = door_head(place[1] - place[0], high, storey)
                if head is None:
                    continue
                high = head
            out.append(_Opening(kind, floor, *place, max(low, 0.0), min(high, storey)))
    return sorted(out, key=lambda o: (o.kind, -(o.right - o.left) * (o.high - o.low)))


def _floor_of(view: SideView, y: float) -> int:
    inner = np.array(view.lines[1:-1])
    return int((inner > y).sum())


def _home(
    pieces: tuple[Piece, ...],
    side: Side,
    opening: _Opening,
    extent: tuple[float, float],
    storey: float,
) -> Piece | None:
    """Return the piece of the opening's storey that shows most of it, the foremost of equals."""
    best, most = None, LEAST_OPENING
    for piece in sorted(pieces, key=lambda p: _depth(p, side)):
        if abs(piece.origin[2] - opening.storey * storey) > 0.5 * storey:
            continue
        start = _start(piece, side, extent)
        shown = min(opening.right, start + piece.width) - max(opening.left, start)
        if shown > most + 1e-9:
            best, most = piece, shown
    return best


def _depth(piece: Piece, side: Side) -> float:
    """Return how far behind the others a piece stands, seen from outside."""
    across = piece.origin[1] if side in ("front", "back") else piece.origin[0]
    return across if side in ("front", "left") else -across


def _start(piece: Piece, side: Side, extent: tuple[float, float]) -> float:
    """Return where a piece begins in the frame of its side, metres."""
    along = piece.origin[0] if side in ("front", "back") else piece.origin[1]
    return along - extent[0] if side in ("front", "right") else extent[1] - along


def _placed(
    piece: Piece, side: Side, opening: _Opening, extent: tuple[float, float], style: str
) -> Element | None:
    """Return an opening as an element, clipped to its piece; None where hardly any is left."""
    start = _start(piece, side, extent)
    left = max(opening.left - start, MARGIN)
    right = min(opening.right - start, piece.width - MARGIN)
    door = opening.kind == "door"
    low = 0.0 if door else max(opening.low, MARGIN)
    high = min(opening.high, piece.height - MARGIN)
    if right - left < LEAST_OPENING or high - low < LEAST_OPENING:
        return None
    place = (round(left, 4), round(low, 4), round(right - left, 4), round(high - low, 4))
    return Element(opening.kind, "plain" if door else style, *place, known=True)


# --- the main door ------------------------------------------------------------------------------


def _with_door(front: Facade, storey: float) -> Facade:
    """Return a front with a main door: the largest that is seen, else one in the free wall.

    A door that nobody sees stands nearest to the middle where a gap of the ground floor takes
    it, and is not `known`.
    """
    ground = [piece for piece in front.pieces if piece.origin[2] < 1e-6]
    seen = [(e.width * e.height, p, e) for p in ground for e in p.elements if e.kind == "door"]
    if seen:
        _, piece, door = max(seen, key=lambda row: row[0])
        return _exchanged(front, piece, door, replace(door, main=True))
    for piece in sorted(ground, key=lambda p: -p.width):
        place = _free_place(piece, storey)
        if place is not None:
            height = round(min(USUAL[1], 0.9 * piece.height), 4)
            guess = Element("door", "plain", place, 0.0, USUAL[0], height, main=True)
            return _exchanged(front, piece, None, guess)
    return front


def _free_place(piece: Piece, storey: float) -> float | None:
    """Return where a door fits between the windows that reach down to it, nearest the middle."""
    width, height = USUAL[0], min(USUAL[1], 0.9 * storey)
    middle: float = (piece.width - width) / 2
    taken = sorted((e.u, e.u + e.width) for e in piece.elements if e.v < height)
    places: list[float] = []
    end = 0.0
    for start, stop in [*taken, (piece.width, piece.width)]:
        if start - end >= width + 0.2:
            places.append(min(max(middle, end + 0.1), start - 0.1 - width))
        end = max(end, stop)
    if not places:
        return None
    nearest: float = min(places, key=lambda at: abs(at - middle))
    return round(nearest, 4)


def _exchanged(front: Facade, piece: Piece, old: Element | None, new: Element) -> Facade:
    others = tuple(element for element in piece.elements if element is not old)
    made = replace(piece, elements=(*others, new))
    return Facade(tuple(made if p is piece else p for p in front.pieces))
