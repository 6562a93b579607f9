"""Bays of relief: windows and columns that stand in the plan are repeated, not widened (eq. 8)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np

from ..artifacts.blocks import Blocks
from ..artifacts.stylesheet import Group, Rule, StyleFace, StyleFloor, StyleSheet
from ..imaging.image_io import Picture
from .columns import FLUSH, common_rule
from .likeness import SIDE, in_line
from .projection import SIDES
from .relief import Bays, Piece, pieces, relief_bays
from .splitting import SplitRule
from .style import Style
from .synthesis import synthesised

LOWEST = 0.5  # m: of a floor in which bays are told apart
SAME = 0.01  # change of size that leaves all as it is
PLAIN = Group("bay", "vertical", "bay")  # of parts of faces: they are stretched with their piece


def with_bays(
    style: Style, chosen: Sequence[str], target: Blocks, rules: Mapping[str, SplitRule]
) -> tuple[Style, list[str]]:
    """Return a style with a block of its own for every target whose relief repeats.

    chosen: ids of the source blocks of the target's blocks. rules: of the groups, by which signs
    are told. Returns the style and the new ids.
    """
    ids = []
    for source, block in zip(chosen, target.blocks, strict=True):
        name = source
        for axis, size in enumerate((block.width, block.depth)):
            style, name = _with_bays(style, name, axis, size, rules)
        ids.append(name)
    return style, ids


def _with_bays(
    style: Style, name: str, axis: int, target: float, rules: Mapping[str, SplitRule]
) -> tuple[Style, str]:
    sheet = style.sheet
    block = next(b for b in sheet.blocks if b.id == name)
    size = block.size[axis]
    numbers = [i for i, floor in enumerate(sheet.floors) if floor.block == name]
    bays = relief_bays([sheet.floors[i] for i in numbers], axis, size)
    if bays is None or abs(target / size - 1) < SAME:
        return style, name
    bays = _with_windows(bays, sheet, name, axis)
    bays = replace(bays, rule=in_line(bays.rule, list(_rows(style, bays, name, axis))))
    found = pieces(bays, size, target)
    signs = {k: rule for k, rule in rules.items() if 0 < len(rule.insertable) == len(rule.once)}
    new = f"{name}/{'xy'[axis]}{len(sheet.blocks)}"
    pictures = dict(style.pictures)
    floors = [replace(_floor(sheet.floors[i], axis, found), block=new) for i in numbers]
    number = {old: len(sheet.floors) + k for k, old in enumerate(numbers)}
    cut = _Cut(bays, found, signs, target, pictures)
    walls = []
    for wall in (wall for wall in sheet.walls if wall.block == name):
        parts = cut.along if SIDES[wall.side][0] == axis else cut.across
        faces = [replace(f, floor=number[f.floor]) for face in wall.faces for f in parts(face)]
        walls.append(replace(wall, block=new, faces=tuple(faces)))
    sizes = tuple(target if k == axis else v for k, v in enumerate(block.size))
    sheet = replace(
        sheet,
        blocks=(*sheet.blocks, replace(block, id=new, size=sizes)),
        floors=(*sheet.floors, *floors),
        walls=(*sheet.walls, *walls),
        groups=sheet.groups if PLAIN in sheet.groups else (*sheet.groups, PLAIN),
        rules=sheet.rules if PLAIN in sheet.groups else (*sheet.rules, Rule(PLAIN.rule, (1.0,))),
    )
    own = next(b for b in style.blocks.blocks if b.id == name)
    blocks = replace(style.blocks, blocks=(*style.blocks.blocks, replace(own, id=new)))
    return replace(style, sheet=sheet, blocks=blocks, pictures=pictures), new


def _with_windows(bays: Bays, sheet: StyleSheet, name: str, axis: int) -> Bays:
    """Return bays that hold the windows painted on the block's walls too, if in line with them."""
    rules = {rule.id: SplitRule(rule.a, rule.b) for rule in sheet.rules}
    of_group = {group.id: rules[group.rule] for group in sheet.groups}
    walls = [w for w in sheet.walls if w.block == name and SIDES[w.side][0] == axis]
    faces = [(wall.side, face) for wall in walls for face in wall.faces]
    faces.sort(key=lambda item: -abs(item[1].end - item[1].start) * (item[1].top - item[1].bottom))
    rule, reach = bays.rule, FLUSH * bays.rule.size
    for side, face in faces:
        low, high = sorted((face.start, face.end))
        own = of_group[face.vertical]
        if max(abs(low - bays.low), abs(high - bays.low - rule.size)) > reach or not own.insertable:
            continue
        if SIDES[side][1] < 0:  # as seen from outside it runs the other way
            own = SplitRule(own.scalable[::-1], own.insertable[::-1])
        both = common_rule(rule, own)
        if both is not None and len(both.insertable) == len(rule.insertable):
            rule = both
    return replace(bays, rule=rule)


def _rows(style: Style, bays: Bays, name: str, axis: int) -> Iterator[Picture]:
    """Yield what can be seen of every floor between the margins of a block, on both sides."""
    for wall in style.sheet.walls:
        if wall.block != name or SIDES[wall.side][0] != axis:
            continue
        floors: dict[int, list[StyleFace]] = {}
        for face in wall.faces:
            floors.setdefault(face.floor, []).append(face)
        for faces in floors.values():
            if faces[0].top - faces[0].bottom >= LOWEST:
                faces.sort(key=lambda face: -SIDES[wall.side][3] * face.place, reverse=True)
                yield _painted(style, bays, faces)


def _painted(style: Style, bays: Bays, faces: Sequence[StyleFace]) -> Picture:
    """Return the faces of a floor between the margins, from the farthest to the nearest."""
    row = np.zeros((SIDE, max(1, round(SIDE * bays.rule.size)), 3), dtype=np.uint8)
    for face in faces:
        low, high = sorted((face.start, face.end))
        a, b = (round(SIDE * (v - bays.low)) for v in (low, high))
        if b <= a:
            continue
        whole = cv2.resize(
            style.pictures[face.texture], (b - a, SIDE), interpolation=cv2.INTER_AREA
        )
        whole = whole if face.end > face.start else whole[:, ::-1]
        first, last = max(a, 0), min(b, row.shape[1])
        if first < last:
            row[:, first:last] = whole[:, first - a : last - a]
    return row


def _floor(floor: StyleFloor, axis: int, found: Sequence[Piece]) -> StyleFloor:
    """Return a floor whose plan is put together of pieces along an axis."""
    lines = np.array(floor.xs if axis == 0 else floor.ys)
    rows = list(floor.cells) if axis == 1 else _turned(floor.cells)
    places, cells = [found[0].new[0]], []
    for piece in found:
        inner = lines[(lines > piece.old[0] + 1e-9) & (lines < piece.old[1] - 1e-9)].tolist()
        for low, high in pairwise([piece.old[0], *inner, piece.old[1]]):
            k = int(np.searchsorted(lines, 0.5 * (low + high))) - 1
            cells.append(rows[k] if 0 <= k < len(rows) else "0" * len(rows[0]))
            places.append(_moved(piece, high))
    if axis == 0:
        return replace(floor, xs=tuple(places), cells=tuple(_turned(cells)))
    return replace(floor, ys=tuple(places), cells=tuple(cells))


def _turned(rows: Sequence[str]) -> list[str]:
    return ["".join(column) for column in zip(*rows, strict=True)]


def _moved(piece: Piece, place: float) -> float:
    (a, b), (c, d) = piece.old, piece.new
    return c + (place - a) / (b - a) * (d - c)


@dataclass(frozen=True)
class _Cut:
    """How the faces of a block are cut into the pieces of another size (target, m).

    signs: rules of the groups that are one sign. pictures: of the style, to which parts are added.
    """

    bays: Bays
    found: Sequence[Piece]
    signs: Mapping[str, SplitRule]
    target: float
    pictures: dict[str, Picture]

    def along(self, face: StyleFace) -> Iterator[StyleFace]:
        """Yield what of a face each piece shows; a sign across all of them is not cut."""
        sign = self.signs.get(face.vertical)
        board = _board(face, sign, self.bays, self.found, self.pictures) if sign else None
        if board is None:
            yield from _along(face, self.found, self.pictures)
        else:
            yield board

    def across(self, face: StyleFace) -> Iterator[StyleFace]:
        """Yield a face across the axis in every piece that it stands in."""
        ends = self.bays.low, self.bays.low + self.bays.rule.size
        return _across(face, self.found, ends, self.target)


def _along(
    face: StyleFace, found: Sequence[Piece], pictures: dict[str, Picture]
) -> Iterator[StyleFace]:
    """Yield what of a face each piece shows; parts of its picture are added to the pictures."""
    low, high = sorted((face.start, face.end))
    for piece in found:
        a, b = max(low, piece.old[0]), min(high, piece.old[1])
        if b - a < 1e-6:
            continue
        whole = b - a > high - low - 1e-6
        ends = _moved(piece, a), _moved(piece, b)
        start, end = ends if face.end > face.start else ends[::-1]
        if whole:
            yield replace(face, start=start, end=end)
            continue
        shares = sorted((edge - face.start) / (face.end - face.start) for edge in (a, b))
        picture = pictures[face.texture]
        first = min(round(shares[0] * picture.shape[1]), picture.shape[1] - 1)
        last = max(round(shares[1] * picture.shape[1]), first + 1)
        name = f"{face.texture}:{first}:{last}"
        pictures[name] = picture[:, first:last]
        yield replace(face, start=start, end=end, texture=name, vertical=PLAIN.id)


def _board(
    face: StyleFace,
    rule: SplitRule,
    bays: Bays,
    found: Sequence[Piece],
    pictures: dict[str, Picture],
) -> StyleFace | None:
    """Return a sign that runs over all bays, its letters not cut; None if it does not reach so far.

    rule: of the sign. Its new picture is added to the pictures.
    """
    low, high = sorted((face.start, face.end))
    first, last = bays.rule.scalable[0], bays.rule.scalable[-1]
    inner = bays.low + first, bays.low + bays.rule.size - last
    if low > inner[0] + 1e-6 or high < inner[1] - 1e-6:
        return None
    ends = [
        next((_moved(p, v) for p in order if p.old[0] - 1e-6 <= v <= p.old[1] + 1e-6), None)
        for v, order in ((low, found), (high, found[::-1]))
    ]
    if ends[0] is None or ends[1] is None:
        return None
    start, end = (ends[0], ends[1]) if face.end > face.start else (ends[1], ends[0])
    old, new, height = high - low, abs(end - start), face.top - face.bottom
    picture = pictures[face.texture]
    name = f"{face.texture}:{new:.6f}"
    rules = (rule, SplitRule((height,)))
    density = picture.shape[1] / old
    drawn = synthesised(picture, rules, (old, height), (new, height), density)
    back = cv2.resize(drawn, (drawn.shape[1], picture.shape[0]))
    pictures[name] = np.asarray(back, dtype=np.uint8)
    return replace(face, start=start, end=end, texture=name, vertical=PLAIN.id)


def _across(
    face: StyleFace, found: Sequence[Piece], ends: tuple[float, float], target: float
) -> Iterator[StyleFace]:
    """Yield a face across the axis in every piece that it stands in; outer walls stand once."""
    if face.place <= ends[0] + 1e-6:
        yield face
        return
    last = found[-1]
    if face.place >= ends[1] - 1e-6:
        yield replace(face, place=target - (last.old[1] - face.place))
        return
    places = {
        round(_moved(piece, face.place), 9)
        for piece in found
        if piece.old[0] - 1e-6 <= face.place <= piece.old[1] + 1e-6
    }
    for place in sorted(places):
        yield replace(face, place=place)
