"""What was observed of a building: its elements are found back on the finished mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ..artifacts.building import SIDES, Building, Element, Piece, Side
from ..errors import Infeasible
from ..geometry.blocked import wall_of

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
    and those that `building` itself marks as known. Raises Infeasible where one has no wall.
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
                if moved not in own[piece.id]:
                    own[piece.id].append(moved)


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
