"""Windows that a roof or another block would cut are walled up, with the wall beside them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..artifacts.building import Building, Piece, Side
from ..geometry.arrays import Floats, Rectangles
from ..geometry.blocked import blocked_walls, porch_roofs, wall_of
from ..geometry.pieces import facade_pieces
from .panels import Panel, raster, rectangles
from .projection import SIDES
from .splitting import split
from .stacking import FLUSH
from .synthesis import resized_rule

NEAR = 0.3  # m: cornices and niches stand so far before or behind the wall that a roof meets
FRAME = 0.2  # of a wall between windows: frames, lintels and sills reach into its ends
MOST_PIECES = 60  # of wall, in the place of one window
Span = tuple[float, float]  # shares of a face
Section = tuple[float, float, bool]  # and whether it is a window


@dataclass(frozen=True, slots=True)
class Cover:
    """What hides a rectangle of a building's wall: left, bottom, right, top along its side (m).

    porch: under its roof one sees the wall from the street; a window that only hides its head
    behind it stays.
    """

    side: Side
    place: float
    rectangle: tuple[float, float, float, float]
    porch: bool = False


def roof_covers(building: Building) -> list[Cover]:
    """Return what the roofs of lower boxes and of porches hide of a building's walls."""
    covers: list[Cover] = []
    house = replace(building, boxes=tuple(b for b in building.boxes if b.kind != "porch"))
    pieces = facade_pieces(building)
    roofs = blocked_walls(house, pieces)
    for side, row in pieces.items():
        for piece in row:
            covers += _covers(side, piece, roofs[piece.id], False)
            covers += _covers(side, piece, porch_roofs(building, side, piece), True)
    return covers


def _covers(side: Side, piece: Piece, found: Rectangles, porch: bool) -> Iterator[Cover]:
    along, _, depth, _ = SIDES[side]
    wall, z = wall_of(side, piece), piece.origin[2]
    for u0, v0, u1, v1 in found.tolist():
        low, high = sorted(wall.start[along] + u * wall.along[along] for u in (u0, u1))
        yield Cover(side, wall.start[depth], (low, z + v0, high, z + v1), porch)


def walled(panel: Panel, covers: Sequence[Cover]) -> Panel:
    """Return a panel whose windows are whole or walled up.

    A window goes that a cover meets, or of which another block hides a part.
    """
    columns, rows = (_sections(panel, k) for k in (0, 1))
    openings = [b - a for a, b, is_window in columns if is_window]
    wall = _plain(columns)
    if not openings or (wall[1] - wall[0]) * MOST_PIECES < max(openings):
        return panel
    hidden = _hidden(panel, covers)
    cut = [
        (*wide, *high)
        for u, wide in _windows(columns)
        for v, high in _windows(rows) or [((0.0, 1.0), (0.0, 1.0))]
        if _is_cut((*u, *v), panel, hidden)
    ]
    return _shown(panel, np.array(cut)[:, [0, 2, 1, 3]], wall) if cut else panel


def _sections(panel: Panel, axis: int) -> list[Section]:
    """Return the sections of a panel along an axis, from the left or the bottom."""
    rule = resized_rule(panel.rules[axis], panel.source[axis])
    done = split(rule, panel.target[axis])
    if not done.windows:
        return [(0.0, 1.0, False)]
    borders = np.concatenate([[0.0], np.cumsum(done.sizes)]) / panel.target[axis]
    spans = pairwise(np.clip(borders, 0.0, 1.0).tolist())
    found = [(a, b, k % 2 == 1) for (a, b), k in zip(spans, done.sources, strict=True)]
    return found if axis == 0 else [(1 - b, 1 - a, k) for a, b, k in reversed(found)]


def _windows(sections: Sequence[Section]) -> list[tuple[Span, Span]]:
    """Return the windows among sections; and with what of their frames the walls show."""
    out = []
    for k, (start, end, is_window) in enumerate(sections):
        if is_window:
            low, high = start, end
            if k > 0 and not sections[k - 1][2]:
                low -= FRAME * (start - sections[k - 1][0])
            if k < len(sections) - 1 and not sections[k + 1][2]:
                high += FRAME * (sections[k + 1][1] - end)
            out.append(((start, end), (low, high)))
    return out


def _plain(columns: Sequence[Section]) -> Span:
    """Return the widest wall among columns without its ends; nothing where there is no wall."""
    walls = [(a, b) for a, b, is_window in columns if not is_window]
    a, b = max(walls, key=lambda span: span[1] - span[0], default=(0.0, 0.0))
    return a + FRAME * (b - a), b - FRAME * (b - a)


def _hidden(panel: Panel, covers: Sequence[Cover]) -> Rectangles:
    """Return what covers hide of a panel: left, bottom, right, top (k, 5) in shares; 1: a porch."""
    along, _, depth, _ = SIDES[panel.side]
    (left, right), place = panel.corners[:2, along], panel.corners[0, depth]
    bottom, height = panel.corners[0, 2], panel.target[1]
    rows = []
    for cover in covers:
        if cover.side == panel.side and abs(cover.place - place) < NEAR:
            u0, v0, u1, v1 = cover.rectangle
            low, high = sorted(((u0 - left) / (right - left), (u1 - left) / (right - left)))
            box = (low, (v0 - bottom) / height, high, (v1 - bottom) / height)
            rows.append((*box, float(cover.porch)))
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def _is_cut(cell: tuple[float, float, float, float], panel: Panel, hidden: Rectangles) -> bool:
    """Tell whether a cover meets a cell (left, right, bottom, top), or only a part is seen.

    A porch cuts what stands out above its roof.
    """
    size = np.array([cell[1] - cell[0], cell[3] - cell[2]])
    least = FLUSH / np.array(panel.target)

    def overlaps(boxes: Rectangles) -> Floats:
        low = np.maximum(boxes[:, :2], (cell[0], cell[2]))
        high = np.minimum(boxes[:, 2:], (cell[1], cell[3]))
        return np.asarray(np.maximum(high - low, 0.0))

    above = (hidden[:, 4] == 0) | (hidden[:, 3] < cell[3] - least[1])
    if ((overlaps(hidden[:, :4]) > least).all(axis=1) & above).any():
        return True
    seen = float(overlaps(panel.seen).prod(axis=1).sum())
    return 0.0 < seen < float(size.prod()) * (1 - 1e-6)


def _shown(panel: Panel, cut: Rectangles, wall: Span) -> Panel:
    """Return a panel that shows wall in the place of what is cut (k, 4)."""
    us, vs = (np.unique(np.concatenate([panel.seen[:, k::2], cut[:, k::2]])) for k in (0, 1))
    seen, gone = raster(panel.seen, us, vs), raster(cut, us, vs)
    rows = [(us[a], vs[r], us[b], vs[q], 0.0) for r, q, a, b in rectangles(seen & ~gone)]
    for r, q, a, b in rectangles(seen & gone):
        for left, right, shift in _pieces(float(us[a]), float(us[b]), wall):
            rows.append((left, vs[r], right, vs[q], shift))
    found = np.array(rows, dtype=np.float64).reshape(-1, 5)
    return replace(panel, seen=found[:, :4], shift=found[:, 4])


def _pieces(left: float, right: float, wall: Span) -> Iterator[tuple[float, float, float]]:
    """Yield pieces of a stretch, and how far beside each the wall is that it shows."""
    count = math.ceil((right - left) / (wall[1] - wall[0]) - 1e-9)
    for a, b in pairwise(np.linspace(left, right, count + 1).tolist()):
        yield a, b, wall[0] - a
