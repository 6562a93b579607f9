"""Edges of a picture (Canny 1986), thin and of gradients that are high or touch high ones.

OpenCV 5.0.0's own Canny writes beyond its memory where more than half of the pixels are edges (fine
bricks, hatching), and the process ends. Elsewhere the two agree in every pixel.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

Edges = NDArray[np.uint8]  # (height, width): 1 on an edge
Gradients = NDArray[np.int16]  # (height, width) of Sobel's filter, 3×3
Stack = NDArray[np.int64]  # indices of pixels

TAN_22 = np.tan(np.pi / 8)


def edges(grey: NDArray[np.uint8], low: int, high: int) -> Edges:
    """Return the edges of a grey picture (height, width).

    low, high: what the sum of both absolute gradients must exceed, and somewhere on an edge.
    """
    across, down = (
        cv2.Sobel(grey, cv2.CV_16S, dx, 1 - dx, ksize=3, borderType=cv2.BORDER_REPLICATE)
        for dx in (1, 0)
    )
    return _edges(across.astype(np.int16), down.astype(np.int16), low, high)


@compiled
def _edges(across: Gradients, down: Gradients, low: int, high: int) -> Edges:
    height, width = across.shape
    size = np.zeros((height + 2, width + 2), np.int32)  # no gradient beyond the border
    for y in range(height):
        for x in range(width):
            size[y + 1, x + 1] = abs(np.int32(across[y, x])) + abs(np.int32(down[y, x]))
    faint = np.zeros((height + 2, width + 2), np.uint8)
    stack = np.empty(height * width, np.int64)
    count = 0
    out = np.zeros((height, width), np.uint8)
    for y in range(height):
        for x in range(width):
            here = size[y + 1, x + 1]
            if here <= low or not _is_ridge(size, across[y, x], down[y, x], y + 1, x + 1):
                continue
            if here > high:
                out[y, x] = 1
                stack[count] = y * width + x
                count += 1
            else:
                faint[y + 1, x + 1] = 1
    _grow(out, faint, stack, count)
    return out


@compiled
def _is_ridge(size: NDArray[np.int32], dx: int, dy: int, y: int, x: int) -> bool:
    """Tell whether a gradient is the largest of the three along its direction."""
    here, run, rise = size[y, x], abs(float(dx)), abs(float(dy))
    if rise < TAN_22 * run:
        return bool(here > size[y, x - 1] and here >= size[y, x + 1])
    if rise > run * (TAN_22 + 2.0):  # the tangent of 67.5°
        return bool(here > size[y - 1, x] and here >= size[y + 1, x])
    way = -1 if (dx < 0) != (dy < 0) else 1
    return bool(here > size[y - 1, x - way] and here > size[y + 1, x + way])


@compiled
def _grow(out: Edges, faint: Edges, stack: Stack, count: int) -> None:
    """Add to the edges the faint ones that touch them (`faint` has a margin of a pixel)."""
    width = out.shape[1]
    while count > 0:
        count -= 1
        y, x = stack[count] // width, stack[count] % width
        for v in range(y, y + 3):
            for u in range(x, x + 3):
                if faint[v, u]:
                    faint[v, u] = 0
                    out[v - 1, u - 1] = 1
                    stack[count] = (v - 1) * width + u - 1
                    count += 1
