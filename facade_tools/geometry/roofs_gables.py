"""Which edges of a polygon carry a gable."""

from __future__ import annotations

import numpy as np
import shapely

from facade_tools.artifacts.building import Axis

from .arrays import Floats, Points2
from .polygons import Rings
from .skeleton import Contour, SkeletonFailed, straight_skeleton

PLAIN = 0.4  # metres: jogs and bends of a wall that its gable ignores
OPPOSITE = -0.8  # cosine of the angle between the two walls beside a gable


def turns(contour: Contour) -> Floats:
    """Return the sine of the turn (n,) at the end of each edge, positive to the left."""
    along, _, _ = contour.frames()
    after = along[contour.following]
    return np.asarray(along[:, 0] * after[:, 1] - along[:, 1] * after[:, 0])


def gable_edges(rings: Rings, direction: Axis) -> list[int]:
    """Return the edges that get a gable, numbered over the concatenated rings.

    They are found on the plan without jogs smaller than 0.4 m: ends whose hip is a triangle
    between walls that face each other. Where several meet, those come first that the ridge's
    direction runs into.
    """
    kept = [_corners(ring) for ring in rings]
    try:
        ends = _ends([ring[k] for ring, k in zip(rings, kept, strict=True)], direction)
    except SkeletonFailed:
        return []
    edges: list[int] = []
    first = first_kept = 0
    for ring, corners in zip(rings, kept, strict=True):
        for place, corner in enumerate(corners):
            if first_kept + place in ends:
                step = (corners[(place + 1) % len(corners)] - corner) % len(ring)
                edges += [first + (corner + k) % len(ring) for k in range(step)]
        first += len(ring)
        first_kept += len(corners)
    return edges


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


def _ends(rings: Rings, direction: Axis) -> set[int]:
    """Return the edges of a plain polygon that get a gable."""
    contour = Contour.of(rings)
    faces = straight_skeleton(rings).faces
    along, _, _ = contour.frames()
    before = np.empty(len(along), dtype=np.int64)
    before[contour.following] = np.arange(len(along))
    facing = np.sum(along[before] * along[contour.following], axis=1) < OPPOSITE
    turn = turns(contour)
    convex = (turn > 1e-6) & (turn[before] > 1e-6)
    small = np.array([len(face) == 3 or len(along) == 4 for face in faces])
    across = np.round(np.abs(along[:, 0 if direction == "x" else 1]), 6)
    chosen: set[int] = set()
    for k in np.argsort(across, kind="stable").tolist():
        beside = {int(before[k]), int(contour.following[k])}
        if facing[k] and convex[k] and small[k] and not beside & chosen:
            chosen.add(k)
    return chosen
