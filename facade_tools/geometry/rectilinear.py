"""Plan polygons to axis-aligned rectangles: main direction, common grid, cover by rectangles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from .arrays import Booleans, Floats, Integers, Points2, Rectangles
from .polygons_cover import cover

AXIS_ANGLE = 12.0  # degrees: an edge nearer to an axis than this is a wall along it
JOG = 0.45  # metres: walls nearer to each other than this stand in one line
STEP = 1.2  # metres: an oblique edge becomes stairs of about this tread
MOST_LINES = 60  # a direction, so that a round tower costs no more than a house
LEAST_SIDE = 0.6  # metres: thinner slivers are dropped
INSIDE = 0.5  # share of a cell that must be covered to count


@dataclass(frozen=True, slots=True)
class Partition:
    """Rectangles of each polygon, and what they get wrong.

    rectangles: one (n, 4) a polygon, metres; those of one polygon may overlap. residual: area of
    the symmetric difference between the union of all rectangles and of all polygons, over the
    area of the polygons.
    """

    rectangles: tuple[Rectangles, ...]
    residual: float


def main_direction(polygon: BaseGeometry) -> float:
    """Return the direction of most of a polygon's outline, in degrees in (-45, 45].

    Edges vote with their length; the best edge's direction is then the mean of all edges within
    `AXIS_ANGLE` of it, modulo a right angle. A rectangle turned by 30° answers 30.
    """
    steps = _edges(polygon)
    if not len(steps):
        return 0.0
    angles = np.degrees(np.arctan2(steps[:, 1], steps[:, 0])) % 90.0
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    apart = np.abs((angles[:, None] - angles[None, :] + 45.0) % 90.0 - 45.0)
    votes = np.where(apart < AXIS_ANGLE / 4.0, lengths[None, :], 0.0).sum(axis=1)
    best = int(np.argmax(votes))
    near = apart[best] < AXIS_ANGLE / 2.0
    turns = np.exp(1j * np.radians(4.0 * angles[near])) * lengths[near] ** 2
    mean = math.degrees(float(np.angle(turns.sum()))) / 4.0
    return mean if mean > -45.0 else mean + 90.0


def rotated(polygon: BaseGeometry, degrees: float) -> BaseGeometry:
    """Return a polygon turned counter-clockwise about the origin."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = np.array([[c, s], [-s, c]])
    return shapely.transform(polygon, lambda points: points @ turn)


def partition(polygons: Sequence[BaseGeometry]) -> Partition:
    """Return rectangles that cover each polygon, on one common grid.

    The polygons lie along the axes as well as they can (`main_direction`, `rotated`) and do not
    overlap. Walls along an axis give the grid's lines, oblique ones become stairs; a cell belongs
    to the polygon that covers most of it. Each polygon's cells are covered by few, large,
    overlapping rectangles. Empty input gives empty output.
    """
    whole = shapely.union_all(list(polygons))
    if whole.is_empty:
        return Partition(tuple(np.empty((0, 4)) for _ in polygons), 0.0)
    xs, ys = (_grid_lines(polygons, axis) for axis in (0, 1))
    owner = _owners(polygons, xs, ys)
    found = tuple(_drop_slivers(cover(owner == k, xs, ys)) for k in range(len(polygons)))
    return Partition(found, residual(whole, np.vstack(found)))


def residual(polygon: BaseGeometry, rectangles: Rectangles) -> float:
    """Return the area where rectangles and polygon differ, over the polygon's area."""
    union = shapely.union_all(shapely.box(*rectangles.T)) if len(rectangles) else Polygon()
    return float(polygon.symmetric_difference(union).area / polygon.area)


def valid_polygon(rings: Sequence[Points2]) -> BaseGeometry:
    """Return the polygon of an outer ring and holes, repaired where it crosses itself.

    What repair leaves beside areas (lines, points) is dropped; too few points give the empty one.
    """
    kept = [ring for ring in rings if len(ring) >= 3]
    if not kept or len(rings[0]) < 3:
        return Polygon()
    polygon: BaseGeometry = Polygon(kept[0], kept[1:])
    return polygon if polygon.is_valid else areas(shapely.make_valid(polygon))


def areas(shape: BaseGeometry) -> BaseGeometry:
    """Return only the areas of a shape that mixes areas, lines and points."""
    if isinstance(shape, Polygon | MultiPolygon):
        return shape
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, Polygon | MultiPolygon)]
    return shapely.union_all(parts) if parts else Polygon()


# --- the grid -----------------------------------------------------------------------------------


def _rings(polygon: BaseGeometry) -> list[Points2]:
    rings = shapely.get_rings(shapely.get_parts(polygon))
    return [shapely.get_coordinates(ring) for ring in rings]


def _edges(polygon: BaseGeometry) -> Floats:
    steps = [np.diff(ring, axis=0) for ring in _rings(polygon)]
    return np.concatenate(steps) if steps else np.empty((0, 2))


def _grid_lines(polygons: Sequence[BaseGeometry], axis: int) -> Floats:
    """Return the sorted grid positions along an axis: walls across it, and stairs."""
    places, weights = [], []
    for ring in (ring for polygon in polygons for ring in _rings(polygon)):
        for start, stop in pairwise(ring):
            for place, weight in _edge_lines(start, stop, axis):
                places.append(place)
                weights.append(weight)
    lines = _clustered(np.array(places), np.array(weights), JOG)
    jog = JOG
    while len(lines) > MOST_LINES:
        jog *= 1.5
        lines = _clustered(np.array(places), np.array(weights), jog)
    return lines


def _edge_lines(start: Floats, stop: Floats, axis: int) -> list[tuple[float, float]]:
    """Return positions and weights that one edge asks for: its line, its stairs, or nothing."""
    along = abs(float(stop[1 - axis] - start[1 - axis]))
    across = abs(float(stop[axis] - start[axis]))
    limit = math.tan(math.radians(AXIS_ANGLE))
    if across <= limit * along:
        return [(float(start[axis] + stop[axis]) / 2.0, along)]
    if along <= limit * across:
        return [(float(place), 1e-3) for place in (start[axis], stop[axis])]
    count = max(1, round(min(across, along) / STEP))
    return [(float(place), 1e-2) for place in np.linspace(start[axis], stop[axis], count + 1)]


def _clustered(places: Floats, weights: Floats, jog: float) -> Floats:
    """Return weighted means (whole millimetres) of runs of places, none wider than `jog`.

    Heavy places come first and take the light ones near them along.
    """
    order = np.argsort(-weights, kind="stable")
    centres: list[float] = []
    members: list[list[int]] = []
    for index in order.tolist():
        gaps = [abs(places[index] - centre) for centre in centres]
        if gaps and min(gaps) < jog:
            members[gaps.index(min(gaps))].append(index)
        else:
            centres.append(float(places[index]))
            members.append([index])
    means = [float(np.average(places[rows], weights=weights[rows] ** 2)) for rows in members]
    return np.unique(np.round(means, 3))


def _owners(polygons: Sequence[BaseGeometry], xs: Floats, ys: Floats) -> Integers:
    """Return for each cell which polygon covers most of it; -1 where half of it is outside."""
    x0, y0 = np.meshgrid(xs[:-1], ys[:-1], indexing="ij")
    x1, y1 = np.meshgrid(xs[1:], ys[1:], indexing="ij")
    cells = shapely.box(x0, y0, x1, y1)
    area = np.maximum((x1 - x0) * (y1 - y0), 1e-12)
    shares = np.array([_shares(polygon, cells) / area for polygon in polygons])
    return np.where(shares.sum(axis=0) >= INSIDE, shares.argmax(axis=0), -1)


def _shares(
    polygon: BaseGeometry, cells: np.ndarray[tuple[int, ...], np.dtype[np.object_]]
) -> Floats:
    shapely.prepare(polygon)
    touched: Booleans = shapely.intersects(polygon, cells)
    inside = shapely.contains(polygon, cells)
    found = np.where(inside, shapely.area(cells), 0.0)
    border = touched & ~inside
    found[border] = shapely.area(shapely.intersection(cells[border], polygon))
    return found


def _drop_slivers(rectangles: Rectangles) -> Rectangles:
    if not len(rectangles):
        return rectangles
    sides = np.minimum(rectangles[:, 2] - rectangles[:, 0], rectangles[:, 3] - rectangles[:, 1])
    return rectangles[sides >= LEAST_SIDE] if (sides >= LEAST_SIDE).any() else rectangles
