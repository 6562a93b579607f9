"""A style sheet as a folder: stylesheet.json, the model's own blocks.json, textures/."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..artifacts.blocks import Blocks
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
    sheet: StyleSheet = read_one(str(folder / SHEET), "stylesheet")
    blocks: Blocks = read_one(str(folder / BLOCKS), "blocks")
    names = {face.texture for wall in sheet.walls for face in wall.faces} | {sheet.roof}
    _check(folder, sheet)
    return sheet, blocks, {name: read_photo(str(folder / name)).pixels for name in sorted(names)}


def _check(folder: Path, sheet: StyleSheet) -> None:
    """Refuse references to blocks, groups and rules that the sheet does not hold."""
    place = str(folder / SHEET)
    rules, groups = {rule.id for rule in sheet.rules}, {group.id for group in sheet.groups}
    blocks = {block.id for block in sheet.blocks}
    for i, group in enumerate(sheet.groups):
        if group.rule not in rules:
            raise InvalidInput(f"no rule {group.rule!r}", pointer=f"/groups/{i}/rule").at(place)
    for i, wall in enumerate(sheet.walls):
        if wall.block not in blocks:
            raise InvalidInput(f"no block {wall.block!r}", pointer=f"/walls/{i}/block").at(place)
        for j, face in enumerate(wall.faces):
            if not {face.horizontal, face.vertical} <= groups:
                raise InvalidInput("no such group", pointer=f"/walls/{i}/faces/{j}").at(place)
    for i, rule in enumerate(sheet.rules):
        if len(rule.a) != len(rule.b) + 1 or sum(rule.a) + sum(rule.b) <= 0:
            message = "expected one scalable section more than insertable ones, not all zero"
            raise InvalidInput(message, pointer=f"/rules/{i}").at(place)
