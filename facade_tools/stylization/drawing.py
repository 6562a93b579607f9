"""Pictures of blocks and style sheets: structure, groups and rules (LNSW13 Figs. 6 to 9)."""

from __future__ import annotations

import colorsys
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np

from ..artifacts.blocks import Blocks
from ..artifacts.stylesheet import StyleFace, StyleSheet, Wall
from ..errors import InvalidInput
from ..formats.style_folder import read_style
from ..geometry.arrays import Floats
from ..geometry.mesh import Material, Mesh, Scene
from ..imaging.image_io import Picture
from .groups import mean_picture
from .labels import variance_signal
from .projection import SIDES
from .splitting import SplitRule
from .style import group_rule
from .synthesis import resized_rule

PANEL = 320  # pixels of the larger side of an elevation
MARGIN = 14
LINE, STRIP = 18, 64  # pixels: of a line of text, of a band
FONT = cv2.FONT_HERSHEY_SIMPLEX
TITLES = {
    "texture": "model",
    "role": "blocks",
    "horizontal": "horizontal groups",
    "vertical": "vertical groups",
}
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


def sheet_picture(sheet: StyleSheet, folder: Path | None = None) -> Picture:
    """Return a style sheet as rows of its four elevations, as in Figs. 3, 6, 8 and 9.

    The model with its textures, its blocks by role, the horizontal and the vertical groups
    (insertable sections darker), and the variance signal of the largest vertical group that has
    windows, with its labels. folder: where its blocks.json and textures are; without it, groups
    alone.
    """
    own, pictures = (None, {}) if folder is None else _beside(folder)
    places = _places(sheet, own)
    kinds = (["texture"] if pictures else []) + ["role", "horizontal", "vertical"]
    rows = []
    for kind in kinds:
        panels = [_padded(_elevation(sheet, places, side, kind, pictures)) for side in SIDES]
        row = np.hstack(panels)
        for number, side in enumerate(SIDES):
            place = (number * (PANEL + 2 * MARGIN) + MARGIN, LINE)
            cv2.putText(row, f"{TITLES[kind]}, {side}", place, FONT, 0.42, INK, 1, cv2.LINE_AA)
        rows.append(row)
    if pictures:
        rows.append(_signal(sheet, pictures, rows[0].shape[1]))
    return np.vstack(rows)


def _beside(folder: Path) -> tuple[Blocks | None, dict[str, Picture]]:
    try:
        _, blocks, pictures = read_style(folder)
    except InvalidInput:  # the sheet alone: nothing but its groups can be drawn
        return None, {}
    return blocks, pictures


def _places(sheet: StyleSheet, own: Blocks | None) -> dict[str, Floats]:
    """Return the corners (2, 3) of every block; without blocks they are stacked in their order."""
    if own is not None:
        known = {block.id: block for block in own.blocks}
        low = {k: np.array([b.x, b.y, b.z]) for k, b in known.items()}
        return {
            b.id: np.array([low[b.id], low[b.id] + np.array(b.size)])
            for b in sheet.blocks
            if b.id in low
        }
    heights = np.cumsum([0.0, *(block.size[2] for block in sheet.blocks)])
    middle = np.max([block.size[:2] for block in sheet.blocks], axis=0)
    return {
        block.id: np.array([[*(0.5 * (middle - block.size[:2])), z]])
        + np.array([[0.0, 0.0, 0.0], block.size])
        for block, z in zip(sheet.blocks, heights[:-1].tolist(), strict=True)
    }


def _padded(panel: Picture) -> Picture:
    size = PANEL + 2 * MARGIN
    out = np.full((size + LINE, size, 3), WHITE, dtype=np.uint8)
    h, w = panel.shape[:2]
    out[size + LINE - MARGIN - h : size + LINE - MARGIN, MARGIN : MARGIN + w] = panel
    return out


def _elevation(
    sheet: StyleSheet,
    places: Mapping[str, Floats],
    side: str,
    kind: str,
    pictures: Mapping[str, Picture],
) -> Picture:
    """Return one side as seen from outside, far faces first."""
    along, step, depth, sign = SIDES[side]
    low = np.min([box[0] for box in places.values()], axis=0)
    high = np.max([box[1] for box in places.values()], axis=0)
    scale = PANEL / max(high[along] - low[along], high[2] - low[2])
    rows = max(1, round(float(high[2] - low[2]) * scale))
    columns = max(1, round(float(high[along] - low[along]) * scale))
    picture = np.full((rows, columns, 3), WHITE, dtype=np.uint8)
    faces = [
        (wall, face, places[wall.block][0])
        for wall in sheet.walls
        if wall.side == side and wall.block in places
        for face in wall.faces
    ]
    faces.sort(key=lambda item: sign * (item[2][depth] + item[1].place))
    origin = low[along] if step > 0 else high[along]
    for wall, face, corner in faces:
        ends = step * (corner[along] + np.array([face.start, face.end]) - origin) * scale
        heights = (corner[2] + np.array([face.bottom, face.top]) - low[2]) * scale
        x0, x1 = round(float(ends[0])), max(round(float(ends[1])), round(float(ends[0])) + 1)
        z0, z1 = (
            round(float(heights[0])),
            max(round(float(heights[1])), round(float(heights[0])) + 1),
        )
        area = picture[max(rows - z1, 0) : rows - z0, max(x0, 0) : x1]
        if area.size:
            area[:] = _painted(sheet, wall, face, kind, pictures, area.shape[:2])
            if kind != "texture":
                cv2.rectangle(picture, (x0, rows - z1), (x1 - 1, rows - z0 - 1), INK, 1)
    return picture


def _pixels(line: Floats) -> tuple[int, int]:
    """Return first pixel and end of a stretch, at least one pixel long."""
    first, last = (round(float(v)) for v in line)
    return first, max(last, first + 1)


def _painted(
    sheet: StyleSheet,
    wall: Wall,
    face: StyleFace,
    kind: str,
    pictures: Mapping[str, Picture],
    shape: tuple[int, int],
) -> Picture:
    """Return what a face looks like in a drawing of one kind, (h, w, 3)."""
    if kind == "texture":
        size = shape[1], shape[0]
        small = cv2.resize(pictures[face.texture], size, interpolation=cv2.INTER_AREA)
        return np.asarray(small, dtype=np.uint8).reshape(*shape, 3)
    if kind == "role":
        role = next(block.role for block in sheet.blocks if block.id == wall.block)
        color = tuple(int(ROLE_COLORS[role][k : k + 2], 16) for k in (1, 3, 5))
        return np.full((*shape, 3), color, dtype=np.uint8)
    name = face.vertical if kind == "vertical" else face.horizontal
    number = int(name[1:])
    picture = np.full((*shape, 3), _color(number, 0.93), dtype=np.uint8)
    picture[_windows(sheet, face, shape[1], shape[0])] = _color(number, 0.6)
    return picture


def _windows(sheet: StyleSheet, face: StyleFace, columns: int, rows: int) -> Picture:
    """Return where an insertable column meets an insertable row (rows, columns), boolean."""
    across = _inside(group_rule(sheet, face.vertical), abs(face.end - face.start), columns)
    down = _inside(group_rule(sheet, face.horizontal), face.top - face.bottom, rows)
    return np.asarray(down[:, None] & across[None])


def _inside(rule: SplitRule, size: float, pixels: int) -> Picture:
    own = resized_rule(rule, size)
    widths = [0.0] * (2 * len(own.insertable) + 1)
    widths[::2], widths[1::2] = own.scalable, own.insertable
    centres = (np.arange(pixels) + 0.5) / max(pixels, 1) * size
    return np.asarray(np.searchsorted(np.cumsum(widths), centres, side="right") % 2 == 1)


def _signal(sheet: StyleSheet, pictures: Mapping[str, Picture], width: int) -> Picture:
    """Return signal, mean texture and labels of the largest group that has windows (Fig. 9)."""
    members: dict[str, list[StyleFace]] = {}
    for wall in sheet.walls:
        for face in wall.faces:
            members.setdefault(face.vertical, []).append(face)
    areas = {
        k: sum(abs(f.end - f.start) * (f.top - f.bottom) for f in faces)
        for k, faces in members.items()
    }
    name = max(areas, key=lambda k: (bool(group_rule(sheet, k).insertable), areas[k]))
    mean = mean_picture([pictures[face.texture] for face in members[name]], 0)
    columns = width - 2 * MARGIN
    signal = variance_signal(mean, 0)
    strip = np.full((2 * LINE + 3 * STRIP, width, 3), WHITE, dtype=np.uint8)
    title = f"vertical group {name}: variance of its columns, mean texture, scalable and insertable"
    cv2.putText(strip, title, (MARGIN, LINE), FONT, 0.42, INK, 1, cv2.LINE_AA)
    x = MARGIN + np.arange(columns)
    places = (np.arange(columns) * len(signal)) // columns
    y = 2 * LINE + STRIP - 4 - np.round(signal[places] * (STRIP - 8)).astype(int)
    cv2.polylines(strip, [np.stack([x, y], axis=1).astype(np.int32)], False, INK, 1, cv2.LINE_AA)
    texture = cv2.resize(np.round(255 * mean).astype(np.uint8), (columns, STRIP))
    top = 2 * LINE + STRIP
    strip[top : top + STRIP, MARGIN : MARGIN + columns] = texture
    size = max(abs(face.end - face.start) for face in members[name])
    labels = _inside(group_rule(sheet, name), size, columns)
    colors = np.where(labels[:, None], (226, 138, 52), (86, 124, 178))
    strip[top + STRIP : top + STRIP + STRIP // 2, MARGIN : MARGIN + columns] = colors
    return strip


def _color(number: int, value: float) -> tuple[int, int, int]:
    r, g, b = colorsys.hsv_to_rgb((number * 0.618034) % 1.0, 0.35, value)
    return round(255 * r), round(255 * g), round(255 * b)
