"""Which stretches of walls belong to a garage, also to one that lies under other boxes."""

from __future__ import annotations

from ..artifacts.building import Box, Building, Piece, Side
from .blocked import Wall, wall_of

NEAR = 1e-4  # what is closer than this is in the same place (m)
HOUSE_BESIDE = 1.6  # m of wall beside a garage in its plane that take a door or a window

Stretch = tuple[float, float]  # first and last u of a piece (m)


def garage_stretch(garage: Box, side: Side, piece: Piece) -> Stretch | None:
    """Return the part of a ground piece behind which the garage lies, or None.

    A garage under an upper storey has no eaves of its own: the wall there is a piece of the box
    above, but it is the garage's wall.

    >>> garage = Box("g", "garage", 8, 3, 4, 6, 2.6)
    >>> garage_stretch(garage, "front", Piece("front-1", "house", (0, 0, 0), 10, 3))
    (6.0, 10.0)
    >>> garage_stretch(garage, "left", Piece("left-1", "house", (0, 6, 0), 6, 3))
    """
    return None if piece.origin[2] > NEAR else stretch_of(garage, side, piece)


def house_beside(garage: Box, side: Side, piece: Piece) -> bool:
    """Tell whether a piece that names a garage is the house's wall, too: both in one plane."""
    stretch = garage_stretch(garage, side, piece)
    return stretch is not None and piece.width - (stretch[1] - stretch[0]) >= HOUSE_BESIDE


def stretch_of(box: Box, side: Side, piece: Piece) -> Stretch | None:
    """Return the part of a piece on whose plane a box has its wall of that side, or None."""
    wall = wall_of(side, piece)
    if abs(_extent(box, wall, wall.outwards)[1]) > NEAR:
        return None
    low, high = _extent(box, wall, wall.along)
    low, high = max(low, 0.0), min(high, piece.width)
    return (low, high) if high - low > NEAR else None


def drive_stretch(building: Building, garage: Box, side: Side, piece: Piece) -> Stretch | None:
    """Return the widest part of `garage_stretch` that no porch stands before, or None."""
    stretch = garage_stretch(garage, side, piece)
    free = [] if stretch is None else [stretch]
    wall = wall_of(side, piece)
    for porch in building.boxes:
        near, far = _extent(porch, wall, wall.outwards)
        if porch.kind == "porch" and near <= NEAR and far > NEAR:
            low, high = _extent(porch, wall, wall.along)
            free = [part for a, b in free for part in ((a, min(b, low)), (max(a, high), b))]
    free = [(a, b) for a, b in free if b - a > NEAR]
    return max(free, key=lambda part: part[1] - part[0], default=None)


def _extent(box: Box, wall: Wall, axis: tuple[float, float]) -> Stretch:
    """Return the extent of a box along an axis from the start of a wall (m)."""
    centre = (box.x - wall.start[0]) * axis[0] + (box.y - wall.start[1]) * axis[1]
    half = abs(axis[0]) * box.width / 2 + abs(axis[1]) * box.depth / 2
    return centre - half, centre + half
