"""Window-to-wall ratio, symmetry and alignment of the four sides, compiled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..artifacts.building import SIDES, Facade, Side
from ..compiled import compiled
from ..geometry.arrays import Floats

MIRRORED_WITHIN = 0.05 + 1e-6  # edges of mirrored elements (m)
ALIGNED_WITHIN = 0.10 + 1e-6  # centres along the wall (m)
TOUCHING = 1e-6  # pieces one directly above the other (m)

# Columns of a row of `pieces`: side, left end along the wall, plane, bottom, width, height,
# first element, number of elements. Columns of a row of `elements`: code, u, v, width, height.


@dataclass(frozen=True, slots=True)
class PackedFacades:
    """Pieces (n, 8) and elements (m, 5) of all sides as arrays; `code` numbers kind and style."""

    pieces: Floats
    elements: Floats


def pack_facades(facades: Mapping[Side, Facade]) -> PackedFacades:
    """Return facades as arrays for `facade_vector`."""
    pieces: list[tuple[float, ...]] = []
    elements: list[tuple[float, ...]] = []
    codes: dict[tuple[str, str], int] = {}
    for number, side in enumerate(SIDES):
        across, sign = (1, 1 - 2 * (side == "back")) if number < 2 else (0, 2 * number - 5)
        for piece in facades[side].pieces if side in facades else ():
            x, y, bottom = piece.origin
            plane, along = (y, sign * x) if across else (x, sign * y)
            count = len(piece.elements)
            size = piece.width, piece.height
            pieces.append((number, along, plane, bottom, *size, len(elements), count))
            for e in piece.elements:
                code = codes.setdefault((e.kind, e.style), len(codes))
                elements.append((code, e.u, e.v, e.width, e.height))
    return PackedFacades(
        np.array(pieces, dtype=np.float64).reshape(-1, 8),
        np.array(elements, dtype=np.float64).reshape(-1, 5),
    )


@compiled
def symmetric(width: float, elements: Floats) -> bool:
    """Tell whether elements (n, 5), mirrored at the middle of their piece, meet themselves."""
    for k in range(len(elements)):
        left = width - elements[k, 1] - elements[k, 3]
        met = False
        for j in range(len(elements)):
            met = met or (
                elements[j, 0] == elements[k, 0]
                and abs(left - elements[j, 1]) <= MIRRORED_WITHIN
                and abs(left + elements[k, 3] - elements[j, 1] - elements[j, 3]) <= MIRRORED_WITHIN
                and abs(elements[k, 2] - elements[j, 2]) <= MIRRORED_WITHIN
                and abs(elements[k, 2] + elements[k, 4] - elements[j, 2] - elements[j, 4])
                <= MIRRORED_WITHIN
            )
        if not met:
            return False
    return True


@compiled
def stacked(lower: Floats, upper: Floats) -> bool:
    """Tell whether one piece (8,) stands directly on the other, in one plane, on half its width."""
    if abs(lower[2] - upper[2]) > TOUCHING or abs(lower[3] + lower[5] - upper[3]) > TOUCHING:
        return False
    start, stop = max(lower[1], upper[1]), min(lower[1] + lower[4], upper[1] + upper[4])
    return bool(stop - start >= min(lower[4], upper[4]) / 2 - TOUCHING)


@compiled
def aligned(few: Floats, few_along: float, many: Floats, many_along: float) -> bool:
    """Tell whether each element of `few` has one of `many` above or below its centre."""
    for k in range(len(few)):
        centre = few_along + few[k, 1] + few[k, 3] / 2
        met = False
        for j in range(len(many)):
            other = many_along + many[j, 1] + many[j, 3] / 2
            met = met or abs(centre - other) <= ALIGNED_WITHIN
        if not met:
            return False
    return True


@compiled
def _own(piece: Floats, elements: Floats) -> Floats:
    first = int(piece[6])
    return elements[first : first + int(piece[7])]


@compiled
def _alignment(pieces: Floats, elements: Floats) -> float:
    pairs = 0
    met = 0
    for low in range(len(pieces)):
        for high in range(len(pieces)):
            lower, upper = pieces[low], pieces[high]
            if lower[7] == 0 or upper[7] == 0 or low == high or not stacked(lower, upper):
                continue
            pairs += 1
            below, above = _own(lower, elements), _own(upper, elements)
            if len(below) < len(above):
                met += aligned(below, lower[1], above, upper[1])
            else:
                met += aligned(above, upper[1], below, lower[1])
    return met / pairs if pairs else 1.0


@compiled
def side_values(pieces: Floats, elements: Floats) -> tuple[float, float, float]:
    """Return wwr, sym and align of one side's pieces (n, 8), n ≥ 1."""
    wall = 0.0
    symmetric_wall = 0.0
    glass = 0.0
    for k in range(len(pieces)):
        own = _own(pieces[k], elements)
        area = pieces[k, 4] * pieces[k, 5]
        wall += area
        symmetric_wall += area if symmetric(pieces[k, 4], own) else 0.0
        for j in range(len(own)):
            glass += own[j, 3] * own[j, 4]
    return glass / wall, symmetric_wall / wall, _alignment(pieces, elements)


@compiled
def facade_vector(pieces: Floats, elements: Floats) -> Floats:
    """Return wwr, sym, align, each front, back, left, right (12,); NaN for sides without pieces.

    `pieces` are sorted by side. Of two stacked pieces with equally many elements, the upper one's
    are looked for in the lower one.
    """
    out = np.full(12, np.nan)
    start = 0
    for stop in range(1, len(pieces) + 1):
        if stop == len(pieces) or pieces[stop, 0] != pieces[start, 0]:
            side = int(pieces[start, 0])
            out[side], out[4 + side], out[8 + side] = side_values(pieces[start:stop], elements)
            start = stop
    return out
