"""A model as a stack of slabs: horizontal cuts at its vertices, plans of grid cells between them.

LNSW13 4.1 slices the mesh at floors and drops vertical faces from their contours. We sample each
slab's plan at its middle on the grid of its walls' positions, by the vote of four rays: a wall
that is missing or doubled in one direction does not turn the plan inside out.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..errors import InvalidInput
from ..geometry.arrays import Booleans, Floats, Integers, Points3, Triangles
from .inside import bodies, covered_points, inside_cells

HEIGHT_TOLERANCE = 0.0005  # of the height (4.1)
LINE_TOLERANCE = 0.004  # of the plan's larger side, between parallel walls
FINEST = 0.1  # m: parallel walls further apart always stay apart
THIN = 0.03  # of the height: what is lower may be a moulding
LOST_AT_ONCE = 0.0003  # of the volume: what joining a thin slab may change
LOST = 0.005  # of the volume: what all joining together may change
MAX_LINES = 400
MAX_SLABS = 400


@dataclass(frozen=True, slots=True)
class Slab:
    """The building between two heights (m): cells (len(ys)−1, len(xs)−1) that are inside."""

    bottom: float
    top: float
    xs: Floats
    ys: Floats
    cells: Booleans

    @property
    def height(self) -> float:
        """Height of the slab (m)."""
        return self.top - self.bottom

    @property
    def area(self) -> float:
        """Area of the plan (m²)."""
        return float(np.diff(self.ys) @ self.cells @ np.diff(self.xs))


def slabs(vertices: Points3, faces: Triangles) -> list[Slab]:
    """Return the slabs of a mesh in its standard view, from the ground up.

    Slabs of less than the height tolerance are merged; empty ones (below ground level, above the
    roof) are left out. Raises InvalidInput where nothing encloses a plan.
    """
    levels = clustered_levels(vertices[np.unique(faces), 2])
    model = _model(vertices[faces], bodies(vertices, faces))
    found = []
    for bottom, top in itertools.pairwise(levels):
        slab = _slab(model, float(bottom), float(top))
        if slab.cells.any():
            found.append(slab)
    if not found:
        raise InvalidInput("its walls enclose no plan; expected a building")
    return _without_thin(found)


def _without_thin(found: list[Slab]) -> list[Slab]:
    """Join slabs whose plans hardly differ where one of them is thin: sills, frames, mouldings.

    The plan of the higher one stays.
    """
    height = found[-1].top - found[0].bottom
    volume = sum(slab.area * slab.height for slab in found)
    left = LOST * volume
    kept = found[:1]
    for slab in found[1:]:
        below = kept[-1]
        thin = min(slab.height, below.height)
        change = plan_difference(below, slab) * max(below.area, slab.area) * thin
        small = thin < THIN * height and change < min(left, LOST_AT_ONCE * volume)
        if small and below.top == slab.bottom:
            left -= change
            plan = slab if slab.height > below.height else below
            kept[-1] = Slab(below.bottom, slab.top, plan.xs, plan.ys, plan.cells)
        else:
            kept.append(slab)
    return kept


def plan_difference(a: Slab, b: Slab) -> float:
    """Return the area where two plans differ, over the larger plan's area."""
    xs, ys = np.union1d(a.xs, b.xs), np.union1d(a.ys, b.ys)
    differs = on_grid(a, xs, ys) ^ on_grid(b, xs, ys)
    return float(np.diff(ys) @ differs @ np.diff(xs)) / max(a.area, b.area)


def on_grid(slab: Slab, xs: Floats, ys: Floats) -> Booleans:
    """Return a slab's plan on another grid whose cells lie within its own or outside of it."""
    rows = np.searchsorted(slab.ys, 0.5 * (ys[1:] + ys[:-1]))
    columns = np.searchsorted(slab.xs, 0.5 * (xs[1:] + xs[:-1]))
    padded = np.pad(slab.cells, 1)
    return np.asarray(padded[np.ix_(rows, columns)])


def clustered_levels(heights: Floats) -> Floats:
    """Return the sorted averages of heights that lie within the tolerance of each other."""
    values = np.unique(heights)
    tolerance = HEIGHT_TOLERANCE * (values[-1] - values[0])
    levels = _clusters(values, tolerance)
    while len(levels) > MAX_SLABS + 1:
        tolerance *= 2
        levels = _clusters(values, tolerance)
    return levels


def _clusters(values: Floats, tolerance: float) -> Floats:
    groups = np.cumsum(np.diff(values, prepend=values[:1]) > tolerance)
    return np.bincount(groups, values) / np.bincount(groups)


@dataclass(frozen=True, slots=True)
class _Model:
    """Triangles (m, 3, 3), each one's body, and its least and greatest height (m,)."""

    triangles: Floats
    bodies: Integers
    low: Floats
    high: Floats


def _model(triangles: Floats, numbers: Integers) -> _Model:
    heights = triangles[:, :, 2]
    return _Model(triangles, numbers, heights.min(axis=1), heights.max(axis=1))


def _slab(model: _Model, bottom: float, top: float) -> Slab:
    middle = 0.5 * (bottom + top)
    crossing = np.flatnonzero((model.high > middle) & (model.low <= middle))
    segments = section(model.triangles[crossing], middle)
    if not len(segments):
        empty = np.zeros(2)
        return Slab(bottom, top, empty, empty, np.zeros((1, 1), dtype=bool))
    size = float(np.ptp(segments.reshape(-1, 2), axis=0).max())
    xs, ys = (_lines(segments, axis, min(LINE_TOLERANCE * size, FINEST)) for axis in (0, 1))
    cells = _cells(model, segments, crossing, (xs, ys), middle)
    return trimmed(Slab(bottom, top, xs, ys, cells))


def _cells(
    model: _Model, segments: Floats, crossing: Integers, lines: tuple[Floats, Floats], z: float
) -> Booleans:
    """Return the cells of a section that are inside; a draw is decided by what covers the cell."""
    x, y = (0.5 * (line[1:] + line[:-1]) for line in lines)
    inside, undecided = inside_cells(segments, model.bodies[crossing], x, y)
    if undecided.any():
        rows, columns = np.nonzero(undecided)
        level = model.triangles[~_upright(model.triangles)]
        inside[rows, columns] = covered_points(np.column_stack([x[columns], y[rows]]), level, z)
    return np.asarray(inside)


def _upright(triangles: Floats) -> Booleans:
    a, b, c = (triangles[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    return np.asarray(np.abs(normal[:, 2]) < 0.1 * np.linalg.norm(normal, axis=1))


def section(t: Floats, height: float) -> Floats:
    """Return the segments (m, 2, 2) in which triangles (m, 3, 3) cross the plane z = height."""
    z = t[:, :, 2] - height
    above = z > 0
    lone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(t))
    ends = []
    for step in (1, 2):
        other = (lone + step) % 3
        share = z[rows, lone] / (z[rows, lone] - z[rows, other])
        ends.append(t[rows, lone, :2] + share[:, None] * (t[rows, other, :2] - t[rows, lone, :2]))
    return np.stack(ends, axis=1) if len(t) else np.empty((0, 2, 2))


def _lines(segments: Floats, axis: int, tolerance: float) -> Floats:
    """Return the grid positions along an axis: of walls across it, and of the ends of others."""
    values = np.unique(np.round(segments[:, :, axis].ravel(), 6))
    lines = _clusters(values, tolerance)
    while len(lines) > MAX_LINES:
        tolerance *= 1.5
        lines = _clusters(values, tolerance)
    return lines if len(lines) > 1 else np.array([lines[0], lines[0] + tolerance])


def trimmed(slab: Slab) -> Slab:
    """Drop grid lines that separate nothing."""
    if not slab.cells.any():
        return slab
    xs, columns = _needed(slab.xs, slab.cells.T)
    ys, rows = _needed(slab.ys, slab.cells)
    cells = slab.cells[np.ix_(rows, columns)]
    return Slab(slab.bottom, slab.top, xs, ys, cells)


def _needed(lines: Floats, cells: Booleans) -> tuple[Floats, np.ndarray]:
    """Return the lines between cells that differ, and the first of each run of equal cells."""
    padded = np.vstack([np.zeros_like(cells[:1]), cells, np.zeros_like(cells[:1])])
    keep = np.flatnonzero((padded[1:] != padded[:-1]).any(axis=1))
    return lines[keep], keep[:-1]
