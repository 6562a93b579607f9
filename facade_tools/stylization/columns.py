"""Columns of windows that stand above one another stay so: groups of a side with one rule.

Beyond the paper, whose groups are resized each by its own rule: shops and the windows above them
part where the counts of eq. 8 or the walls between them differ.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..artifacts.blocks import Blocks
from ..artifacts.stylesheet import StyleSheet
from ..imaging.image_io import Picture
from .likeness import in_line, standing_once
from .projection import SIDES
from .splitting import SplitRule

FLUSH = 0.01  # of the width: how far the ends of faces above one another may part
COARSER = 2  # windows that may become one section
LOWEST = 0.5  # m: of a group with windows; lower ones are plinths and mouldings
LEAST_WALL = 0.1  # of a face, that has to stay scalable


@dataclass(frozen=True, slots=True)
class _Stack:
    """A group's widest face: its side, its ends (m) from left to right, and the group's area."""

    group: str
    side: str
    start: float
    end: float
    area: float


def aligned_rules(
    sheet: StyleSheet, own: Blocks, pictures: Mapping[str, Picture]
) -> dict[str, SplitRule]:
    """Return the rule of every group, for groups whose windows stand in line a common one.

    own: the style's own blocks. Groups of a side are joined, the largest first, where their faces
    have the same ends and what is insertable in one or the other leaves walls between sections.
    What stands once in the pictures of a group is not inserted a second time; a group that is all
    that (a sign) joins no other.
    """
    known = {rule.id: SplitRule(rule.a, rule.b) for rule in sheet.rules}
    rules = {group.id: known[group.rule] for group in sheet.groups}
    rows = _rows(sheet, pictures)
    rules |= {group: standing_once(rules[group], shown) for group, shown in rows.items()}
    joined: list[list[_Stack]] = []
    for stack in sorted(_stacks(sheet, own), key=lambda s: (-s.area, s.group)):
        rule, high = rules[stack.group], stack.area >= LOWEST * (stack.end - stack.start)
        if high and len(rule.insertable) > len(rule.once):
            _join(stack, joined, rules)
    for members in joined:
        if len(members) > 1:
            common = in_line(rules[members[0].group], [rows[m.group] for m in members])
            rules.update({member.group: common for member in members})
    return rules


def _rows(sheet: StyleSheet, pictures: Mapping[str, Picture]) -> dict[str, Picture]:
    """Return the picture of the largest face of every vertical group with windows."""
    insertable = {rule.id for rule in sheet.rules if rule.b}
    groups = {group.id for group in sheet.groups if group.rule in insertable}
    largest: dict[str, tuple[float, str]] = {}
    for wall in sheet.walls:
        for face in wall.faces:
            area = abs(face.end - face.start) * (face.top - face.bottom)
            if face.vertical in groups and area > largest.get(face.vertical, (0.0, ""))[0]:
                largest[face.vertical] = area, face.texture
    return {group: pictures[texture] for group, (_, texture) in largest.items()}


def _join(stack: _Stack, joined: list[list[_Stack]], rules: dict[str, SplitRule]) -> None:
    """Put a group with the first others that it stands in line with; they all share a rule."""
    for members in joined:
        first = members[0]
        reach = FLUSH * (first.end - first.start)
        same = (
            first.side == stack.side
            and max(abs(first.start - stack.start), abs(first.end - stack.end)) <= reach
        )
        common = common_rule(rules[first.group], rules[stack.group]) if same else None
        if common is not None:
            members.append(stack)
            rules.update({member.group: common for member in members})
            return
    joined.append([stack])


def _stacks(sheet: StyleSheet, own: Blocks) -> list[_Stack]:
    corner = {block.id: (block.x, block.y) for block in own.blocks}
    found: dict[str, _Stack] = {}
    areas: dict[str, float] = {}
    for wall in sheet.walls:
        along, direction, _, _ = SIDES[wall.side]
        for face in wall.faces:
            start, end = (
                direction * (corner[wall.block][along] + v) for v in (face.start, face.end)
            )
            areas[face.vertical] = areas.get(face.vertical, 0.0) + (end - start) * (
                face.top - face.bottom
            )
            widest = found.get(face.vertical)
            if widest is None or end - start > widest.end - widest.start:
                found[face.vertical] = _Stack(face.vertical, wall.side, start, end, 0.0)
    return [_Stack(s.group, s.side, s.start, s.end, areas[name]) for name, s in found.items()]


def common_rule(a: SplitRule, b: SplitRule) -> SplitRule | None:
    """Return the rule whose sections hold the windows of both rules; None if they do not align.

    They do where walls stay between the sections, none of the coarser rule's windows grow
    together, and a section holds a few windows of the finer one at most.
    """
    size = a.size
    windows = [*_windows(a, 1.0), *_windows(b, size / b.size)]
    sections: list[tuple[float, float]] = []
    for start, end in sorted(windows):
        if sections and start <= sections[-1][1] + 1e-9:
            sections[-1] = (sections[-1][0], max(end, sections[-1][1]))
        else:
            sections.append((start, end))
    fewer, more = sorted((len(a.insertable), len(b.insertable)))
    enough = max(fewer, math.ceil(more / COARSER), min(more, 2))
    borders = [0.0, *itertools.chain.from_iterable(sections), size]
    widths = [max(v - u, 0.0) for u, v in itertools.pairwise(borders)]
    walls = widths[::2]
    if len(sections) < enough or sum(walls) < LEAST_WALL * size:
        return None
    return SplitRule(tuple(walls), tuple(widths[1::2]))


def _windows(rule: SplitRule, factor: float) -> list[tuple[float, float]]:
    """Return where a rule's windows start and end (m), times a factor."""
    place, found = 0.0, []
    for wall, window in zip(rule.scalable[:-1], rule.insertable, strict=True):
        place += factor * wall
        found.append((place, place + factor * window))
        place += factor * window
    return found
