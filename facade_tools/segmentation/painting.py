"""Pictures of random facades, rendered with random light, materials, occluders and blur.

The default classifier learns from these alone: nothing in them comes from a photograph.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.grammar import Grammar, Node
from ..artifacts.parse import LABELS
from ..grammar.derivation import leaves, nodes
from ..grammar.sampling import sample_derivation
from ..imaging.features import Picture
from .augmentation import relit
from .autocontext import Labels

Canvas = NDArray[np.float32]  # (height, width, 3) shares of full light
Color = NDArray[np.float32]  # (3,)
Box = tuple[int, int, int, int]  # x0, y0, x1, y1 pixels, y down

WALLS = ((212, 198, 168), (196, 186, 168), (226, 218, 200), (180, 160, 128), (150, 90, 70),
         (170, 168, 162), (205, 180, 150), (232, 228, 220))  # fmt: skip
ROOFS = ((92, 100, 116), (120, 126, 136), (70, 72, 80), (110, 84, 72), (150, 152, 156))
SKIES = ((150, 190, 235), (225, 230, 236), (190, 200, 212), (240, 243, 246), (110, 160, 220))
SHOPS = ((60, 30, 28), (30, 44, 60), (28, 50, 34), (40, 38, 36), (150, 140, 126), (110, 22, 26))
DOORS = ((70, 46, 30), (34, 50, 40), (30, 36, 56), (96, 66, 40), (50, 40, 36))


@dataclass(frozen=True, slots=True)
class Style:
    """Everything about a facade that is drawn once."""

    wall: Color
    trim: Color
    roof: Color
    sky: Color
    shop: Color
    door: Color
    rail: Color
    frame: Color
    joints: float
    shutters: float
    curtains: float
    bars: int
    grain: float
    course: int
    leaves: bool
    surround: int
    iron: float
    slab: int
    clutter: int


def render_facade(
    grammar: Grammar, width: int, height: int, *, rng: np.random.Generator
) -> tuple[Node, Picture, Labels]:
    """Return a random derivation, y up, its picture (height, width, 3) and its labels."""
    tree = sample_derivation(grammar, width, height, rng=rng)
    style = _style(rng)
    canvas = np.zeros((height, width, 3), np.float32)
    labels = np.zeros((height, width), np.uint8)
    found = [(leaf, _box(leaf, height)) for leaf in leaves(tree)]
    for wanted in _PAINTERS:
        for leaf, box in found:
            if leaf.label == wanted and box[2] > box[0] and box[3] > box[1]:
                _PAINTERS[wanted](canvas, box, style, rng)
                labels[box[1] : box[3], box[0] : box[2]] = LABELS.index(wanted)
        if wanted == "wall":
            _clutter(canvas, labels == LABELS.index("wall"), style, rng)
    _cornices(canvas, tree, style, rng)
    _shade(canvas, rng)
    picture = (255 * np.clip(canvas, 0, 1)).astype(np.uint8)
    _occlude(picture, labels, rng)
    blurred = cv2.GaussianBlur(picture, (0, 0), rng.uniform(0.4, 1.1)).astype(np.uint8)
    return tree, relit(blurred, rng=rng), labels


def _box(leaf: Node, height: int) -> Box:
    x0, y0, x1, y1 = (round(v) for v in leaf.scope)
    return x0, height - y1, x1, height - y0


def _pick(colors: tuple[tuple[int, int, int], ...], rng: np.random.Generator) -> Color:
    base = np.array(colors[int(rng.integers(len(colors)))], np.float32) / 255
    return np.clip(base * rng.uniform(0.85, 1.15) + rng.normal(0, 0.03, 3), 0, 1).astype(np.float32)


def _style(rng: np.random.Generator) -> Style:
    wall = _pick(WALLS, rng)
    frame = np.full(3, rng.choice([0.9, 0.8, 0.5, 0.2]), np.float32)
    return Style(
        wall, np.clip(wall * rng.uniform(0.95, 1.2), 0, 1), _pick(ROOFS, rng), _pick(SKIES, rng),
        _pick(SHOPS, rng), _pick(DOORS, rng), np.full(3, rng.uniform(0.05, 0.3), np.float32),
        frame, float(rng.uniform(0, 0.12)), float(rng.choice([0, 0, 0.15, 0.6])),
        float(rng.uniform(0, 0.6)), int(rng.integers(0, 4)), float(rng.uniform(0.01, 0.05)),
        int(rng.integers(4, 14)), bool(rng.random() < 0.2), int(rng.integers(0, 6)),
        float(rng.uniform(0.2, 0.7)), int(rng.integers(0, 4)), int(rng.integers(0, 40)),
    )  # fmt: skip


def _noise(shape: tuple[int, int], scale: float, rng: np.random.Generator) -> Canvas:
    """Smooth noise of unit spread, one channel."""
    small = (max(2, int(shape[0] / scale) + 2), max(2, int(shape[1] / scale) + 2))
    field = rng.normal(0, 1, small).astype(np.float32)
    large = cv2.resize(field, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.atleast_2d(large).astype(np.float32)[:, :, None]


def _fill(canvas: Canvas, box: Box, color: Color, grain: float, rng: np.random.Generator) -> Canvas:
    """Fill a box with a grained colour and return the view of it."""
    part = canvas[box[1] : box[3], box[0] : box[2]]
    shape = (part.shape[0], part.shape[1])
    part[:] = color + grain * _noise(shape, 1.0, rng) + grain * _noise(shape, 12.0, rng)
    return part


def _sky(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    part = _fill(canvas, box, style.sky, 0.004, rng)
    ramp = np.linspace(-0.06, 0.06, part.shape[0], dtype=np.float32)[:, None, None]
    part += ramp


def _wall(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    _fill(canvas, box, style.wall, style.grain, rng)
    pitch = style.course
    for y in range(box[1] + (-box[1]) % pitch, box[3], pitch):
        canvas[y : y + 1, box[0] : box[2]] *= 1 - style.joints


def _roof(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    part = _fill(canvas, box, style.roof, 0.02, rng)
    if style.bars % 2:
        part[:, (-box[0]) % 9 :: 9] *= 0.85
    else:
        part[(-box[1]) % 4 :: 4] *= 0.92


def _chimney(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    _fill(canvas, box, style.wall * np.float32(rng.uniform(0.6, 1.05)), 0.03, rng)
    canvas[box[1] : box[1] + 3, box[0] : box[2]] *= 0.7
    for x in range(box[0] + 2, box[2] - 3, 6):
        top = max(0, box[1] - 4)
        canvas[top : box[1], x : x + 3] = np.array([0.6, 0.35, 0.25], np.float32)


def _window(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    x0, y0, x1, y1 = box
    if style.leaves and y1 - y0 > 8:  # open shutters beside the window
        half = max(2, (x1 - x0) // 2)
        for left in (x0 - half, x1):
            leaf = canvas[y0:y1, max(left, 0) : left + half]
            leaf[:] = style.frame
            leaf[::3] *= 0.85
    border = style.surround
    around = canvas[max(0, y0 - border) : y1 + border // 2, max(0, x0 - border) : x1 + border]
    around[:] = np.float32(0.4) * around + np.float32(0.6) * style.trim
    glass = np.array([0.9, 1.0, 1.1], np.float32) * np.float32(rng.uniform(0.08, 0.45))
    part = _fill(canvas, box, glass, 0.05, rng)
    if rng.random() < style.curtains:
        part[:] = np.float32(0.35) * part + np.float32(rng.uniform(0.25, 0.5))
    if rng.random() < style.shutters:
        part[:] = style.frame * np.float32(rng.uniform(0.7, 1.0))
        part[::3] *= 0.8
        return
    ramp = np.linspace(rng.uniform(-0.1, 0.15), rng.uniform(-0.1, 0.1), part.shape[0])
    part += ramp.astype(np.float32)[:, None, None]
    middle = part.shape[1] // 2
    part[:, middle - style.bars % 2 : middle + 1] = style.frame
    part[:, :1] = part[:, -1:] = style.frame * np.float32(0.9)
    part[:2] *= 0.6  # the lintel's shadow
    for k in range(1, style.bars):
        part[k * part.shape[0] // style.bars :][:1] = style.frame


def _balcony(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    x0, y0, x1, y1 = box
    part = canvas[y0:y1, x0:x1]
    above = canvas[max(0, y0 - 1) : y0, x0:x1]
    if above.size:  # what stands above goes on behind the railing
        part[:] = above
    shape = (part.shape[0], part.shape[1])
    part *= np.float32(rng.uniform(0.6, 0.95))
    ornament = _noise(shape, 1.5, rng) > rng.uniform(0.0, 1.2)
    part[:] = np.where(ornament, np.float32(0.3) * part + np.float32(0.7) * style.rail, part)
    step = 2 + style.bars % 3
    part[:, (-x0) % step :: step] *= np.float32(style.iron)
    part[:1] = style.rail
    part[-2:-1] = style.rail
    if style.slab:
        part[-1:] = style.trim * np.float32(rng.uniform(0.8, 1.1))
        canvas[y1 : y1 + style.slab, x0:x1] *= 0.7


def _door(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    part = _fill(canvas, box, style.door, 0.02, rng)
    middle = part.shape[1] // 2
    part[:, middle : middle + 1] *= 0.5
    part[:1] *= 0.6
    part[:, :1] *= 1.5


def _shop(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    part = _fill(canvas, box, style.shop, 0.05, rng)
    shape = (part.shape[0], part.shape[1])
    part += np.float32(0.12) * np.clip(_noise(shape, 8.0, rng), 0, 2)
    for x in range(rng.integers(4, 20), part.shape[1], int(rng.integers(14, 40))):
        part[:, x : x + 2] = style.frame * np.float32(0.7)
    if rng.random() < 0.5:  # a sign, an awning
        depth = max(1, part.shape[0] // 3)
        part[:depth] = _pick(SHOPS + WALLS, rng)
        letters = part[1 : depth - 1]
        if letters.size:
            letters += 0.3 * (_noise(letters.shape[:2], 3.0, rng) > 0.8)


_PAINTERS: dict[str, Callable[[Canvas, Box, Style, np.random.Generator], None]] = {
    "sky": _sky,
    "wall": _wall,
    "roof": _roof,
    "shop": _shop,
    "chimney": _chimney,
    "window": _window,
    "door": _door,
    "balcony": _balcony,
}  # fmt: skip; what hangs in front comes after what it hides


def _clutter(
    canvas: Canvas, wall: NDArray[np.bool_], style: Style, rng: np.random.Generator
) -> None:
    """Put mouldings, pilasters, pipes and stains on walls: dark and bright, wide and narrow."""
    height, width = wall.shape
    factor = np.ones((height, width), np.float32)
    for _ in range(style.clutter):
        y, x = int(rng.integers(height)), int(rng.integers(width))
        thick, gain = int(rng.integers(1, 6)), np.float32(rng.uniform(0.72, 1.2))
        if rng.random() < 0.7:
            left = 0 if rng.random() < 0.6 else x
            factor[y : y + thick, left : left + int(rng.integers(20, width + 21))] *= gain
            factor[y + thick : y + thick + 1, left:] *= np.float32(0.85)
            if rng.random() < 0.4:  # dentils
                step = int(rng.integers(2, 6))
                factor[y : y + thick + 2, left::step] *= np.float32(rng.uniform(0.7, 0.95))
        else:
            factor[y : y + int(rng.integers(10, height)), x : x + thick] *= gain
    factor += np.float32(rng.uniform(0, 0.06)) * _noise((height, width), 3.0, rng)[:, :, 0]
    factor += np.float32(rng.uniform(0, 0.06)) * _noise((height, width), 40.0, rng)[:, :, 0]
    canvas[wall] *= factor[wall][:, None]


def _cornices(canvas: Canvas, tree: Node, style: Style, rng: np.random.Generator) -> None:
    """Draw ledges at the borders of floors."""
    height = canvas.shape[0]
    for node in nodes(tree):
        if node.split == "right" and node.symbol in ("FL", "GF") and rng.random() < 0.6:
            edge = node.scope[1 if node.symbol == "FL" else 3]
            y = height - round(edge) + int(rng.integers(2, 6))
            if 2 < y < height - 3:
                canvas[y : y + 2] = (
                    np.float32(0.3) * canvas[y : y + 2] + np.float32(0.7) * style.trim
                )
                canvas[y + 2 : y + 3] *= 0.75


def _shade(canvas: Canvas, rng: np.random.Generator) -> None:
    """Cast the shadow of a house across the street, and the street's own gloom."""
    height, width = canvas.shape[:2]
    ramp = np.linspace(1, rng.uniform(0.65, 1.0), height, dtype=np.float32)
    canvas *= ramp[:, None, None]
    if rng.random() < 0.4:
        y = rng.uniform(0.1, 0.9, 2) * height
        line = np.linspace(y[0], y[1], width)
        below = np.arange(height)[:, None] > line[None]
        canvas[below] *= np.float32(rng.uniform(0.45, 0.85))


def _occlude(picture: Picture, labels: Labels, rng: np.random.Generator) -> None:
    """Put cars, posts and trees in front; their pixels are ignored in training."""
    height, width = labels.shape
    hidden = np.zeros((height, width), np.uint8)
    for _ in range(int(rng.integers(0, 4))):
        centre = (int(rng.integers(width)), height - int(rng.integers(0, 6)))
        axes = (int(rng.integers(15, 40)), int(rng.integers(6, 16)))
        color = rng.integers(10, 220, 3).tolist()
        cv2.ellipse(picture, centre, axes, 0, 0, 360, color, -1)
        cv2.ellipse(hidden, centre, axes, 0, 0, 360, 1, -1)
    if rng.random() < 0.4:
        x, y = int(rng.integers(width)), int(rng.uniform(0.5, 0.9) * height)
        cv2.line(picture, (x, y), (x, height), (40, 40, 42), 2)
        cv2.line(hidden, (x, y), (x, height), 1, 2)
    if rng.random() < 0.2:
        leaf = _noise((height, width), 10, rng)[:, :, 0] + _noise((height, width), 40, rng)[:, :, 0]
        near = np.abs(np.arange(width) - rng.uniform(0, width)) < 60
        tree = (leaf > 1.2) & near[None] & (np.arange(height) > height / 2)[:, None]
        picture[tree] = rng.integers((30, 60, 20), (80, 120, 60))
        hidden[tree] = 1
    labels[hidden > 0] = 0
