"""Faces of the source put onto the target, and what of them can be seen."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.stylesheet import StyleBlock, StyleFace, StyleSheet
from ..geometry.arrays import Booleans, Floats, Rectangles
from .placed import TOUCH, Placed, face_corners
from .projection import SIDES
from .remesh import Slab
from .splitting import SplitRule
from .storeys import LEAST_STOREY

SMALL = 0.05  # of a side's area: groups below it take the texture of a large one
FRAGMENT = 0.5  # of its block: a lower slab may be part of a storey
STEP = 1.0  # m: below which a ground floor begins
ALIGNED = 0.9  # shared width over the larger one, for two faces to stand on each other


@dataclass(frozen=True, slots=True)
class Panel:
    """A face of the result.

    corners (4, 3): lower left, lower right, upper right, upper left as seen from outside.
    source, target: width and height (m) before and after. rules: for columns and for rows.
    seen (k, 4): what of it is not hidden, as left, bottom, right, top in shares of the face.
    shift (k,): how far beside each of them the part of the picture lies that it shows, in shares.
    """

    block: int
    side: str
    corners: Floats
    texture: str
    group: str
    source: tuple[float, float]
    target: tuple[float, float]
    rules: tuple[SplitRule, SplitRule]
    seen: Floats
    shift: Floats


def panels(
    sheet: StyleSheet,
    placed: Sequence[Placed],
    slabs: Sequence[list[Slab]],
    aligned: Mapping[str, SplitRule] | None = None,
    grounded: Collection[str] = (),
) -> list[Panel]:
    """Return the visible faces of placed blocks; slabs: the plans of each block's storeys.

    aligned: rules of groups that stand in for the sheet's own. grounded: ids of the source blocks
    that stand on the ground.
    """
    rules = {rule.id: SplitRule(rule.a, rule.b) for rule in sheet.rules}
    of_group = {group.id: rules[group.rule] for group in sheet.groups} | dict(aligned or {})
    walls: dict[tuple[str, int], list[tuple[str, StyleFace]]] = {}
    for wall in sheet.walls:
        for face in wall.faces:
            walls.setdefault((wall.block, face.floor), []).append((wall.side, face))
    found = []
    ground = min((item.target.z for item in placed), default=0.0)
    for index, item in enumerate(placed):
        stands = item.source.id in grounded and item.target.z < ground + TOUCH
        others = [slab for k, own in enumerate(slabs) if k != index for slab in own]
        for storey in item.storeys:
            members = walls.get((item.source.id, storey.floor), [])
            for side, face in _widest(members) if storey.boxed else members:
                corners = face_corners(item, storey, face, side)
                rows = _rows(of_group[face.horizontal], face, item.source, stands)
                used = (of_group[face.vertical], rows)
                panel = _panel(index, side, corners, face, used)
                if panel is not None and len(seen := _seen(panel, others)):
                    found.append(replace(panel, seen=seen, shift=np.zeros(len(seen))))
    return found


def _rows(rule: SplitRule, face: StyleFace, block: StyleBlock, stands: bool) -> SplitRule:
    """Return the rule by which a face is split into rows.

    A slab that is a fragment of a storey has no storeys to repeat; on the ground the lowest row,
    of shops and doors, stands once, and so do cornice and plinth of every face. stands: is the
    block on the ground, here and in the source?
    """
    height, count = face.top - face.bottom, len(rule.insertable)
    if height < LEAST_STOREY and height < FRAGMENT * block.size[2]:
        return SplitRule((rule.size,))
    lowest = face.bottom < STEP and (block.role == "bottom" or (stands and count > 1))
    return replace(rule, once=(count - 1,) if lowest and count else (), ends=True)


def _widest(members: Sequence[tuple[str, StyleFace]]) -> list[tuple[str, StyleFace]]:
    """Return the widest face of every side; a side without any takes that of another."""
    ordered = sorted(members, key=lambda member: -abs(member[1].end - member[1].start))
    best = dict(reversed(ordered))
    return [(side, best.get(side, ordered[0][1])) for side in SIDES] if ordered else []


def _panel(
    block: int, side: str, corners: Floats, face: StyleFace, rules: tuple[SplitRule, SplitRule]
) -> Panel | None:
    """Return a face as a panel, None where it is squeezed to nothing."""
    source = (abs(face.end - face.start), face.top - face.bottom)
    along, direction, _, _ = SIDES[side]
    width = direction * float(corners[1, along] - corners[0, along])
    target = (width, float(corners[2, 2] - corners[1, 2]))
    if min(target) <= TOUCH or min(source) <= 0:
        return None
    whole = np.array([[0.0, 0.0, 1.0, 1.0]])
    return Panel(
        block, side, corners, face.texture, face.vertical, source, target, rules, whole, np.zeros(1)
    )


def _seen(panel: Panel, others: Sequence[Slab]) -> Floats:
    """Return the rectangles (k, 4) of a panel that no other block's slab covers, in shares."""
    along, _, depth, sign = SIDES[panel.side]
    (left, right), place = panel.corners[:2, along], panel.corners[0, depth] + sign * 1e-4
    bottom, top = panel.corners[0, 2], panel.corners[2, 2]
    low, high = sorted((float(left), float(right)))
    covers = [
        (a, slab.bottom, b, slab.top)
        for slab in others
        if slab.bottom < top - TOUCH and slab.top > bottom + TOUCH
        for a, b in _stretches(slab, depth, place, low, high)
    ]
    if not covers:
        return panel.seen
    boxes = np.array(covers)
    us, vs = (
        np.unique(np.clip([*ends, *boxes[:, k::2].ravel()], *ends))
        for k, ends in enumerate(((low, high), (bottom, top)))
    )
    hidden = raster(boxes, us, vs)
    us = (us - left) / (right - left)
    vs = (vs - bottom) / (top - bottom)
    open_ = [(us[a], vs[r], us[b], vs[q]) for r, q, a, b in rectangles(~hidden)]
    seen = np.array(open_).reshape(-1, 4)
    return seen if right > left else seen[:, [2, 1, 0, 3]]


def _stretches(
    slab: Slab, depth: int, place: float, low: float, high: float
) -> Iterator[tuple[float, float]]:
    """Yield where a slab's plan covers the line at `place` between low and high."""
    across, along = (slab.ys, slab.xs) if depth == 1 else (slab.xs, slab.ys)
    row = int(np.searchsorted(across, place)) - 1
    if not 0 <= row < len(across) - 1 or along[0] > high or along[-1] < low:
        return
    line = slab.cells[row] if depth == 1 else slab.cells[:, row]
    padded = np.concatenate([[False], line, [False]])
    for a, b in np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2):
        yield float(along[a]), float(along[b])


def raster(boxes: Rectangles, us: Floats, vs: Floats) -> Booleans:
    """Return which cells between lines (columns us, rows vs) lie in one of the boxes (k, 4)."""
    u, v = 0.5 * (us[1:] + us[:-1]), 0.5 * (vs[1:] + vs[:-1])
    out = np.zeros((len(v), len(u)), dtype=bool)
    for a, b, c, d in boxes.tolist():
        out |= ((v > b) & (v < d))[:, None] & ((u > a) & (u < c))[None]
    return out


def rectangles(mask: Booleans) -> Iterator[tuple[int, int, int, int]]:
    """Yield rectangles (first row, last, first column, last; exclusive) that tile a mask.

    Equal runs in successive rows are one rectangle.
    """
    open_: dict[tuple[int, int], int] = {}
    for row in range(len(mask) + 1):
        line = mask[row] if row < len(mask) else np.zeros_like(mask[0])
        padded = np.concatenate([[False], line, [False]])
        edges = np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2).tolist()
        runs = {(a, b) for a, b in edges}
        for run in [run for run in open_ if run not in runs]:
            yield open_.pop(run), row, *run
        for run in sorted(runs):
            open_.setdefault(run, row)


def reassigned(found: Sequence[Panel], foreign: Sequence[int], small: float = SMALL) -> list[Panel]:
    """Give panels of small groups the texture of a large group below or above (5.2.2).

    foreign: blocks that do not stand on their neighbours as in the source; only their panels
    change. small: share of a side's area below which a group is small.
    """
    areas: dict[tuple[str, str], float] = {}
    sides: dict[str, float] = {}
    for panel in found:
        area = panel.target[0] * panel.target[1]
        key = (panel.side, panel.group)
        areas[key] = areas.get(key, 0.0) + area
        sides[panel.side] = sides.get(panel.side, 0.0) + area

    def large(panel: Panel) -> bool:
        return areas[panel.side, panel.group] >= small * sides[panel.side]

    givers = [panel for panel in found if large(panel)]
    result = []
    for panel in found:
        donors = []
        if panel.block in foreign and not large(panel):
            donors = [g for g in givers if g.block != panel.block and _in_line(g, panel)]
        if donors:
            best = min(donors, key=lambda g: abs(g.corners[0, 2] - panel.corners[0, 2]))
            panel = replace(
                panel, texture=best.texture, group=best.group, source=best.source, rules=best.rules
            )
        result.append(panel)
    return result


def _in_line(a: Panel, b: Panel) -> bool:
    """Tell whether two panels of a side stand above one another."""
    if a.side != b.side:
        return False
    along = SIDES[a.side][0]
    (a0, a1), (b0, b1) = (sorted(panel.corners[:2, along].tolist()) for panel in (a, b))
    return bool(min(a1, b1) - max(a0, b0) > ALIGNED * max(a1 - a0, b1 - b0))
