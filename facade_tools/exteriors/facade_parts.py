"""What a building gets from the library: substyles with weights, and the main door."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..artifacts.building import Building, ElementKind, Piece, Side
from ..artifacts.library import Library, LibraryBuilding, Part, PartSide
from ..geometry.blocked import wall_of
from ..geometry.checks import HIGHEST_SILL
from ..geometry.garage_walls import house_beside

DOOR = (0.95, 2.1)  # a door where the library has none (m)
DOOR_WEIGHT = 3.0  # doors beside the main one are few: drawn this much more often than counted
BESIDE_DOOR = 0.25  # least wall between the main door and its piece's border (m)
OVER_DOOR = 0.1  # least wall over the main door (m)
LEAST_PORCH = 0.3  # how far a porch stands out where it shelters a door (m)
LEAST_DOOR = 1.5  # height to which it shrinks where the whole front is low (m)
USUAL_HEADS = (2.15, 2.1)  # where the library's building has no window (m)


@dataclass(frozen=True, slots=True)
class PartRow:
    """A substyle on one level: average size (m) and how often it occurs by side and level."""

    kind: ElementKind
    style: str
    width: float
    height: float
    weights: Mapping[tuple[PartSide, int], float]


@dataclass(slots=True)
class Codes:
    """Numbers for pairs of kind and style."""

    names: list[tuple[ElementKind, str]] = field(default_factory=list)

    def number(self, kind: ElementKind, style: str) -> int:
        """Return the number of a kind and style, a new one if it is new."""
        if (kind, style) not in self.names:
            self.names.append((kind, style))
        return self.names.index((kind, style))


@dataclass(frozen=True, slots=True)
class MainDoor:
    """Where the main door may be: piece, range of its centre (m), substyle, share in the middle.

    rank: whether it is in a garage, and whether it is not behind a porch. A higher rank is for
    fronts where none lower has a place, whatever the energy.
    """

    piece: int = -1
    low: float = 0.0
    high: float = 0.0
    sub: int = 0
    middle: float = 0.0
    rank: tuple[bool, bool] = (False, False)


def part_rows(library: Library, entry: LibraryBuilding) -> list[PartRow]:
    """Return the substyles of a library building by level; the last row is the main door's.

    Spare sizes without weight stand before it, for targets that the others cannot meet.
    """
    rows = []
    windows = [p for p in entry.parts if library.substyles[p.substyle].kind != "garage-door"]
    for index, level in sorted({(p.substyle, p.level) for p in windows}):
        parts = [p for p in windows if (p.substyle, p.level) == (index, level)]
        style = library.substyles[index]
        alike = [p for p in windows if p.substyle == index]
        factor = DOOR_WEIGHT if style.kind == "door" else 1.0
        upper = int(level == "upper")
        weights = {(p.side, upper): factor * p.count for p in parts}
        width, height = _mean(alike, "width"), _mean(parts, "height")
        rows.append(PartRow(style.kind, style.style, width, height, weights))
    if not any(row.kind == "window" for row in rows):
        weights = {(side, level): 1.0 for side in ("front", "back", "end") for level in (0, 1)}
        rows.append(PartRow("window", "casement", 1.2, 1.3, weights))
    return [*rows, *_spare(library, rows), _main_door(library, entry)]


def _spare(library: Library, rows: Sequence[PartRow]) -> list[PartRow]:
    """Return the smallest and largest size of each window style in use, with no weight."""
    spare = []
    for style in sorted({row.style for row in rows if row.kind == "window"}):
        sizes = [
            (s.width * s.height, s.width, s.height)
            for s in library.substyles
            if (s.kind, s.style) == ("window", style)
        ]
        for _, width, height in sorted({min(sizes), max(sizes)}) if sizes else ():
            spare.append(PartRow("window", style, width, height, {}))
    return spare


def _main_door(library: Library, entry: LibraryBuilding) -> PartRow:
    doors = [
        (part.side != "front", part.width, part)
        for part in entry.parts
        if library.substyles[part.substyle].kind == "door" and part.height >= 1.8
    ]
    if not doors:
        return PartRow("door", "panel", *DOOR, {})
    part = min(doors, key=lambda row: row[:2])[2]
    style = library.substyles[part.substyle].style
    return PartRow("door", style, min(part.width, 1.2), min(part.height, 2.3), {})


def _mean(parts: Sequence[Part], name: str) -> float:
    counts = [part.count for part in parts]
    return float(np.average([getattr(part, name) for part in parts], weights=counts))


def usual_heads(library: Library, entry: LibraryBuilding) -> tuple[float, float]:
    """Return the height of most window heads over the floor, on the ground and above (m)."""
    heads = []
    for level, usual in zip(("ground", "upper"), USUAL_HEADS, strict=True):
        rows = [
            (part.count, part.head)
            for part in entry.parts
            if part.level == level and library.substyles[part.substyle].kind == "window"
        ]
        heads.append(max(rows)[1] if rows else usual)
    return heads[0], heads[1]


def reachable(
    rows: Sequence[PartRow], usual: tuple[float, float]
) -> tuple[list[PartRow], tuple[float, float]]:
    """Return the substyles and usual heads of which no sill is out of reach (`HIGHEST_SILL`).

    Of windows under high heads (of storeys of 3.5 m, say) those too low for it are left out; where
    all are, the heads are lowered to the highest of them.
    """
    tallest = max(row.height for row in rows if row.kind == "window")
    ground, upper = (min(head, HIGHEST_SILL + tallest) for head in usual)
    least = max(ground, upper) - HIGHEST_SILL - 1e-9
    return [r for r in rows if r.kind != "window" or r.height >= least], (ground, upper)


def fitting_door(rows: Sequence[PartRow], front: Sequence[Piece]) -> list[PartRow]:
    """Return the substyles with a main door that is no higher than the front allows.

    front: the pieces that take elements.
    """
    *others, door = rows
    width = door.width + 2 * BESIDE_DOOR
    walls = [piece.height for piece in front if piece.origin[2] < 1e-6 and piece.width >= width]
    room = max(walls, default=door.height + OVER_DOOR) - OVER_DOOR
    return [*others, replace(door, height=max(min(door.height, room), LEAST_DOOR))]


def main_doors(
    building: Building,
    side: Side,
    pieces: Sequence[Piece],
    free: Sequence[bool],
    rows: Sequence[PartRow],
) -> list[MainDoor]:
    """Return where the main door may be on a side, best first.

    At ground level, in general boxes before garages, in the front behind a porch before elsewhere
    (then within the porch), in a wide wall before a narrow one.
    """
    sub, half = len(rows) - 1, rows[-1].width / 2 + BESIDE_DOOR
    boxes = {box.id: box for box in building.boxes}
    found = []
    for p, piece in enumerate(pieces):
        tall = piece.height >= rows[-1].height + OVER_DOOR - 1e-9
        if not free[p] or piece.origin[2] > 1e-6 or piece.width < 2 * half or not tall:
            continue
        porch = _porch_range(building, piece) if side == "front" else None
        low, high = half, piece.width - half
        garage = boxes[piece.box].kind != "general"
        found.append(MainDoor(p, low, high, sub, 0.3, (garage, True)))
        if porch is not None and max(low, porch[0]) <= min(high, porch[1]):
            low, high = max(low, porch[0]), min(high, porch[1])
            garage = garage and not house_beside(boxes[piece.box], side, piece)
            found.append(MainDoor(p, low, high, sub, 0.6, (garage, False)))
    return sorted(found, key=lambda door: (door.rank, -pieces[door.piece].width))


def _porch_range(building: Building, piece: Piece) -> tuple[float, float] | None:
    """Return where along a front piece a porch shelters the wall, half a metre in from its ends."""
    x, y = wall_of("front", piece).start
    for box in building.boxes:
        before = box.y - box.depth / 2 <= y - LEAST_PORCH and y < box.y + box.depth / 2 + 0.05
        if box.kind == "porch" and before:
            low, high = box.x - box.width / 2 - x + 0.5, box.x + box.width / 2 - x - 0.5
            if low <= high and high > 0 and low < piece.width:
                return low, high
    return None
