"""A style: what a capture makes and what a retarget takes the look from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..artifacts.blocks import Blocks
from ..artifacts.stylesheet import StyleSheet
from ..imaging.image_io import Picture
from .splitting import SplitRule


@dataclass(frozen=True, slots=True)
class Style:
    """A style sheet, the source's own blocks, and the sheet's pictures by file name."""

    sheet: StyleSheet
    blocks: Blocks
    pictures: Mapping[str, Picture]


def group_rule(sheet: StyleSheet, group: str) -> SplitRule:
    """Return the splitting rule of a group of faces."""
    name = next(g.rule for g in sheet.groups if g.id == group)
    rule = next(r for r in sheet.rules if r.id == name)
    return SplitRule(rule.a, rule.b)
