"""A model as a stack of slabs: horizontal cuts at its vertices, plans of grid cells between them.

LNSW13 4.1 slices the mesh at floors and drops vertical faces from their contours. We sample each
slab's plan at its middle on the grid of its walls' positions, by the vote of four rays: a wall
that is missing or doubled in one direction does not turn the plan inside out.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..compiled import compiled
from ..errors import InvalidInput
from ..geometry.arrays import Booleans, Floats, Integers, Points3, Triangles

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
    triangles = vertices[faces]
    found = []
    for bottom, top in itertools.pairwise(levels):
        slab = _slab(triangles, float(bottom), float(top))
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


def _slab(triangles: Floats, bottom: float, top: float) -> Slab:
    segments = section(triangles, 0.5 * (bottom + top))
    if not len(segments):
        empty = np.zeros(2)
        return Slab(bottom, top, empty, empty, np.zeros((1, 1), dtype=bool))
    size = float(np.ptp(segments.reshape(-1, 2), axis=0).max())
    xs, ys = (_lines(segments, axis, min(LINE_TOLERANCE * size, FINEST)) for axis in (0, 1))
    cells = inside_cells(segments, 0.5 * (xs[1:] + xs[:-1]), 0.5 * (ys[1:] + ys[:-1]))
    return _trimmed(Slab(bottom, top, xs, ys, cells))


def section(triangles: Floats, height: float) -> Floats:
    """Return the segments (n, 2, 2) in which triangles (m, 3, 3) meet the plane z = height."""
    z = triangles[:, :, 2] - height
    above = z > 0
    crossing = above.any(axis=1) & ~above.all(axis=1)
    t, z, above = triangles[crossing], z[crossing], above[crossing]
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


def inside_cells(segments: Floats, xs: Floats, ys: Floats) -> Booleans:
    """Return whether the points of a grid (len(ys), len(xs)) lie inside a section.

    Each point asks four axis-parallel rays for the parity of their crossings and follows the
    majority; a draw counts as outside. Walls may be there twice (two-sided models) or touch
    (adjoining boxes): coincident crossings are counted once or each, whichever makes the rays
    agree at more points, and the larger plan where both do.
    """
    size = float(np.ptp(segments)) if len(segments) else 0.0
    options = []
    for gap in (0.0, 1e-4 * size):
        votes = _parities(segments, xs, ys, gap)
        votes += _parities(segments[:, :, ::-1].copy(), ys, xs, gap).T
        agreed = int(((votes == 0) | (votes == 4)).sum())
        options.append((agreed, int((votes > 2).sum()), votes > 2))
    return max(options, key=lambda option: option[:2])[2]


@compiled
def _parities(segments: Floats, xs: Floats, ys: Floats, gap: float) -> Integers:
    """Count odd crossings to the left and to the right of every grid point.

    Crossings nearer than `gap` to the one before are one crossing.
    """
    votes = np.zeros((len(ys), len(xs)), dtype=np.int64)
    crossings = np.empty(len(segments))
    for row in range(len(ys)):
        y = ys[row]
        count = 0
        for k in range(len(segments)):
            y0, y1 = segments[k, 0, 1], segments[k, 1, 1]
            if (y0 > y) != (y1 > y):
                share = (y - y0) / (y1 - y0)
                crossings[count] = segments[k, 0, 0] + share * (
                    segments[k, 1, 0] - segments[k, 0, 0]
                )
                count += 1
        found = np.sort(crossings[:count])
        kept = 0
        for k in range(count):
            if kept == 0 or found[k] - found[kept - 1] >= gap:
                found[kept] = found[k]
                kept += 1
        found, count = found[:kept], kept
        for column in range(len(xs)):
            left = np.searchsorted(found, xs[column])
            votes[row, column] = left % 2 + (count - left) % 2
    return votes


def _trimmed(slab: Slab) -> Slab:
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


@dataclass(frozen=True, slots=True)
class WallFace:
    """An upright rectangle of the outline of one slab.

    side: front, right, back or left. place: coordinate of its plane (y of front and back, x of
    the others). start, end: extent along the wall from left to right as seen from outside, as
    the coordinate x (front, back) or y (right, left). slab: index.
    """

    side: str
    slab: int
    place: float
    start: float
    end: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Width along the wall (m)."""
        return abs(self.end - self.start)

    @property
    def height(self) -> float:
        """Height (m)."""
        return self.top - self.bottom


def wall_faces(slab: Slab, index: int) -> list[WallFace]:
    """Return the upright faces of a slab: one for every straight stretch of its outline."""
    return [
        *_faces_of_rows(slab, index, False),
        *_faces_of_rows(slab, index, True),
        *_faces_of_columns(slab, index, False),
        *_faces_of_columns(slab, index, True),
    ]


def _runs(mask: Booleans) -> Integers:
    padded = np.concatenate([[False], mask, [False]])
    return np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)


def _faces_of_rows(slab: Slab, index: int, back: bool) -> list[WallFace]:
    """Front faces look towards −y: inside above the line, outside below. Back the other way."""
    padded = np.pad(slab.cells, ((1, 1), (0, 0)))
    lower, upper = padded[:-1], padded[1:]
    walls = lower & ~upper if back else upper & ~lower
    faces = []
    for row, y in enumerate(slab.ys):
        for a, b in _runs(walls[row]):
            x0, x1 = float(slab.xs[int(a)]), float(slab.xs[int(b)])
            ends = (x1, x0) if back else (x0, x1)
            side = "back" if back else "front"
            faces.append(WallFace(side, index, float(y), *ends, slab.bottom, slab.top))
    return faces


def _faces_of_columns(slab: Slab, index: int, left: bool) -> list[WallFace]:
    padded = np.pad(slab.cells, ((0, 0), (1, 1)))
    lower, upper = padded[:, :-1], padded[:, 1:]
    walls = upper & ~lower if left else lower & ~upper
    faces = []
    for column, x in enumerate(slab.xs):
        for a, b in _runs(walls[:, column]):
            y0, y1 = float(slab.ys[int(a)]), float(slab.ys[int(b)])
            ends = (y1, y0) if left else (y0, y1)
            side = "left" if left else "right"
            faces.append(WallFace(side, index, float(x), *ends, slab.bottom, slab.top))
    return faces
