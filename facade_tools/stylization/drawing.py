"""Pictures of blocks and style sheets: structure, groups and rules (LNSW13 Figs. 6 to 9)."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np

from ..artifacts.blocks import Blocks
from ..artifacts.stylesheet import StyleFace, StyleSheet, Wall
from ..geometry.mesh import Material, Mesh, Scene
from ..imaging.image_io import Picture
from .projection import SIDES
from .splitting import SplitRule
from .synthesis import resized_rule

PANEL = 320  # pixels of the larger side of an elevation
MARGIN = 14
WHITE = (252, 251, 248)
INK = (60, 60, 60)
ROLE_COLORS = {"bottom": "#a9745b", "body": "#d9c7a3", "top": "#7f9bb3"}
CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=np.float64)
BOX_SIDES = (
    (0, 2, 3, 1),
    (4, 5, 7, 6),
    (0, 1, 5, 4),
    (1, 3, 7, 5),
    (3, 2, 6, 7),
    (2, 0, 4, 6),
)


def blocks_scene(blocks: Blocks) -> Scene:
    """Return the blocks as plain boxes, coloured by role."""
    faces = np.array([t for a, b, c, d in BOX_SIDES for t in ((a, b, c), (a, c, d))])
    meshes = tuple(
        Mesh(
            block.id,
            np.array([block.x, block.y, block.z])
            + CORNERS * np.array([block.width, block.depth, block.height]),
            faces.astype(np.int64),
            block.role,
        )
        for block in blocks.blocks
    )
    materials = {role: Material(role, color) for role, color in ROLE_COLORS.items()}
    return Scene(blocks.id, meshes, materials)


def sheet_picture(sheet: StyleSheet) -> Picture:
    """Return the four elevations of a style sheet, above by vertical, below by horizontal group.

    Colours are groups; insertable sections are darker. Blocks are stacked by their order.
    """
    rows = []
    for direction in ("vertical", "horizontal"):
        panels = [_elevation(sheet, side, direction) for side in SIDES]
        rows.append(np.hstack([_padded(panel) for panel in panels]))
    return np.vstack(rows)


def _padded(panel: Picture) -> Picture:
    size = PANEL + 2 * MARGIN
    out = np.full((size, size, 3), WHITE, dtype=np.uint8)
    h, w = panel.shape[:2]
    out[size - MARGIN - h : size - MARGIN, MARGIN : MARGIN + w] = panel
    return out


def _elevation(sheet: StyleSheet, side: str, direction: str) -> Picture:
    walls = [wall for wall in sheet.walls if wall.side == side]
    along = SIDES[side][0]
    width = max(block.size[along] for block in sheet.blocks)
    height = sum(block.size[2] for block in sheet.blocks)
    scale = PANEL / max(width, height)
    shape = (max(1, round(height * scale)), max(1, round(width * scale)), 3)
    picture = np.full(shape, WHITE, dtype=np.uint8)
    bottoms = _bottoms(sheet)
    for wall in walls:
        block = next(b for b in sheet.blocks if b.id == wall.block)
        left = 0.5 * (width - block.size[along])
        for face in _back_to_front(wall):
            _draw_face(picture, sheet, wall, face, (left, bottoms[wall.block], scale), direction)
    return picture


def _bottoms(sheet: StyleSheet) -> dict[str, float]:
    heights = np.cumsum([0.0, *(block.size[2] for block in sheet.blocks)])
    return {block.id: float(z) for block, z in zip(sheet.blocks, heights[:-1], strict=True)}


def _back_to_front(wall: Wall) -> list[StyleFace]:
    sign = SIDES[wall.side][3]
    return sorted(wall.faces, key=lambda face: sign * face.place)


def _draw_face(
    picture: Picture,
    sheet: StyleSheet,
    wall: Wall,
    face: StyleFace,
    origin: tuple[float, float, float],
    direction: str,
) -> None:
    left, bottom, scale = origin
    along, step, _, _ = SIDES[wall.side]
    size = next(b for b in sheet.blocks if b.id == wall.block).size[along]
    start = face.start if step > 0 else size - face.start
    x0, y1 = round((left + start) * scale), round((bottom + face.bottom) * scale)
    x1 = max(x0 + 1, round((left + start + abs(face.end - face.start)) * scale))
    y0 = max(y1 + 1, round((bottom + face.top) * scale))
    h = picture.shape[0]
    area = picture[h - y0 : h - y1, x0:x1]
    name = face.vertical if direction == "vertical" else face.horizontal
    area[:] = _color(int(name[1:]), 0.93)
    dark = _windows(sheet, face, area.shape[1], area.shape[0])
    area[dark[: area.shape[0], : area.shape[1]]] = _color(int(name[1:]), 0.6)
    cv2.rectangle(picture, (x0, h - y0), (x1 - 1, h - y1 - 1), INK, 1)


def _windows(sheet: StyleSheet, face: StyleFace, columns: int, rows: int) -> Picture:
    """Return where an insertable column meets an insertable row (rows, columns), boolean."""
    rules = {group.id: group.rule for group in sheet.groups}
    of = {rule.id: SplitRule(rule.a, rule.b) for rule in sheet.rules}
    across = _inside(of[rules[face.vertical]], abs(face.end - face.start), columns)
    down = _inside(of[rules[face.horizontal]], face.top - face.bottom, rows)
    return np.asarray(down[:, None] & across[None])


def _inside(rule: SplitRule, size: float, pixels: int) -> Picture:
    own = resized_rule(rule, size)
    widths = [0.0] * (2 * len(own.insertable) + 1)
    widths[::2], widths[1::2] = own.scalable, own.insertable
    centres = (np.arange(pixels) + 0.5) / max(pixels, 1) * size
    return np.asarray(np.searchsorted(np.cumsum(widths), centres, side="right") % 2 == 1)


def _color(number: int, value: float) -> tuple[int, int, int]:
    r, g, b = colorsys.hsv_to_rgb((number * 0.618034) % 1.0, 0.35, value)
    return round(255 * r), round(255 * g), round(255 * b)
