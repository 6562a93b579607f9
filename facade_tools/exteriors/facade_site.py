"""From a building and library parts to the arrays of the search, and back to facades."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.building import SIDES, Building, Element, Facade, Piece
from ..artifacts.building import Side as SideName
from ..geometry.arrays import Floats, Integers, Rectangles
from .facade_attributes import pack_facades, stacked
from .facade_energy import least_energy
from .facade_layout import (
    ABOVE,
    CENTRE,
    CODE,
    DOOR,
    GROUND,
    HEIGHT,
    LOW,
    LOWER,
    NEEDS,
    ROWS,
    SLIM,
    SQUEEZE,
    SUB,
    TALL,
    TWIN,
    WIDTH,
    Side,
)
from .facade_parts import Codes, MainDoor, PartRow
from .kept import Standing
from .library import END, storey_of

LOW_ROOM = 1.65  # least height of a piece over its storey's floor that takes windows (m)
NARROW_ROOM = 0.9  # least width of such a piece (m)
OVER_HEAD = 0.15  # least wall between a window's head and the top of its piece (m)
NARROW = 0.5  # lower bound of eq. 5, times the average width
SLENDER, SLIM_WIDTH = 3.0, 0.5  # sidelights: at least this slender, and narrower than this (m)
LEVEL_HEAD = 1.9  # a storey's heads are not lowered under this for one low piece (m)


def storey_heads(
    building: Building, sides: Sequence[Standing], usual: tuple[float, float]
) -> dict[int, float]:
    """Return for each storey the height of its window heads over its floor (m).

    All windows of a storey share it on all sides: the usual head, lowered to the lowest eaves of
    the storey unless those are very low. usual: on the ground floor and above.
    """
    kinds = {box.id: box.kind for box in building.boxes}
    heads: dict[int, float] = {}
    for side in sides:
        for piece in side.pieces:
            storey = storey_of(piece, building.storey_height)
            room = _top(piece, storey, building.storey_height) - OVER_HEAD
            head = heads.setdefault(storey, usual[min(storey, 1)])
            if kinds[piece.box] == "general" and room >= LEVEL_HEAD:
                heads[storey] = min(head, room)
    return heads


def _top(piece: Piece, storey: int, storey_height: float) -> float:
    return piece.origin[2] + piece.height - storey * storey_height


def search_side_of(
    building: Building,
    standing: Standing,
    rows: Sequence[PartRow],
    codes: Codes,
    heads: Mapping[int, float],
    walls: Mapping[str, Rectangles],
) -> Side:
    """Return the arrays of one side, without main door and targets.

    walls: by piece id, where no element may be.
    """
    packed = pack_facades({standing.name: Facade(standing.pieces)})
    fixed = packed.elements.copy()
    elements = (e for piece in standing.pieces for e in piece.elements)
    for k, e in enumerate(elements):
        fixed[k, 0] = codes.number(e.kind, e.style)
    blocked = [
        (p, *row) for p, piece in enumerate(standing.pieces) for row in walls[piece.id].tolist()
    ]
    pieces = packed.pieces
    pairs = [
        (low, high)
        for low in range(len(pieces))
        for high in range(len(pieces))
        if low != high and stacked(pieces[low], pieces[high])
    ]
    return Side(
        pieces,
        np.array([_room(building, standing, p, heads) for p in standing.pieces]).reshape(-1, 5),
        fixed,
        np.array(blocked, dtype=np.float64).reshape(-1, 5),
        np.array(pairs, dtype=np.int64).reshape(-1, 2),
        sub_table(rows, codes, standing.name),
        np.array([-1.0, 0.0, 0.0, 0.0, 0.0]),
        np.full(3, np.nan),
        np.ones(len(pieces)),
    )


def _room(
    building: Building, standing: Standing, piece: Piece, heads: Mapping[int, float]
) -> tuple[float, ...]:
    storey = storey_of(piece, building.storey_height)
    floor = storey * building.storey_height - piece.origin[2]
    top = _top(piece, storey, building.storey_height)
    head = floor + min(heads[storey], top - OVER_HEAD)
    large = piece.width >= NARROW_ROOM and top >= LOW_ROOM and piece.height >= 1.0
    kind = next(box.kind for box in building.boxes if box.id == piece.box)
    free = large and piece.id not in standing.closed
    return floor, head, float(storey > 0), float(free), float(kind == "garage")


def sub_table(rows: Sequence[PartRow], codes: Codes, side: SideName) -> Floats:
    """Return the substyles (k, 11) with the weights that they have on a side.

    Where the library's building has no window but sidelights on such a side or storey, its windows
    elsewhere stand in. One whose windows are all as slim has no sidelights.
    """
    windows = [k for k, row in enumerate(rows) if row.kind == "window"]
    table = np.zeros((len(rows) + len(windows), 11))
    for k, row in enumerate(rows):
        door = row.kind == "door"
        table[k, :4] = codes.number(row.kind, row.style), row.width, row.height, door
        table[k, TWIN], table[k, LOW] = -1.0, NARROW * row.width
        for level in (0, 1):
            table[k, 4 + level] = row.weights.get((END[side], level), 0.0)
    window = np.array([row.kind == "window" for row in rows])
    slim = window & (table[: len(rows), WIDTH] * SLENDER < table[: len(rows), HEIGHT])
    slim &= table[: len(rows), WIDTH] < SLIM_WIDTH
    common = np.array([bool(row.weights) for row in rows]) & window & ~slim
    if common.any():
        table[: len(rows), SLIM] = slim
    else:
        common = window
    _add_twins(table, windows)
    for level in (0, 1):
        for group in ([(s, level) for s in _KINDS], [(s, lv) for s in _KINDS for lv in (0, 1)]):
            if not table[: len(rows)][common, 4 + level].any():
                weights = [sum(row.weights.get(key, 0.0) for key in group) for row in rows]
                table[: len(rows), 4 + level] += np.where(common, weights, 0.0)
    rigid = (table[:, DOOR] > 0.0) | (table[:, SLIM] > 0.0)
    table[:, NEEDS] = np.where(rigid, 1.0, SQUEEZE) * table[:, WIDTH]
    table[:, ROWS] = (table[:, DOOR] > 0.0) | ((table[:, SLIM] == 0.0) & (table[:, TWIN] >= 0.0))
    doors = np.flatnonzero(~window)
    if side == "front":
        table[doors, GROUND] = 0.0
    table[doors, ABOVE] = 0.0
    return table


def _add_twins(table: Floats, windows: Sequence[int]) -> None:
    """Fill the last rows with narrow twins of the windows, for walls that are too narrow."""
    first = len(table) - len(windows)
    for twin, k in enumerate(windows, start=first):
        table[twin, :4], table[twin, SLIM] = table[k, :4], table[k, SLIM]
        table[twin, WIDTH] = max(0.6 * table[k, WIDTH], min(0.45, table[k, WIDTH]))
        table[twin, TWIN], table[twin, LOW] = -1.0, SQUEEZE * table[twin, WIDTH]
        table[k, TWIN] = twin


_KINDS = tuple(dict.fromkeys(END[side] for side in SIDES))


def with_door(side: Side, door: MainDoor, targets: Floats) -> tuple[Side, float]:
    """Return a side with main door, targets and plan, and a lower bound of its energy."""
    row = np.array([door.piece, door.low, door.high, door.sub, door.middle], dtype=np.float64)
    placed = side._replace(door=row, targets=targets)
    least, plan = least_energy(placed)
    return placed._replace(plan=plan), least


@dataclass(frozen=True, slots=True)
class Solution:
    """The best genome of a side with its substyles' widths, its energy and a lower bound of it."""

    genome: Floats
    counts: Integers
    widths: Floats
    energy: float
    least: float


def facade_of(
    standing: Standing, side: Side, found: Solution, codes: Codes, main: int = -1
) -> Facade:
    """Return a side's facade: what stood and what was found, to the millimetre.

    main: piece whose first new element is the main door, or −1.
    """
    pieces = []
    for p, piece in enumerate(standing.pieces):
        new = [
            _element(side, found, codes, (p, e), main=p == main and e == 0)
            for e in range(int(found.counts[p]))
        ]
        new.sort(key=lambda e: (e.u, e.v))
        pieces.append(replace(piece, elements=(*piece.elements, *new)))
    return Facade(tuple(pieces))


def _element(
    side: Side, found: Solution, codes: Codes, at: tuple[int, int], *, main: bool
) -> Element:
    row = found.genome[at]
    sub = int(row[SUB])
    kind, style = codes.names[int(side.subs[sub, CODE])]
    width = round(float(found.widths[sub]), 3)
    left = round(float(row[CENTRE]) - width / 2, 3)
    lower, tall = round(float(row[LOWER]), 3), round(float(row[TALL]), 3)
    return Element(kind, style, left, max(lower, 0.0), width, tall, main)
