"""Which edges of a polygon carry a gable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from facade_tools.artifacts.building import Axis

from .arrays import Floats, Points2
from .polygons import Rings, signed_area
from .skeleton import Contour, SkeletonFailed, straight_skeleton

PLAIN = 0.4  # metres: jogs and bends of a wall that its gable ignores
ACROSS = 0.5  # cosine of the angle between an end and the ridge: steeper ones it runs into
LEAST_COURT = 1.0  # m²: a hole smaller than this is ignored likewise
OPPOSITE = -0.8  # cosine of the angle between the two walls beside a gable


def turns(contour: Contour) -> Floats:
    """Return the sine of the turn (n,) at the end of each edge, positive to the left."""
    along, _, _ = contour.frames()
    after = along[contour.following]
    return np.asarray(along[:, 0] * after[:, 1] - along[:, 1] * after[:, 0])


@dataclass(frozen=True, slots=True)
class Ends:
    """Ends of a plan, edges of each: those that get a gable, and those that may."""

    sure: list[list[int]]
    possible: list[list[int]]


def gable_edges(rings: Rings, direction: Axis) -> list[int]:
    """Return the edges that get a gable, numbered over the concatenated rings."""
    return [edge for end in gable_ends(rings, direction).sure for edge in end]


def gable_ends(rings: Rings, direction: Axis) -> Ends:
    """Return the ends with gables, their edges numbered over the concatenated rings.

    They are found on the plan without jogs smaller than 0.4 m: ends whose hip is a triangle
    between walls that face each other. Where several meet, those come first that the ridge's
    direction runs into. An end across the ridge that is longer than all these but has another
    hip, as plans have that are about as long as wide, may get a gable too.
    """
    kept = [_corners(ring) for ring in rings]
    plain = [
        ring[corners] if ring is rings[0] or abs(signed_area(ring)) > LEAST_COURT else None
        for ring, corners in zip(rings, kept, strict=True)
    ]
    try:
        ends = _ends([ring for ring in plain if ring is not None], direction)
    except SkeletonFailed:
        return Ends([], [])
    edges: list[list[int]] = []
    first = 0
    for ring, corners, used in zip(rings, kept, plain, strict=True):
        if used is not None:
            for place, corner in enumerate(corners):
                step = (corners[(place + 1) % len(corners)] - corner) % len(ring)
                edges.append([first + (corner + k) % len(ring) for k in range(step)])
        first += len(ring)
    return Ends(*([edges[k] for k in numbers] for numbers in ends))


def _corners(ring: Points2) -> list[int]:
    """Return the places of the points that remain without small jogs, at least three."""
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    bend = np.abs(turn) / (np.hypot(*before.T) * np.hypot(*after.T))
    start = int(np.argmax(np.round(bend, 6)))
    turned = np.roll(ring, -start, axis=0)
    plain = shapely.simplify(shapely.Polygon(turned), PLAIN, preserve_topology=True)
    points = {tuple(row) for row in shapely.get_coordinates(plain).tolist()}
    places = [k for k, row in enumerate(ring.tolist()) if tuple(row) in points]
    return places if len(places) >= 3 else list(range(len(ring)))


def _ends(rings: Rings, direction: Axis) -> tuple[list[int], list[int]]:
    """Return the edges of a plain polygon that get a gable, and those that may, best first."""
    contour = Contour.of(rings)
    faces = straight_skeleton(rings).faces
    along, _, _ = contour.frames()
    before = np.empty(len(along), dtype=np.int64)
    before[contour.following] = np.arange(len(along))
    facing = np.sum(along[before] * along[contour.following], axis=1) < OPPOSITE
    turn = turns(contour)
    ends = facing & (turn > 1e-6) & (turn[before] > 1e-6)
    small = np.array([len(face) == 3 or len(along) == 4 for face in faces])
    across = np.round(np.abs(along[:, 0 if direction == "x" else 1]), 6)
    length = np.hypot(*(contour.points[contour.following] - contour.points).T)
    ahead, beside = contour.following.tolist(), before.tolist()
    order = [k for k in np.argsort(across, kind="stable").tolist() if (ends & small)[k]]
    sure = _apart(order, ahead, beside)
    longest = max((float(length[k]) for k in sure), default=0.0)
    others = ends & ~small & (across < ACROSS) & (length > longest)
    order = [k for k in np.argsort(-np.round(length, 3), kind="stable").tolist() if others[k]]
    return sure, [k for k in _apart([*sure, *order], ahead, beside) if k not in sure]


def _apart(order: list[int], ahead: list[int], beside: list[int]) -> list[int]:
    """Return the edges, in order, that are no neighbours of one before them."""
    chosen: list[int] = []
    for edge in order:
        if ahead[edge] not in chosen and beside[edge] not in chosen:
            chosen.append(edge)
    return chosen
