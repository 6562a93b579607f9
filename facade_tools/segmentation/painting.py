"""Pictures of random facades, rendered with random light, materials, occluders and blur.

The default classifier learns from these alone: nothing in them comes from a photograph.
"""

from __future__ import annotations

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
from .painting_parts import PAINTERS, Box, Canvas, Style, band, noise, random_style

UNIT = 288  # rows of a picture whose lines are one pixel thick


def render_facade(
    grammar: Grammar, width: int, height: int, *, rng: np.random.Generator
) -> tuple[Node, Picture, Labels]:
    """Return a random derivation, y up, its picture (height, width, 3) and its labels.

    What stands in front (cars, posts, trees) keeps the label of what it hides.
    """
    tree = sample_derivation(grammar, width, height, rng=rng)
    style = random_style(max(1.0, height / UNIT), rng)
    canvas = np.zeros((height, width, 3), np.float32)
    labels = np.zeros((height, width), np.uint8)
    found = [(leaf, _box(leaf, height)) for leaf in leaves(tree)]
    for wanted, paint in PAINTERS.items():
        for leaf, box in found:
            if leaf.label == wanted and box[2] > box[0] and box[3] > box[1]:
                paint(canvas, box, style, rng)
                labels[box[1] : box[3], box[0] : box[2]] = LABELS.index(wanted)
        if wanted == "wall":
            _clutter(canvas, labels == LABELS.index("wall"), style, rng)
            _cornices(canvas, tree, style, rng)
    _shade(canvas, rng)
    _occlude(canvas, style, rng)
    picture = (255 * np.clip(canvas, 0, 1)).astype(np.uint8)
    blur = style.unit * rng.uniform(0.25, 0.9)
    picture = cv2.GaussianBlur(picture, (0, 0), blur).astype(np.uint8)
    return tree, _compressed(relit(picture, rng=rng), rng), labels


def _box(leaf: Node, height: int) -> Box:
    x0, y0, x1, y1 = (round(v) for v in leaf.scope)
    return x0, height - y1, x1, height - y0


def _compressed(picture: Picture, rng: np.random.Generator) -> Picture:
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(55, 96))]
    data = cv2.imencode(".jpg", picture, quality)[1]
    return cv2.imdecode(data, cv2.IMREAD_COLOR).astype(np.uint8)  # type: ignore[union-attr]


def _clutter(
    canvas: Canvas, wall: NDArray[np.bool_], style: Style, rng: np.random.Generator
) -> None:
    """Put ledges, pilasters, panels and stains on walls: dark and bright, wide and narrow."""
    height, width = wall.shape
    before = canvas.copy()
    for _ in range(style.clutter):
        y, x = int(rng.integers(height)), int(rng.integers(width))
        kind = rng.random()
        if kind < 0.45:
            left = 0 if rng.random() < 0.7 else x
            right = width if left == 0 else left + int(rng.integers(20, 120) * style.unit)
            band(canvas, (left, y, right, y + style.px(rng.uniform(1, 8))), style, rng)
        elif kind < 0.65:
            tall = int(rng.integers(10, height))
            strip = canvas[y : y + tall, x : x + style.px(rng.uniform(1, 9))]
            strip *= np.float32(rng.uniform(0.7, 1.2))
            strip[:, :1] *= np.float32(1.15)
            strip[:, -1:] *= np.float32(0.7)
        else:
            _panel(canvas, (x, y), style, rng)
    for scale, most in ((3.0, 0.06), (12.0, 0.05), (40.0, 0.07)):
        stains = np.float32(rng.uniform(0, most)) * noise((height, width), scale * style.unit, rng)
        canvas *= 1 + stains
    canvas[~wall] = before[~wall]


def _panel(canvas: Canvas, at: tuple[int, int], style: Style, rng: np.random.Generator) -> None:
    """Draw the outline of a sunk or raised field of stone."""
    wide, tall = (style.px(rng.uniform(4, 30)) for _ in range(2))
    thick = style.px(rng.uniform(0.5, 2))
    part = canvas[at[1] : at[1] + tall, at[0] : at[0] + wide]
    part[:thick] *= np.float32(rng.uniform(0.6, 1.2))
    part[-thick:] *= np.float32(rng.uniform(0.6, 1.2))
    part[:, :thick] *= np.float32(rng.uniform(0.7, 1.2))
    part[:, -thick:] *= np.float32(rng.uniform(0.7, 1.2))


def _cornices(canvas: Canvas, tree: Node, style: Style, rng: np.random.Generator) -> None:
    """Draw ledges at the borders of floors."""
    height, width = canvas.shape[:2]
    for node in nodes(tree):
        if node.split == "right" and node.symbol in ("FL", "GF") and rng.random() < 0.7:
            edge = node.scope[1 if node.symbol == "FL" else 3]
            y = height - round(edge) + style.px(rng.uniform(0, 5)) - 1
            band(canvas, (0, y, width, y + style.px(rng.uniform(1, 7))), style, rng)


def _shade(canvas: Canvas, rng: np.random.Generator) -> None:
    """Cast the shadow of a house across the street, and the street's own gloom."""
    height, width = canvas.shape[:2]
    ramp = np.linspace(rng.uniform(0.9, 1.15), rng.uniform(0.55, 1.05), height, dtype=np.float32)
    canvas *= ramp[:, None, None]
    if rng.random() < 0.5:
        y = rng.uniform(0.05, 0.95, 2) * height
        line = np.linspace(y[0], y[0] + (y[1] - y[0]) * rng.uniform(0, 1), width)
        below = np.arange(height)[:, None] > line[None]
        tint = np.array([1.0, 1.02, rng.uniform(1.0, 1.15)], np.float32)
        canvas[below] *= np.float32(rng.uniform(0.35, 0.8)) * tint


def _occlude(canvas: Canvas, style: Style, rng: np.random.Generator) -> None:
    """Put cars, people, posts and trees in front."""
    height, width = canvas.shape[:2]
    for _ in range(int(rng.integers(0, 5))):
        _car(canvas, style, rng)
    for _ in range(int(rng.integers(0, 6))):
        x, tall = int(rng.integers(width)), style.px(rng.uniform(10, 18))
        canvas[height - tall :, x : x + style.px(rng.uniform(2, 5))] = rng.uniform(0.05, 0.6, 3)
    if rng.random() < 0.4:
        x, y = int(rng.integers(width)), int(rng.uniform(0.5, 0.9) * height)
        canvas[y:, x : x + style.px(2)] = np.float32(rng.uniform(0.1, 0.3))
    if rng.random() < 0.2:
        shape = (height, width)
        leaf = noise(shape, 5 * style.unit, rng) + noise(shape, 25 * style.unit, rng)
        near = np.abs(np.arange(width) - rng.uniform(0, width)) < 40 * style.unit
        tree = (leaf[:, :, 0] > 1.0) & near[None] & (np.arange(height) > height / 2)[:, None]
        canvas[tree] = rng.uniform((0.1, 0.2, 0.05), (0.35, 0.5, 0.25))


def _car(canvas: Canvas, style: Style, rng: np.random.Generator) -> None:
    height, width = canvas.shape[:2]
    x, long = int(rng.integers(-20, width)), style.px(rng.uniform(25, 60))
    tall = style.px(rng.uniform(8, 18))
    color = rng.uniform(0.05, 0.95) * np.ones(3) if rng.random() < 0.6 else rng.uniform(0, 0.8, 3)
    top = height - tall
    left = max(0, x)
    canvas[top + tall // 2 :, left : x + long] = color
    canvas[top : top + tall // 2, max(0, x + long // 6) : x + 5 * long // 6] = color * 0.9
    glass = canvas[top + tall // 8 : top + tall // 2, max(0, x + long // 5) : x + 4 * long // 5]
    glass[:] = rng.uniform(0.1, 0.5)
    canvas[-style.px(1.5) :, left : x + long] *= 0.3
