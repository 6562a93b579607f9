"""Painted facades of the sample textured buildings, 20 pixels a metre."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]  # (h, w, 3), sRGB
Color = tuple[int, int, int]

PIXELS = 20  # a metre
GLASS: Color = (52, 66, 84)
SKY: Color = (120, 146, 168)
FRAME: Color = (236, 232, 222)
BRICK: Color = (158, 84, 62)
JOINT: Color = (188, 150, 128)
STONE: Color = (206, 196, 174)
PLASTER: Color = (232, 220, 196)
STEEL: Color = (150, 158, 166)


class Wall:
    """A wall to paint on; lengths in metres from its lower left corner."""

    def __init__(self, width: float, height: float, color: Color) -> None:
        """Begin with one plain colour."""
        self.width, self.height = width, height
        shape = (round(height * PIXELS), round(width * PIXELS), 3)
        self.picture: Picture = np.full(shape, color, dtype=np.uint8)

    def rectangle(self, x: float, z: float, width: float, height: float, color: Color) -> None:
        """Fill a rectangle."""
        rows = self.picture.shape[0]
        x0, x1 = (round(v * PIXELS) for v in (x, x + width))
        z0, z1 = (round(v * PIXELS) for v in (z, z + height))
        self.picture[max(rows - z1, 0) : rows - z0, max(x0, 0) : x1] = color

    def window(self, x: float, z: float, width: float, height: float) -> None:
        """Paint a framed window: glass with the sky in its upper half, a mullion."""
        self.rectangle(x, z, width, height, FRAME)
        self.rectangle(x + 0.1, z + 0.1, width - 0.2, height - 0.2, GLASS)
        self.rectangle(x + 0.1, z + 0.6 * height, width - 0.2, 0.4 * height - 0.1, SKY)
        self.rectangle(x + 0.5 * width - 0.05, z, 0.1, height, FRAME)

    def courses(self, color: Color) -> None:
        """Draw the joints of brick: a line every fifth of a metre, upright ones in turns."""
        step = PIXELS // 5
        for row, y in enumerate(range(0, self.picture.shape[0], step)):
            self.picture[y] = color
            self.picture[y : y + step, (row % 2) * step :: 2 * step] = color


def even(width: float, wanted: float) -> tuple[int, float]:
    """Return how many repeats of about `wanted` metres fill a width, and their length."""
    count = max(1, round(width / wanted))
    return count, width / count


def brickwork(width: float, height: float) -> Picture:
    """Paint brick storeys of 3 m with windows every 2.4 m."""
    wall = Wall(width, height, BRICK)
    wall.courses(JOINT)
    count, step = even(width, 2.4)
    for z in np.arange(0.0, height - 2.5, 3.0):
        for k in range(count):
            x = (k + 0.5) * step
            wall.rectangle(x - 0.7, z + 0.75, 1.4, 0.15, STONE)
            wall.window(x - 0.6, z + 0.9, 1.2, 1.6)
            wall.rectangle(x - 0.7, z + 2.5, 1.4, 0.2, STONE)
    return wall.picture


def shops(width: float, height: float) -> Picture:
    """Paint a row of shops: piers, panes, a sign over each, awnings in turns."""
    wall = Wall(width, height, (92, 84, 78))
    signs: list[Color] = [(176, 58, 50), (44, 96, 74), (206, 160, 60)]
    count, step = even(width, 5.0)
    for k in range(count):
        x = k * step
        wall.rectangle(x + 0.3, 0.5, step - 0.6, 0.7 * height - 0.5, GLASS)
        wall.rectangle(x + 0.5 * step - 0.5, 0.0, 1.0, 0.6 * height, FRAME)
        wall.rectangle(x + 0.5 * step - 0.4, 0.1, 0.8, 0.55 * height, SKY)
        wall.rectangle(x + 0.3, 0.72 * height, step - 0.6, 0.16 * height, signs[k % 3])
        if k % 2:
            wall.rectangle(x + 0.2, 0.62 * height, step - 0.4, 0.1 * height, FRAME)
    wall.rectangle(0.0, height - 0.3, width, 0.3, STONE)
    return wall.picture


def offices(width: float, height: float) -> Picture:
    """Paint storeys of 3.5 m with bands of glass between steel posts every 2 m."""
    wall = Wall(width, height, STONE)
    count, step = even(width, 2.0)
    for z in np.arange(0.0, height - 3.0, 3.5):
        wall.rectangle(0.0, z + 0.9, width, 2.2, GLASS)
        wall.rectangle(0.0, z + 2.2, width, 0.9, SKY)
    for k in range(count + 1):
        wall.rectangle(k * step - 0.2, 0.0, 0.4, height, STEEL)
    return wall.picture


def crown(width: float, height: float) -> Picture:
    """Paint upright fins of bronze before a dark ground, under a light rim."""
    wall = Wall(width, height, (48, 44, 42))
    count, step = even(width, 1.0)
    for k in range(count):
        wall.rectangle((k + 0.25) * step, 0.0, 0.5 * step, height - 0.8, (184, 130, 70))
    wall.rectangle(0.0, height - 0.8, width, 0.8, (226, 206, 160))
    return wall.picture


def attic(width: float, height: float) -> Picture:
    """Paint a cornice and slate with round windows every 3 m."""
    wall = Wall(width, height, (88, 92, 104))
    wall.rectangle(0.0, 0.0, width, 0.6, STONE)
    count, step = even(width, 3.0)
    for k in range(count):
        centre = (round((k + 0.5) * step * PIXELS), round(0.42 * height * PIXELS))
        cv2.circle(wall.picture, centre, round(0.55 * PIXELS), FRAME, -1)
        cv2.circle(wall.picture, centre, round(0.42 * PIXELS), GLASS, -1)
    return wall.picture


def bays(width: float, height: float) -> Picture:
    """Paint storeys of 3 m: a wide balcony window, then two narrow ones, in turns."""
    wall = Wall(width, height, PLASTER)
    count, step = even(width, 5.5)
    for z in np.arange(0.0, height - 2.5, 3.0):
        for k in range(count):
            x = k * step
            wall.window(x + 0.5, z + 0.3, 2.2, 2.2)
            wall.rectangle(x + 0.3, z + 0.1, 2.6, 0.9, (196, 92, 70))
            wall.window(x + 3.4, z + 0.9, 0.7, 1.4)
            wall.window(x + 4.4, z + 0.9, 0.7, 1.4)
    return wall.picture


def roof() -> Picture:
    """Paint a sheet of roofing felt."""
    picture = np.full((32, 32, 3), (112, 108, 104), dtype=np.uint8)
    picture[::8] = (96, 92, 90)
    return picture
