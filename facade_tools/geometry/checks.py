"""The rules of a building's geometry, beyond what its schema can say.

What was given (`known: true`) is only held to the rules that no real building breaks: it lies
inside its piece and overlaps nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..artifacts.building import SIDES, Box, Building, Element, Piece, Side
from .arrays import Booleans, Rectangles
from .blocked import BuiltRoof, blocked_rectangles
from .floors import TOLERANCE
from .garage_walls import Stretch, drive_stretch, garage_stretch, stretch_of
from .pieces import facade_pieces

NEAR = 1e-4  # what is closer than this is in the same place (m)
STEP = 0.3  # highest threshold of a door above its storey's floor (m)
HEADS = 0.01  # greatest difference of a storey's window heads in a generated facade (m)
LINTEL = 0.16  # wall over a window that lower eaves leave (m)
HIGHEST_SILL = 2.2  # above the storey's floor (m)
GARAGE_WALL = (2.8, 2.3)  # least width and height of a wall that must take a garage door (m)
POINT = {kind: kind.replace("-", " ") for kind in ("window", "door", "garage-door")}


class Problem(NamedTuple):
    """One broken rule: JSON pointer into the building, and what is wrong."""

    pointer: str
    message: str


@dataclass(frozen=True, slots=True)
class _Placed:
    """An element with its piece, its side, and the JSON pointer to it."""

    side: Side
    piece: Piece
    element: Element
    pointer: str


def building_problems(building: Building) -> Iterator[Problem]:
    """Yield every rule of geometry that a building (whole or partial) breaks."""
    yield from _box_problems(building)
    yield from _name_problems(building)
    if not any(box.kind != "porch" and box.height for box in building.boxes):
        return
    walls_known = not building.partial or "mass" in building.complete
    if walls_known and all(box.height for box in building.boxes if box.kind != "porch"):
        yield from _piece_problems(building)
    if not building.facades:
        return
    roof = BuiltRoof.of(building)
    placed = list(_placed(building))
    yield from _placing_problems(building, roof, placed)
    if building.energy is not None and building.energy.facade is not None:
        yield from _head_problems(building, placed)
    if not building.partial:
        yield from _door_problems(building, roof, placed)


def _box_problems(building: Building) -> Iterator[Problem]:
    if not building.partial and all(box.kind != "general" for box in building.boxes):
        yield Problem("/boxes", "no general box; expected at least one")
    least = building.storey_height / 2 + TOLERANCE
    for i, box in enumerate(building.boxes):
        if box.kind != "porch" and box.height is not None and box.height <= least:
            message = f"{box.height:g} m; expected more than half a storey ({least:g} m)"
            yield Problem(f"/boxes/{i}/height", message)


def _name_problems(building: Building) -> Iterator[Problem]:
    yield from _twice("box", [(box.id, f"/boxes/{i}/id") for i, box in enumerate(building.boxes)])
    names = {box.id for box in building.boxes if box.kind != "porch"}
    pieces = []
    for side, facade in building.facades.items():
        for j, piece in enumerate(facade.pieces):
            pointer = f"/facades/{side}/pieces/{j}"
            pieces.append((piece.id, f"{pointer}/id"))
            if piece.box not in names:
                message = f"{piece.box!r} is no general or garage box of this building"
                yield Problem(f"{pointer}/box", message)
    yield from _twice("piece", pieces)


def _twice(noun: str, rows: Iterable[tuple[str, str]]) -> Iterator[Problem]:
    seen: set[str] = set()
    for name, pointer in rows:
        if name in seen:
            yield Problem(pointer, f"{noun} id {name!r} stands twice; expected unique ids")
        seen.add(name)


def _piece_problems(building: Building) -> Iterator[Problem]:
    """Compare the listed pieces with those that the boxes make."""
    made = facade_pieces(building)
    for side, facade in building.facades.items():
        rest = {_key(piece): piece for piece in made[side]}
        for j, piece in enumerate(facade.pieces):
            pointer = f"/facades/{side}/pieces/{j}"
            if not _take(rest, piece):
                yield Problem(pointer, f"{piece.id!r} is no exterior wall that the boxes make")
            elif not any(_bears(box, side, piece) for box in building.boxes):
                yield Problem(f"{pointer}/box", f"the wall is none of box {piece.box!r}")
        if not building.partial:
            for piece in rest.values():
                where = ", ".join(f"{value:g}" for value in piece.origin)
                size = f"{piece.width:g} × {piece.height:g} m"
                yield Problem(
                    f"/facades/{side}/pieces", f"the wall at ({where}), {size}, is missing"
                )


def _bears(box: Box, side: Side, piece: Piece) -> bool:
    """Tell whether a box is the one that a piece names and has a wall of that side there."""
    return box.id == piece.box and stretch_of(box, side, piece) is not None


_Key = tuple[int, ...]


def _key(piece: Piece) -> _Key:
    values = (*piece.origin, piece.width, piece.height)
    return tuple(round(value / NEAR / 10) for value in values)


def _take(rest: dict[_Key, Piece], piece: Piece) -> bool:
    wanted = np.array([*piece.origin, piece.width, piece.height])
    exact = _key(piece)
    for key in [exact] if exact in rest else list(rest):
        other = rest[key]
        values = np.array([*other.origin, other.width, other.height])
        if np.abs(values - wanted).max() <= NEAR:
            del rest[key]
            return True
    return False


def _placed(building: Building) -> Iterator[_Placed]:
    for side in SIDES:
        if side in building.facades:
            for j, piece in enumerate(building.facades[side].pieces):
                for k, element in enumerate(piece.elements):
                    pointer = f"/facades/{side}/pieces/{j}/elements/{k}"
                    yield _Placed(side, piece, element, pointer)


def _placing_problems(
    building: Building, roof: BuiltRoof, placed: list[_Placed]
) -> Iterator[Problem]:
    groups: dict[tuple[Side, str], list[_Placed]] = {}
    for item in placed:
        groups.setdefault((item.side, item.pointer.rsplit("/", 1)[0]), []).append(item)
    for (side, _), items in groups.items():
        yield from _outside_problems(items)
        yield from _overlap_problems(items)
        fresh = [item for item in items if not item.element.known]
        if fresh:
            blocked = blocked_rectangles(building, roof, side, fresh[0].piece)
            yield from _blocked_problems(fresh, blocked)
            yield from _height_problems(fresh, building.storey_height)


def element_rectangles(elements: Iterable[Element]) -> Rectangles:
    """Return the rectangles (n, 4) of elements in their piece's frame, metres."""
    rows = [(e.u, e.v, e.u + e.width, e.v + e.height) for e in elements]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _outside_problems(items: list[_Placed]) -> Iterator[Problem]:
    for item in items:
        e, p = item.element, item.piece
        right, top = e.u + e.width - p.width, e.v + e.height - p.height
        beyond = max(-e.u, -e.v, right, top)
        if beyond > NEAR:
            yield Problem(
                item.pointer, f"the {POINT[e.kind]} crosses its piece's border by {beyond:.3g} m"
            )


def _overlap_problems(items: list[_Placed]) -> Iterator[Problem]:
    rows = element_rectangles(item.element for item in items)
    hits = overlaps(rows, rows)
    for i, j in np.argwhere(np.triu(hits, 1)).tolist():
        yield Problem(items[j].pointer, f"overlaps {items[i].pointer}")


def overlaps(some: Rectangles, others: Rectangles) -> Booleans:
    """Return (n, m): whether rectangles share more than a border of `NEAR`.

    >>> overlaps(np.array([[0, 0, 1, 1.0]]), np.array([[1, 0, 2, 1.0], [0.5, 0.5, 2, 2]])).tolist()
    [[False, True]]
    """
    low = np.maximum(some[:, None, :2], others[None, :, :2])
    high = np.minimum(some[:, None, 2:], others[None, :, 2:])
    return np.asarray((high - low > NEAR).all(axis=2))


def _blocked_problems(items: list[_Placed], blocked: Rectangles) -> Iterator[Problem]:
    rows = element_rectangles(item.element for item in items)
    hits = np.asarray(overlaps(rows, blocked).any(axis=1))
    for item, hit in zip(items, hits, strict=True):
        if hit:
            noun = POINT[item.element.kind]
            yield Problem(item.pointer, f"the {noun} meets a roof or stands behind a porch post")


def _height_problems(items: list[_Placed], storey: float) -> Iterator[Problem]:
    for item in items:
        e, bottom = item.element, item.piece.origin[2]
        floor = np.floor(bottom / storey + NEAR) * storey
        height = bottom + e.v - floor
        if e.kind == "window" and height > HIGHEST_SILL:
            yield Problem(item.pointer, f"the sill is {height:.2f} m above the storey's floor")
        if e.kind != "window" and height > STEP:
            yield Problem(item.pointer, f"the {POINT[e.kind]} hangs {height:.2f} m above the floor")


def _head_problems(building: Building, placed: list[_Placed]) -> Iterator[Problem]:
    """Compare the heads of generated windows with their storey's: only low eaves excuse."""
    fresh = [i for i in placed if i.element.kind == "window" and not i.element.known]
    levels = [np.floor(i.piece.origin[2] / building.storey_height + NEAR) for i in fresh]
    heads = [i.piece.origin[2] + i.element.v + i.element.height for i in fresh]
    usual = {
        level: max(head for head, own in zip(heads, levels, strict=True) if own == level)
        for level in set(levels)
    }
    for item, level, head in zip(fresh, levels, heads, strict=True):
        short = usual[level] - head
        room = item.piece.origin[2] + item.piece.height - head
        if short > HEADS and room > LINTEL:
            message = f"the window's head is {short:.2f} m below those of its storey"
            yield Problem(item.pointer, message)


def _door_problems(building: Building, roof: BuiltRoof, placed: list[_Placed]) -> Iterator[Problem]:
    mains = [item for item in placed if item.element.main]
    if "front" in building.facades:
        if len(mains) != 1:
            yield Problem("/facades", f"{len(mains)} main doors; expected exactly one")
        for item in mains:
            if not item.element.known and not _is_entrance(item):
                yield Problem(item.pointer, "the main door is no door at ground level")
    yield from _garage_problems(building, roof, placed)


def _is_entrance(item: _Placed) -> bool:
    ground = item.piece.origin[2] < NEAR and item.element.v <= STEP
    return item.element.kind == "door" and ground


def _garage_problems(
    building: Building, roof: BuiltRoof, placed: list[_Placed]
) -> Iterator[Problem]:
    garages = {i: box for i, box in enumerate(building.boxes) if box.kind == "garage"}
    doors = [item for item in placed if item.element.kind == "garage-door"]
    for item in doors:
        if garages and not item.element.known and not _of_any(garages.values(), item):
            yield Problem(item.pointer, f"a garage door in box {item.piece.box!r}, no garage")
    if len(building.facades) == len(SIDES):
        for i, box in garages.items():
            closed = not any(_of_any([box], item) for item in doors)
            if closed and _has_garage_wall(building, roof, box):
                yield Problem(f"/boxes/{i}", "a garage with an exposed wall but no garage door")


def _of_any(garages: Iterable[Box], door: _Placed) -> bool:
    """Tell whether a door leads into one of the garages."""
    return any(
        door.piece.box == garage.id or _within(garage_stretch(garage, door.side, door.piece), door)
        for garage in garages
    )


def _within(stretch: Stretch | None, door: _Placed) -> bool:
    e = door.element
    return stretch is not None and stretch[0] - NEAR <= e.u <= stretch[1] - e.width + NEAR


def _has_garage_wall(building: Building, roof: BuiltRoof, garage: Box) -> bool:
    return any(
        _takes_door(building, roof, garage, side, piece)
        for side, facade in building.facades.items()
        for piece in facade.pieces
    )


def _takes_door(building: Building, roof: BuiltRoof, garage: Box, side: Side, piece: Piece) -> bool:
    """Tell whether a piece has enough free wall of a garage that the garage needs a door.

    A wall of which something was observed shows what there is: no door can be asked of it.
    """
    if any(element.known for element in piece.elements):
        return False
    stretch = drive_stretch(building, garage, side, piece)
    if stretch is None or stretch[1] - stretch[0] < GARAGE_WALL[0] or piece.height < GARAGE_WALL[1]:
        return False
    rows = blocked_rectangles(building, roof, side, piece)
    return not overlaps(np.array([[stretch[0], 0.0, stretch[1], GARAGE_WALL[1]]]), rows).any()
