"""A style sheet as a folder: stylesheet.json, the model's own blocks.json, textures/."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path

from ..artifacts.blocks import Blocks
from ..artifacts.building import SIDES
from ..artifacts.store import read_one
from ..artifacts.stylesheet import StyleSheet
from ..artifacts.writing import write_artifact, write_bytes
from ..errors import InvalidInput
from ..imaging.image_io import Picture, encoded, read_photo

SHEET, BLOCKS, TEXTURES = "stylesheet.json", "blocks.json", "textures"


def write_style(
    folder: Path, sheet: StyleSheet, blocks: Blocks, pictures: Mapping[str, Picture]
) -> None:
    """Write a style sheet's files into an existing folder."""
    (folder / TEXTURES).mkdir()
    for name, picture in pictures.items():
        write_bytes(folder / name, encoded(picture, ".png"))
    write_artifact(folder / BLOCKS, blocks)
    write_artifact(folder / SHEET, sheet)


def read_style(folder: Path) -> tuple[StyleSheet, Blocks, dict[str, Picture]]:
    """Return a style sheet with its blocks and pictures.

    Raises InvalidInput where a file is missing or a picture cannot be used. The schema keeps the
    names of pictures inside the folder.
    """
    if not folder.is_dir():
        raise InvalidInput("is no folder; expected a style sheet's").at(str(folder))
    sheet = read_one(folder / SHEET, StyleSheet)
    blocks = read_one(folder / BLOCKS, Blocks)
    names = {face.texture for wall in sheet.walls for face in wall.faces} | {sheet.roof}
    _check(folder, sheet, blocks)
    return sheet, blocks, {name: read_photo(str(folder / name)).pixels for name in sorted(names)}


def _check(folder: Path, sheet: StyleSheet, blocks: Blocks) -> None:
    """Refuse a sheet that breaks a rule, and blocks that are not its own."""
    for pointer, message in sheet_problems(sheet):
        raise InvalidInput(message, pointer=pointer).at(str(folder / SHEET))
    own = {block.id for block in blocks.blocks}
    for block in sheet.blocks:
        if block.id not in own:
            message = f"no block {block.id!r}, which {SHEET} has"
            raise InvalidInput(message, pointer="/blocks").at(str(folder / BLOCKS))


def sheet_problems(sheet: StyleSheet) -> Iterator[tuple[str, str]]:
    """Yield pointer and message of what the schema cannot see: references, order, numbers of."""
    rules = {rule.id for rule in sheet.rules}
    for i, group in enumerate(sheet.groups):
        if group.rule not in rules:
            yield f"/groups/{i}/rule", f"no rule {group.rule!r}"
    for i, rule in enumerate(sheet.rules):
        if len(rule.a) != len(rule.b) + 1 or sum(rule.a) + sum(rule.b) <= 0:
            message = "expected one scalable section more than insertable ones, not all zero"
            yield f"/rules/{i}", message
    yield from _floor_problems(sheet)
    yield from _wall_problems(sheet)


def _floor_problems(sheet: StyleSheet) -> Iterator[tuple[str, str]]:
    blocks = {block.id for block in sheet.blocks}
    for i, floor in enumerate(sheet.floors):
        if floor.block not in blocks:
            yield f"/floors/{i}/block", f"no block {floor.block!r}"
        if floor.bottom >= floor.top:
            yield f"/floors/{i}", "expected its top above its bottom"
        for name, lines in (("xs", floor.xs), ("ys", floor.ys)):
            if any(a >= b for a, b in pairwise(lines)):
                yield f"/floors/{i}/{name}", "expected numbers that increase"
        if [len(row) for row in floor.cells] != [len(floor.xs) - 1] * (len(floor.ys) - 1):
            yield f"/floors/{i}/cells", "expected a cell between every two lines of xs and of ys"
    for block in sorted(blocks - {floor.block for floor in sheet.floors}):
        yield "/floors", f"block {block!r} has none"


def _wall_problems(sheet: StyleSheet) -> Iterator[tuple[str, str]]:
    blocks = {block.id for block in sheet.blocks}
    groups = {group.id: group.direction for group in sheet.groups}
    for i, wall in enumerate(sheet.walls):
        if wall.block not in blocks:
            yield f"/walls/{i}/block", f"no block {wall.block!r}"
        for j, face in enumerate(wall.faces):
            place = f"/walls/{i}/faces/{j}"
            if groups.get(face.horizontal) != "horizontal":
                yield f"{place}/horizontal", f"no such horizontal group: {face.horizontal!r}"
            if groups.get(face.vertical) != "vertical":
                yield f"{place}/vertical", f"no such vertical group: {face.vertical!r}"
            if face.floor >= len(sheet.floors) or sheet.floors[face.floor].block != wall.block:
                yield f"{place}/floor", f"no floor {face.floor} of block {wall.block!r}"
            if face.bottom >= face.top or face.start == face.end:
                yield place, "expected a width, and its top above its bottom"
    sides = Counter((wall.block, wall.side) for wall in sheet.walls)
    for block in sorted(blocks):
        for side in SIDES:
            if sides[block, side] != 1:
                yield "/walls", f"expected one {side} wall of block {block!r}"
