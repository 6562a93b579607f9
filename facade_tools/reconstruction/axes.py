"""Columns of windows: those that stand above one another, but for the error of a parse, do so.

A parse finds each floor's windows for itself, to a few pixels (one is 3 to 7 cm of a house).
Attributes compare centres to 10 cm, so that aligned facades would count as unaligned.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ..artifacts.building import Element, Piece, Side

SLACK = 0.15  # metres that a window's centre may be off its axis
APART = 0.02  # metres that a moved window keeps from its piece's border and from its neighbours


@dataclass(frozen=True, slots=True)
class _Window:
    """A window: numbers of its piece and element, storey's height, centre along the side (m)."""

    piece: int
    element: int
    level: float
    centre: float


def on_axes(side: Side, pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces of a side with windows moved onto common axes, by `SLACK` at most.

    Axes start at the windows of the fullest storey; windows of others that are farther from all
    of them start their own. An axis is the mean of its windows. A window that would leave its
    piece or meet another element stays.
    """
    out = list(pieces)
    for axis in _axes(_windows(side, pieces)):
        middle = sum(window.centre for window in axis) / len(axis)
        for window in axis if len(axis) > 1 else ():
            shift = _along(side) * (middle - window.centre)
            if abs(shift) <= SLACK:
                out[window.piece] = _moved(out[window.piece], window.element, shift)
    return out


def _along(side: Side) -> int:
    """Return 1 where a piece's u runs with the plan's axis along its side, else −1."""
    return 1 if side in ("front", "right") else -1


def _windows(side: Side, pieces: Sequence[Piece]) -> list[_Window]:
    across = 0 if side in ("front", "back") else 1
    return [
        _Window(
            p, e, piece.origin[2],
            piece.origin[across] + _along(side) * (element.u + element.width / 2),
        )
        for p, piece in enumerate(pieces)
        for e, element in enumerate(piece.elements)
        if element.kind == "window"
    ]  # fmt: skip


def _axes(windows: Sequence[_Window]) -> list[list[_Window]]:
    """Return the windows by axis; each takes the axis nearest to its first window."""
    levels: dict[float, list[_Window]] = {}
    for window in windows:
        levels.setdefault(window.level, []).append(window)
    axes: list[list[_Window]] = []
    for _, row in sorted(levels.items(), key=lambda item: (-len(item[1]), item[0])):
        for window in row:
            near = min(axes, key=lambda axis: abs(axis[0].centre - window.centre), default=None)
            if near is None or abs(near[0].centre - window.centre) > 2 * SLACK:
                axes.append([window])
            else:
                near.append(window)
    return axes


def _moved(piece: Piece, number: int, shift: float) -> Piece:
    """Return a piece with one window moved along it, or as it was where there is no room."""
    window = piece.elements[number]
    placed = replace(window, u=round(window.u + shift, 6))
    inside = APART <= placed.u <= piece.width - window.width - APART
    others = (e for k, e in enumerate(piece.elements) if k != number)
    if not inside or meets(placed, others, APART):
        return piece
    rows = (*piece.elements[:number], placed, *piece.elements[number + 1 :])
    return replace(piece, elements=rows)


def meets(element: Element, others: Iterable[Element], apart: float = 0.0) -> bool:
    """Tell whether an element overlaps another one, or is nearer to it than `apart` beside it."""
    return any(
        element.u < other.u + other.width + apart
        and other.u < element.u + element.width + apart
        and element.v < other.v + other.height
        and other.v < element.v + element.height
        for other in others
    )
