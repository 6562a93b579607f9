"""Facade pieces: the exterior walls of a building as rectangles, side by side and storey by storey.

A piece is a maximal rectangle of exterior wall of one side on the outline of the union of general
and garage boxes, cut at changes of depth and at storey lines; the top storey of a wall runs to
its eaves. Heights and plan positions are compared after rounding to 1e-6 m.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..artifacts.building import SIDES, Box, Building, Element, Piece, Side
from .arrays import Floats, Integers
from .boxes import box_rectangles, edge_positions, rounded
from .floors import mass_boxes, storeys


@dataclass(frozen=True, slots=True)
class _Strip:
    """A wall strip of one cell: its plane, extent along the wall, heights, and owning box."""

    plane: float
    start: float
    stop: float
    bottom: float
    top: float
    owner: int


def facade_pieces(building: Building) -> dict[Side, tuple[Piece, ...]]:
    """Return the pieces of all four sides, without elements.

    A piece's origin is its lower left as seen from outside (m). Ids are `front-1`, `front-2`, …:
    from bottom to top, then from left to right, then from front to back, seen from outside.
    `box` is the box whose eaves the wall reaches (on most of its length; first in list order).
    """
    boxes = mass_boxes(building)
    owners, heights, xs, ys = _cells(boxes)
    pieces: dict[Side, tuple[Piece, ...]] = {}
    for side in SIDES:
        strips = list(_strips(side, owners, heights, (xs, ys), building.storey_height))
        pieces[side] = tuple(_pieces(side, boxes, strips))
    return pieces


def _cells(boxes: Sequence[Box]) -> tuple[Integers, Floats, Floats, Floats]:
    """Return owner and eaves height of every cell (padded with an empty rim), and the lines."""
    rectangles = box_rectangles(boxes)
    xs, ys = edge_positions(rectangles)
    shape = (len(xs) + 1, len(ys) + 1)
    owners, heights = np.full(shape, -1), np.zeros(shape)
    eaves = rounded(np.array([box.height or 0.0 for box in boxes]))
    for k in reversed(range(len(boxes))):  # of equal heights the first in list order owns
        (i0, i1), (j0, j1) = (
            np.searchsorted(lines, rectangles[k, axis::2]) + 1 for axis, lines in ((0, xs), (1, ys))
        )
        block = slice(i0, i1), slice(j0, j1)
        higher = eaves[k] >= heights[block]
        owners[block][higher] = k
        heights[block][higher] = eaves[k]
    return owners, heights, xs, ys


def _strips(
    side: Side, owners: Integers, heights: Floats, lines: tuple[Floats, Floats], storey: float
) -> Iterator[_Strip]:
    """Yield the exposed wall strips of a side, one a cell and storey, by plane and position."""
    along, across = lines
    if side in ("left", "right"):
        along, across, owners, heights = across, along, owners.T, heights.T
    ahead = 1 if side in ("back", "right") else 0
    inner, outer = (heights[:, :-1], heights[:, 1:]) if ahead else (heights[:, 1:], heights[:, :-1])
    who = owners[:, :-1] if ahead else owners[:, 1:]
    for j, i in np.argwhere((inner > outer).T).tolist():
        owner = int(who[i, j])
        for bottom, top in _storey_spans(float(outer[i, j]), float(inner[i, j]), storey):
            yield _Strip(float(across[j]), along[i - 1], along[i], bottom, top, owner)


def _storey_spans(low: float, high: float, storey: float) -> Iterator[tuple[float, float]]:
    count = max(storeys(high, storey), 1)
    lines = [float(rounded(np.array(i * storey))) for i in range(count)] + [high]
    for bottom, top in pairwise(lines):
        if top > low:
            yield max(bottom, low), top


def _pieces(side: Side, boxes: Sequence[Box], strips: list[_Strip]) -> Iterator[Piece]:
    runs = _runs(strips)
    mirrored = side in ("back", "left")
    outward = -1.0 if side in ("front", "left") else 1.0

    def rank(run: list[_Strip]) -> tuple[float, float, float]:
        left = -run[-1].stop if mirrored else run[0].start
        return run[0].bottom, left, -outward * run[0].plane

    for number, run in enumerate(sorted(runs, key=rank), start=1):
        first, last = run[0], run[-1]
        left = float(last.stop if mirrored else first.start)
        origin = (left, first.plane) if side in ("front", "back") else (first.plane, left)
        width = float(rounded(np.array(last.stop - first.start)))
        height = float(rounded(np.array(first.top - first.bottom)))
        owner = boxes[_owner(run)].id
        yield Piece(f"{side}-{number}", owner, (*origin, first.bottom), width, height)


def _runs(strips: list[_Strip]) -> list[list[_Strip]]:
    """Join strips that continue each other along the wall at equal heights."""
    rows: dict[tuple[float, float, float], list[list[_Strip]]] = {}
    for strip in strips:
        row = rows.setdefault((strip.plane, strip.bottom, strip.top), [])
        if row and row[-1][-1].stop == strip.start:
            row[-1].append(strip)
        else:
            row.append([strip])
    return [run for row in rows.values() for run in row]


def _owner(run: list[_Strip]) -> int:
    lengths: dict[int, float] = {}
    for strip in run:
        lengths[strip.owner] = lengths.get(strip.owner, 0.0) + strip.stop - strip.start
    longest = max(lengths.values())
    return min(owner for owner, length in lengths.items() if length >= longest - 1e-9)


# --- names ----------------------------------------------------------------------------------------
def named_pieces(building: Building) -> Iterator[tuple[str, Side, Piece]]:
    """Yield the pieces that a building lists, with the names of their parts' common beginning."""
    for side in (side for side in SIDES if side in building.facades):
        for index, piece in enumerate(building.facades[side].pieces, 1):
            yield f"{side}/piece-{index}", side, piece


def named_elements(name: str, piece: Piece) -> Iterator[tuple[str, Element]]:
    """Yield the elements of a piece of that name with their own names, counted by kind."""
    count: Counter[str] = Counter()
    for element in piece.elements:
        count[element.kind] += 1
        yield f"{name}/{element.kind}-{count[element.kind]}", element
