"""The upright faces of a slab's outline (LNSW13 4.1: every edge of a floor becomes a face)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.arrays import Booleans, Integers
from .remesh import Slab


@dataclass(frozen=True, slots=True)
class WallFace:
    """An upright rectangle of the outline of one slab.

    side: front, right, back or left. place: coordinate of its plane (y of front and back, x of
    the others). start, end: extent along the wall from left to right as seen from outside, as
    the coordinate x (front, back) or y (right, left). slab, block: indices.
    """

    side: str
    slab: int
    place: float
    start: float
    end: float
    bottom: float
    top: float
    block: int = 0

    @property
    def width(self) -> float:
        """Width along the wall (m)."""
        return abs(self.end - self.start)

    @property
    def height(self) -> float:
        """Height (m)."""
        return self.top - self.bottom

    @property
    def size(self) -> tuple[float, float]:
        """Width and height (m)."""
        return self.width, self.height


def wall_faces(slab: Slab, index: int) -> list[WallFace]:
    """Return the upright faces of a slab: one for every straight stretch of its outline."""
    return faces_towards(slab, np.pad(~slab.cells, 1, constant_values=True), index)


def faces_towards(slab: Slab, beyond: Booleans, index: int, block: int = 0) -> list[WallFace]:
    """Return the upright faces between a slab's cells and cells `beyond`.

    beyond: mask of the slab's grid with one cell more on every side.
    """
    return [face for side in SEEN for face in _faces(side, slab, beyond, (index, block))]


# side -> axis across the wall in the grid (0 rows), step towards the outside
SEEN = {"front": (0, -1), "back": (0, 1), "right": (1, 1), "left": (1, -1)}


def _faces(side: str, slab: Slab, beyond: Booleans, indices: tuple[int, int]) -> list[WallFace]:
    across, step = SEEN[side]
    own = np.pad(slab.cells, 1)
    places, along = (slab.ys, slab.xs) if across == 0 else (slab.xs, slab.ys)
    if across == 1:
        own, beyond = own.T, beyond.T
    low, high = (beyond[:-1], own[1:]) if step < 0 else (own[:-1], beyond[1:])
    walls = (low & high)[:, 1:-1]
    turned = side in ("back", "left")
    index, block = indices
    faces = []
    for line in np.flatnonzero(walls.any(axis=1)):
        for a, b in _runs(walls[line]):
            ends = float(along[a]), float(along[b])
            start, end = ends[::-1] if turned else ends
            place = float(places[line])
            faces.append(WallFace(side, index, place, start, end, slab.bottom, slab.top, block))
    return faces


def _runs(mask: Booleans) -> Integers:
    padded = np.concatenate([[False], mask, [False]])
    return np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)
