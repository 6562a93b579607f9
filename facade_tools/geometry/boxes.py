"""Unions of axis-aligned rectangles by coordinate compression.

All comparisons are made on edges rounded to 1e-6 m: edges that are equal after rounding are shared.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..artifacts.building import Box
from ..compiled import compiled
from .arrays import Floats, Integers, Rectangles

RESOLUTION = 1e6  # plan positions per metre


def rounded(values: Floats) -> Floats:
    """Return lengths or positions (m) rounded to 1e-6 m."""
    return np.rint(np.asarray(values, dtype=np.float64) * RESOLUTION) / RESOLUTION + 0.0


def box_rectangles(boxes: Sequence[Box]) -> Rectangles:
    """Return the plan rectangles (n, 4) of boxes, metres: x0, y0, x1, y1, rounded to 1e-6."""
    rows = [
        (b.x - b.width / 2, b.y - b.depth / 2, b.x + b.width / 2, b.y + b.depth / 2) for b in boxes
    ]
    return rounded(np.array(rows, dtype=np.float64).reshape(-1, 4))


@compiled
def cell_counts(rectangles: Rectangles, xs: Floats, ys: Floats) -> Integers:
    """Return how many rectangles cover each cell of the grid; edges must occur in xs and ys."""
    counts = np.zeros((len(xs), len(ys)), dtype=np.int64)
    for k in range(len(rectangles)):
        i0, i1 = np.searchsorted(xs, rectangles[k, 0]), np.searchsorted(xs, rectangles[k, 2])
        j0, j1 = np.searchsorted(ys, rectangles[k, 1]), np.searchsorted(ys, rectangles[k, 3])
        counts[i0, j0] += 1
        counts[i1, j0] -= 1
        counts[i0, j1] -= 1
        counts[i1, j1] += 1
    for i in range(len(xs)):
        for j in range(1, len(ys)):
            counts[i, j] += counts[i, j - 1]
    for i in range(1, len(xs)):
        for j in range(len(ys)):
            counts[i, j] += counts[i - 1, j]
    return counts[: max(len(xs) - 1, 0), : max(len(ys) - 1, 0)]


@compiled
def edge_positions(rectangles: Rectangles) -> tuple[Floats, Floats]:
    """Return the sorted distinct x and y of all edges."""
    n = len(rectangles)
    xs, ys = np.empty(2 * n), np.empty(2 * n)
    for k in range(n):
        xs[2 * k], xs[2 * k + 1] = rectangles[k, 0], rectangles[k, 2]
        ys[2 * k], ys[2 * k + 1] = rectangles[k, 1], rectangles[k, 3]
    return np.unique(xs), np.unique(ys)


@compiled
def area_perimeter(rectangles: Rectangles) -> tuple[float, float]:
    """Return area and perimeter of a union of rectangles whose edges are rounded already."""
    xs, ys = edge_positions(rectangles)
    counts = cell_counts(rectangles, xs, ys)
    n, m = counts.shape
    area = 0.0
    perimeter = 0.0
    for i in range(n):
        width = xs[i + 1] - xs[i]
        for j in range(m):
            if counts[i, j] == 0:
                continue
            depth = ys[j + 1] - ys[j]
            area += width * depth
            perimeter += width * ((j == 0 or counts[i, j - 1] == 0) * 1.0)
            perimeter += width * ((j == m - 1 or counts[i, j + 1] == 0) * 1.0)
            perimeter += depth * ((i == 0 or counts[i - 1, j] == 0) * 1.0)
            perimeter += depth * ((i == n - 1 or counts[i + 1, j] == 0) * 1.0)
    return area, perimeter


@compiled
def shared_outline(rectangle: Floats, rectangles: Rectangles) -> float:
    """Return the length of a rectangle's outline that lies on the outline of a union (m).

    rectangle (4,) and rectangles (n, 4) are rounded already.
    """
    everything = np.empty((len(rectangles) + 1, 4))
    everything[:-1] = rectangles
    everything[-1] = rectangle
    xs, ys = edge_positions(everything)
    counts = cell_counts(rectangles, xs, ys)
    n, m = counts.shape
    i0, i1 = np.searchsorted(xs, rectangle[0]), np.searchsorted(xs, rectangle[2])
    j0, j1 = np.searchsorted(ys, rectangle[1]), np.searchsorted(ys, rectangle[3])
    length = 0.0
    for i in range(i0, i1):
        for j in (j0, j1):
            below = j > 0 and counts[i, j - 1] > 0
            above = j < m and counts[i, j] > 0
            if below != above:
                length += xs[i + 1] - xs[i]
    for j in range(j0, j1):
        for i in (i0, i1):
            before = i > 0 and counts[i - 1, j] > 0
            after = i < n and counts[i, j] > 0
            if before != after:
                length += ys[j + 1] - ys[j]
    return length


def union_area_perimeter(rectangles: Rectangles) -> tuple[float, float]:
    """Return area (m²) and perimeter (m; courtyards included) of a union of rectangles.

    rectangles: (n, 4) x0, y0, x1, y1 in metres. No rectangles have area and perimeter 0.

    >>> union_area_perimeter(np.array([[0, 0, 2, 1], [1, 0, 3, 1.0]]))
    (3.0, 8.0)
    """
    area, perimeter = area_perimeter(rounded(rectangles).reshape(-1, 4))
    return float(area), float(perimeter)
