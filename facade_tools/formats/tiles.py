"""Seamless textures of the surface patterns, as PNG."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..geometry.arrays import Floats
from ..geometry.patterns import REPEAT, TILES, period
from . import png

# Rows and columns: powers of two, which every renderer can repeat.
PIXELS = {"siding": (128, 16), "shingle": (256, 256), "brick": (128, 256)}


@cache
def tile(pattern: str, color: str = "#ffffff") -> bytes:
    """Return the picture that repeats every `period(pattern)` metres, grey or in a colour."""
    width, height = period(pattern)
    shape = PIXELS[pattern]
    x = (np.arange(shape[1]) + 0.5) / shape[1] * width / TILES[pattern][0]
    y = (1.0 - (np.arange(shape[0]) + 0.5) / shape[0]) * height / TILES[pattern][1]
    draw = _boards if pattern == "siding" else _courses
    grey = np.round(255 * np.clip(draw(pattern, x[None, :], y[:, None]), 0.0, 1.0))
    tinted = grey[:, :, None] * (np.frombuffer(bytes.fromhex(color[1:]), np.uint8) / 255.0)
    return png.write(np.round(tinted).astype(np.uint8))


def _boards(_: str, x: Floats, y: Floats) -> Floats:
    within = y % 1.0
    return np.where(within < 0.14, 0.72, 0.94 + 0.06 * within) + 0.0 * x


def _courses(pattern: str, x: Floats, y: Floats) -> Floats:
    """Staggered tiles, each a little lighter or darker; the pattern repeats after REPEAT tiles."""
    across, up = REPEAT[pattern]
    row = np.floor(y)
    column = x + 0.5 * (row % 2)
    cell = np.floor(column) % across
    noise = np.sin(cell * 12.9898 + (row % up) * 78.233) * 43758.5453
    tint = 0.84 + 0.16 * (noise - np.floor(noise))
    joint = (y - row < 0.14) | (column - np.floor(column) < 0.05)
    return np.where(joint, 0.72 * tint, tint)
