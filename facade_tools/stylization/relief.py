"""How the relief of a block repeats along an axis: bays, between walls in its usual plane.

The rule of a block's axis comes from the depths of its plans as the rule of a face comes from the
colours of its picture: where walls stand before or behind their usual plane is insertable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..artifacts.stylesheet import StyleFloor
from ..geometry.arrays import Booleans, Floats
from .groups import LEAST_WALL, MULLION
from .labels import insertable_labels, merged, rule_of
from .splitting import SplitRule, end_wall, split

OFF = 0.02  # m: what stands off its plane by more is relief
SHARE = 0.15  # of the height that has relief somewhere, for a block to have bays
FINE, MOST = 0.02, 4000  # m: places of the depth signal, and how many at most
NARROWEST, WIDEST = 0.2, 8.0  # m: of a bay; wider relief is a wing, and stretches with its block
CORNERS = 0.2  # of a wall in the plane of its corners, for that to be its plane
CORNER = 0.01  # m: relief nearer to a corner is the corner's
PATIENCE = 0.5, 1.5  # least and most that the walls beside bays take: their pictures stretch, too


@dataclass(frozen=True, slots=True)
class Piece:
    """A stretch of the source (m) and where it goes in the result (m), both along one axis."""

    old: tuple[float, float]
    new: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Bays:
    """How a block repeats along an axis: a rule between two margins (m) that keep their size."""

    low: float
    rule: SplitRule
    high: float


def relief_bays(floors: Sequence[StyleFloor], axis: int, size: float) -> Bays | None:
    """Return how a block's relief repeats along an axis, None where it does not.

    axis: 0 for x, 1 for y. size: of the block along it (m).
    """
    height = sum(floor.top - floor.bottom for floor in floors)
    count = min(max(8, round(size / FINE)), MOST)
    places = (np.arange(count) + 0.5) * size / count
    relief = np.zeros(count)
    for floor in floors:
        relief += (floor.top - floor.bottom) * _off_plane(floor, axis, places)
    if relief.max() < SHARE * height:
        return None
    labels = insertable_labels(relief / relief.max())
    labels = merged(labels, 2 * NARROWEST / size * count, MULLION / size * count)
    lines = [floor.xs if axis == 0 else floor.ys for floor in floors]
    rule = _snapped(rule_of(labels, size), np.unique(np.concatenate(lines)), 2 * size / count)
    if not rule.insertable or max(rule.insertable) > WIDEST:
        return None
    low, high = max(line[0] for line in lines), max(size - line[-1] for line in lines)
    first, *inner, last = rule.scalable
    if first - low < CORNER or last - high < CORNER or sum(rule.scalable) < LEAST_WALL * size:
        return None  # a chamfer or a wing, or some floor is narrower: no bay can stand there
    return Bays(low, SplitRule((first - low, *inner, last - high), rule.insertable), high)


def _snapped(rule: SplitRule, lines: Floats, reach: float) -> SplitRule:
    """Move the borders between sections to lines of the plans within reach (m)."""
    widths = np.empty(2 * len(rule.insertable) + 1)
    widths[::2], widths[1::2] = rule.scalable, rule.insertable
    borders = np.cumsum(widths)[:-1]
    nearest = lines[np.abs(lines[None] - borders[:, None]).argmin(axis=1)]
    borders = np.where(np.abs(nearest - borders) <= reach, nearest, borders)
    exact = np.diff(np.concatenate([[0.0], np.maximum.accumulate(borders), [rule.size]]))
    return SplitRule(tuple(exact[::2].tolist()), tuple(exact[1::2].tolist()))


def _off_plane(floor: StyleFloor, axis: int, places: Floats) -> Booleans:
    """Return where a floor's front or back stands off its plane."""
    lines, across = (np.array(v) for v in ((floor.xs, floor.ys), (floor.ys, floor.xs))[axis])
    cells = np.array([[c == "1" for c in row] for row in floor.cells], dtype=bool)
    cells = cells if axis == 0 else cells.T  # (across, along)
    column = np.clip(np.searchsorted(lines, places) - 1, 0, len(lines) - 2)
    filled = cells.any(axis=0)
    off = np.zeros(len(lines) - 1, dtype=bool)
    for depths in (
        across[:-1][cells.argmax(axis=0)],
        across[1:][::-1][cells[::-1].argmax(axis=0)],
    ):
        widths = np.diff(lines) * filled
        off |= np.abs(depths - _plane(depths, widths)) > OFF
    inside = (places > lines[0]) & (places < lines[-1])
    return np.asarray(inside & (off & filled)[column])


def _plane(depths: Floats, widths: Floats) -> float:
    """Return the depth of a wall's plane: that of its corners, or of most of it.

    Corners stand in it unless hardly anything else does (then they are pilasters); wide doors may
    take more of a wall than the piers between them.
    """
    shares = [float(widths[np.abs(depths - d) < OFF].sum()) for d in depths.tolist()]
    filled = np.flatnonzero(widths)
    corners = [int(filled[0]), int(filled[-1])]
    best = max(corners, key=shares.__getitem__)
    if shares[best] < CORNERS * widths.sum():
        best = int(np.argmax(shares))
    return float(depths[best])


def pieces(bays: Bays, size: float, target: float) -> list[Piece]:
    """Return the pieces, in order, of a block whose size (m) becomes the target's."""
    done = split(bays.rule, max(target - bays.low - bays.high, 1e-3), PATIENCE)
    widths = np.empty(2 * len(bays.rule.insertable) + 1)
    widths[::2], widths[1::2] = bays.rule.scalable, bays.rule.insertable
    starts = bays.low + np.concatenate([[0.0], np.cumsum(widths)])
    borders = bays.low + np.concatenate([[0.0], np.cumsum(done.sizes)])
    found = [Piece((0.0, bays.low), (0.0, bays.low))]
    for k, (a, b) in zip(done.sources, pairwise(borders.tolist()), strict=True):
        found.append(Piece((float(starts[k]), float(starts[k + 1])), (a, b)))
    end, last = end_wall(bays.rule, done), found[-1]
    if end != done.sources[-1]:
        halves = [(x + y) / 2 for x, y in (last.old, (starts[end], starts[end + 1]), last.new)]
        found[-1] = Piece((last.old[0], halves[0]), (last.new[0], halves[2]))
        found.append(Piece((float(halves[1]), float(starts[end + 1])), (halves[2], last.new[1])))
    found.append(Piece((size - bays.high, size), (target - bays.high, target)))
    return [p for p in found if min(p.old[1] - p.old[0], p.new[1] - p.new[0]) > 1e-9]
