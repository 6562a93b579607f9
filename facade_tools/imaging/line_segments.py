"""Straight line segments along the edges of a picture.

The fast line detector of Lee et al. (Outdoor place recognition in urban environments using
straight lines, 2014): edge pixels are chained, and runs of a chain that stay near a line are its
segments. OpenCV has it, too, but on its own edges (see `edges`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .edges import Edges, edges

Segments = NDArray[np.float64]  # (n, 4) x0, y0, x1, y1 pixels
Pixels = NDArray[np.int64]  # (n, 2) x, y
Sums = NDArray[np.float64]  # (6,) of 1, x, y, x², y², xy

GRADIENTS = (50, 120)  # that an edge exceeds, and somewhere along it
NEAR = 1.414  # pixels between a line and the pixels of its segment
BORDER = 5.0  # pixels: what runs along the picture's border is none of its lines

# Neighbours (x, y) in the order of their directions, 45° apart: 0 to 4, then −3 to −1.
AROUND = np.array([[1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]])


def line_segments(grey: NDArray[np.uint8], shortest: int) -> Segments:
    """Return the segments of at least `shortest` pixels of a grey picture (height, width)."""
    return _segments(edges(grey, *GRADIENTS), shortest)


@compiled
def _segments(marks: Edges, shortest: int) -> Segments:
    """Return the segments of a map of edges, which is emptied."""
    height, width = marks.shape
    out = np.empty((1 + height * width // max(shortest, 1), 4))
    chain = np.empty((height * width, 2), np.int64)
    count = 0
    for y in range(height):
        for x in range(width):
            if marks[y, x] == 0:
                continue
            length = _chained(marks, x, y, chain)
            start = 0
            while start + shortest < length:
                stop = _straight(chain, start, length, shortest, out[count])
                if stop < 0:
                    start += 1
                    continue
                start = stop
                if _counts(out[count], shortest, width, height):
                    count += 1
    return out[:count].copy()


@compiled
def _chained(marks: Edges, x: int, y: int, chain: Pixels) -> int:
    """Follow an edge from a pixel on, in its mean direction so far; return how many pixels.

    The pixels are written to `chain` and taken from the map.
    """
    height, width = marks.shape
    chain[0, 0], chain[0, 1] = x, y
    marks[y, x] = 0
    count, mean = 1, 0.0
    while True:
        best, turn = -1, 2.0
        for i in range(8):
            u, v = x + AROUND[i, 0], y + AROUND[i, 1]
            if u < 0 or v < 0 or u >= width or v >= height or marks[v, u] == 0:
                continue
            away = abs((i - 8 if i > 4 else i) - mean)
            away = 8.0 - away if away > 4.0 else away
            if count == 1:
                best = i
                break
            if away < turn or (away == turn and best >= 0):
                best, turn = i, away
        if best < 0:
            return count
        way = best - 8 if best > 4 else best
        mean = (mean * (count - 1) + way) / count if count > 1 else float(way)
        x, y = x + AROUND[best, 0], y + AROUND[best, 1]
        chain[count, 0], chain[count, 1] = x, y
        marks[y, x] = 0
        count += 1


@compiled
def _straight(chain: Pixels, start: int, length: int, shortest: int, out: Sums) -> int:
    """Write the segment that begins at a chain's pixel; return the pixel after it, −1 if none.

    A run of `shortest` pixels must stay near its chord; the line fitted to it then grows.
    """
    first, last = chain[start], chain[start + shortest]
    across, down = float(last[0] - first[0]), float(last[1] - first[1])
    size = np.hypot(across, down)
    sums = np.zeros(6)
    for i in range(start, start + shortest + 1):
        x, y = float(chain[i, 0] - first[0]), float(chain[i, 1] - first[1])
        if abs(x * down - y * across) > NEAR * size:
            return -1
        _add(sums, x, y)
    line = _fitted(sums)
    stop = start + shortest + 1
    while stop < length:
        x, y = float(chain[stop, 0] - first[0]), float(chain[stop, 1] - first[1])
        if _distance(line, x, y) > NEAR:
            line = _fitted(sums)
            if _distance(line, x, y) > NEAR:
                break
        _add(sums, x, y)
        stop += 1
    line = _fitted(sums)
    for end in range(2):
        pixel = chain[start] if end == 0 else chain[stop - 1]
        x, y = float(pixel[0] - first[0]), float(pixel[1] - first[1])
        along = (x - line[0]) * line[2] + (y - line[1]) * line[3]
        out[2 * end] = first[0] + line[0] + along * line[2]
        out[2 * end + 1] = first[1] + line[1] + along * line[3]
    return stop


@compiled
def _add(sums: Sums, x: float, y: float) -> None:
    sums[0] += 1.0
    sums[1] += x
    sums[2] += y
    sums[3] += x * x
    sums[4] += y * y
    sums[5] += x * y


@compiled
def _fitted(sums: Sums) -> tuple[float, float, float, float]:
    """Return a point and the direction of the line with the least squares of distances."""
    n = sums[0]
    x, y = sums[1] / n, sums[2] / n
    spread = sums[3] - n * x * x - (sums[4] - n * y * y)
    turn = 0.5 * np.arctan2(2.0 * (sums[5] - n * x * y), spread)
    return x, y, np.cos(turn), np.sin(turn)


@compiled
def _distance(line: tuple[float, float, float, float], x: float, y: float) -> float:
    return abs((y - line[1]) * line[2] - (x - line[0]) * line[3])


@compiled
def _counts(segment: Sums, shortest: int, width: int, height: int) -> bool:
    """Tell whether a segment is long enough and does not run along the picture's border."""
    x0, y0, x1, y1 = segment
    if np.hypot(x1 - x0, y1 - y0) < shortest:
        return False
    if max(x0, x1) <= BORDER or max(y0, y1) <= BORDER:
        return False
    return bool(min(x0, x1) < width - BORDER and min(y0, y1) < height - BORDER)
