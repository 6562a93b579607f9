"""What was observed of a building: its elements are found back on the finished mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.building import SIDES, Building, Element, Piece, Side
from ..errors import Infeasible, InvalidInput
from ..geometry.blocked import wall_of
from ..geometry.checks import building_problems, element_rectangles, overlaps

NEAR = 1e-3  # what is closer than this is in the same place (m)


@dataclass(frozen=True, slots=True)
class Standing:
    """Pieces of one side with what stands already, and which of them take nothing more."""

    name: Side
    pieces: tuple[Piece, ...]
    closed: frozenset[str]


def standing_sides(
    building: Building, pieces: Mapping[Side, Sequence[Piece]], keep: Building | None
) -> list[Standing]:
    """Return all sides with the elements that are known.

    Known are all elements of `keep` (whose listed sides are closed: they were seen as a whole),
    and those that `building` itself marks as known; of one that both have, that of `keep`. Raises
    Infeasible where one has no wall.
    """
    sources = [building] if keep is None else [building, keep]
    closed = () if keep is None else tuple(keep.facades)
    sides = []
    for side in SIDES:
        own: dict[str, list[Element]] = {piece.id: [] for piece in pieces[side]}
        for source in sources:
            _adopt(source, side, pieces[side], own, everything=source is keep)
        placed = tuple(replace(piece, elements=tuple(own[piece.id])) for piece in pieces[side])
        full = frozenset(piece.id for piece in placed) if side in closed else frozenset()
        sides.append(Standing(side, placed, full))
    return sides


def check_kept(keep: Building) -> None:
    """Raise InvalidInput, with the pointer, where a box of a partial breaks a rule of geometry."""
    for problem in building_problems(replace(keep, facades={})):
        if problem.pointer.startswith("/boxes/"):
            raise InvalidInput(problem.message, pointer=problem.pointer)


def refuse_contradictions(sides: Sequence[Standing]) -> None:
    """Raise Infeasible where two known elements overlap, or there are two main doors."""
    mains = []
    for side in sides:
        for piece in side.pieces:
            rows = element_rectangles(piece.elements)
            for i, j in np.argwhere(np.triu(overlaps(rows, rows), 1)).tolist():
                some, other = _place(piece, i), _place(piece, j)
                raise Infeasible(f"the known {some} and {other} overlap; keep one of them")
            mains += [_place(piece, k) for k, e in enumerate(piece.elements) if e.main]
    if len(mains) > 1:
        raise Infeasible(f"the known {mains[0]} and {mains[1]} are both main doors; keep one")


def _place(piece: Piece, k: int) -> str:
    element = piece.elements[k]
    return f"{element.kind} at {element.u:g}, {element.v:g} m of {piece.id!r}"


def _adopt(
    source: Building,
    side: Side,
    pieces: Sequence[Piece],
    own: dict[str, list[Element]],
    *,
    everything: bool,
) -> None:
    """Add the known elements of one side of `source` to the pieces that hold them."""
    if side not in source.facades:
        return
    for old in source.facades[side].pieces:
        for element in old.elements:
            if everything or element.known:
                piece, moved = _home(side, old, element, pieces)
                row = own[piece.id]
                at = next((k for k, there in enumerate(row) if _same(there, moved)), len(row))
                row[at : at + 1] = [moved]


def _same(some: Element, other: Element) -> bool:
    """Tell whether two elements are one that was read twice."""
    apart = np.abs(element_rectangles([some]) - element_rectangles([other])).max()
    return some.kind == other.kind and bool(apart <= NEAR)


def _home(
    side: Side, old: Piece, element: Element, pieces: Sequence[Piece]
) -> tuple[Piece, Element]:
    """Return the piece that holds an element of `old`, and the element in its frame, known."""
    for piece in pieces:
        wall, start = wall_of(side, piece), wall_of(side, old).start
        offset = start[0] - wall.start[0], start[1] - wall.start[1]
        along = offset[0] * wall.along[0] + offset[1] * wall.along[1]
        out = offset[0] * wall.outwards[0] + offset[1] * wall.outwards[1]
        up = old.origin[2] - piece.origin[2]
        moved = replace(
            element, u=_shifted(element.u, along), v=_shifted(element.v, up), known=True
        )
        if abs(out) <= NEAR and _inside(moved, piece):
            return piece, moved
    where = f"{side} {element.kind} at {element.u:g}, {element.v:g} m of {old.id!r}"
    raise Infeasible(f"no wall of the mass holds the known {where}")


def _shifted(value: float, by: float) -> float:
    """Return value + by; a shift of nothing leaves the given number as it came."""
    return value if abs(by) < 1e-9 else value + by


def _inside(element: Element, piece: Piece) -> bool:
    right, top = element.u + element.width, element.v + element.height
    low = min(element.u, element.v)
    return low >= -NEAR and right <= piece.width + NEAR and top <= piece.height + NEAR
