"""Facades that somebody designed: a solved design takes the place of a side's largest wall."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..artifacts.building import Building, Element, Piece, Side
from ..geometry.arrays import Rectangles
from ..geometry.blocked import wall_of
from ..geometry.checks import element_rectangles, overlaps

log = logging.getLogger("facade_tools.facadegen")

# Width and height of a wall (m) -> elements in the frame of the wall.
Designer = Callable[[float, float], Sequence[Element]]
NEAR = 1e-6
Spot = tuple[float, float, Piece]  # a piece and where it begins in the frame of its wall (m)


def designed_pieces(
    building: Building,
    pieces: Mapping[Side, Sequence[Piece]],
    blocked: Mapping[str, Rectangles],
    designers: Mapping[Side, Designer],
) -> dict[str, tuple[Element, ...]]:
    """Return by piece id the elements of designed walls; blocked: where none may be, likewise.

    A design is solved for the largest plane of general boxes of its side, all storeys together.
    Its elements count as known: a design is the user's word. Elements that would cross a storey
    line, leave the wall or meet a roof are left out with a warning; a piece that so loses all that
    the design has there is no designed one. The main door is in the front:
    one of another side's design is a plain door. Raises Infeasible where a design has no layout of
    that size.
    """
    kinds = {box.id: box.kind for box in building.boxes}
    found: dict[str, tuple[Element, ...]] = {}
    for side, designer in designers.items():
        own = [piece for piece in pieces[side] if kinds[piece.box] == "general"]
        if not own:
            continue
        spots, size = _largest_plane(side, own)
        elements = [replace(e, main=e.main and side == "front") for e in designer(*size)]
        lost = len(elements)
        for u, v, piece in spots:
            inside = _inside(elements, (u, v), piece)
            rows = overlaps(element_rectangles(inside), blocked[piece.id])
            hits = np.asarray(rows.any(axis=1))
            placed = tuple(e for e, hit in zip(inside, hits, strict=True) if not hit)
            lost -= len(placed)
            if placed or not _touched(elements, (u, v), piece):
                found[piece.id] = placed
        if lost:
            log.warning("%s: %d elements of the %s design have no place", building.id, lost, side)
    if "front" in designers:
        _name_main_door(pieces["front"], found)
    return found


def _largest_plane(side: Side, pieces: Sequence[Piece]) -> tuple[list[Spot], tuple[float, float]]:
    """Return the pieces of the largest plane with their places in it, and its size (m)."""
    groups: dict[float, list[tuple[float, Piece]]] = {}
    for piece in pieces:
        wall = wall_of(side, piece)
        depth = wall.start[0] * wall.outwards[0] + wall.start[1] * wall.outwards[1]
        along = wall.start[0] * wall.along[0] + wall.start[1] * wall.along[1]
        groups.setdefault(round(depth, 6), []).append((along, piece))
    plane = max(groups.values(), key=lambda rows: sum(p.width * p.height for _, p in rows))
    left, bottom = min(u for u, _ in plane), min(p.origin[2] for _, p in plane)
    spots = [(u - left, p.origin[2] - bottom, p) for u, p in plane]
    width = max(u + p.width for u, _, p in spots)
    return spots, (width, max(v + p.height for _, v, p in spots))


def _inside(elements: Sequence[Element], at: tuple[float, float], piece: Piece) -> list[Element]:
    """Return the elements that lie in a piece, in its frame."""
    moved = [replace(e, u=e.u - at[0], v=e.v - at[1]) for e in elements]
    return [
        replace(e, u=max(e.u, 0.0), v=max(e.v, 0.0), known=True)
        for e in moved
        if min(e.u, e.v) >= -NEAR
        and e.u + e.width <= piece.width + NEAR
        and e.v + e.height <= piece.height + NEAR
    ]


def _touched(elements: Sequence[Element], at: tuple[float, float], piece: Piece) -> bool:
    """Tell whether an element reaches into a piece."""
    whole = np.array([(*at, at[0] + piece.width, at[1] + piece.height)])
    return bool(overlaps(element_rectangles(elements), whole).any())


def _name_main_door(pieces: Sequence[Piece], found: dict[str, tuple[Element, ...]]) -> None:
    """Make the first door at ground level the main one where the design names none."""
    if any(e.main for row in found.values() for e in row):
        return
    for piece in pieces:
        row = found.get(piece.id, ())
        for k, e in enumerate(row):
            if e.kind == "door" and piece.origin[2] < NEAR and e.v < 0.3:
                found[piece.id] = (*row[:k], replace(e, main=True), *row[k + 1 :])
                return
