"""The doors of garages, placed before the search."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from ..artifacts.building import SIDES, Box, Building, Element, Piece, Side
from ..artifacts.library import Library, LibraryBuilding
from ..geometry.arrays import Floats, Rectangles
from ..geometry.checks import GARAGE_WALL, element_rectangles, overlaps
from ..geometry.garage_walls import Stretch, drive_stretch

Size = tuple[str, float, float]  # style, width, height (m)
PLAIN: tuple[Size, ...] = (("sectional", 4.8, 2.1), ("sectional", 2.4, 2.1))
BESIDE = 0.25  # least wall beside a garage door (m)
BETWEEN = 0.3  # least wall between two (m)


def garage_doors(
    building: Building,
    pieces: Mapping[Side, Sequence[Piece]],
    blocked: Mapping[str, Rectangles],
    sizes: Sequence[Size],
    room: Mapping[Side, float],
) -> dict[str, tuple[Element, ...]]:
    """Return by piece id the doors of every garage: in its front wall, or else its widest.

    A garage under other boxes has its door in their wall. None stands behind a porch.

    blocked: by piece id, where none may be. sizes: as `garage_sizes` gives them. room: how much
    area the target ratio of a side leaves for garage doors (m²); the smallest door is placed even
    where that is too little.
    """
    doors: dict[str, tuple[Element, ...]] = {}
    for box in building.boxes:
        for side, piece, wall in _walls(building, box, pieces) if box.kind == "garage" else ():
            rows = list(_rows(piece, wall, sizes, blocked[piece.id]))
            placed = _widest(rows, room[side])
            if placed:
                doors[piece.id] = placed
                break
    return doors


def _walls(
    building: Building, garage: Box, pieces: Mapping[Side, Sequence[Piece]]
) -> list[tuple[Side, Piece, Stretch]]:
    """Return the walls of a garage that may take its door, the best first."""
    walls = [
        (side, piece, wall)
        for side in SIDES
        for piece in pieces.get(side, ())
        if (wall := drive_stretch(building, garage, side, piece)) and _takes_door(piece, wall)
    ]
    return sorted(walls, key=lambda row: (row[0] != "front", row[2][0] - row[2][1]))


def _takes_door(piece: Piece, wall: Stretch) -> bool:
    wide = wall[1] - wall[0] >= GARAGE_WALL[0] - 0.2
    return wide and piece.height >= GARAGE_WALL[1] - 0.1 and not piece.elements


def garage_sizes(library: Library, entry: LibraryBuilding) -> list[Size]:
    """Return sizes of garage doors: the building's own first, then all of the library."""
    own = [part.substyle for part in entry.parts]
    order = [*own, *range(len(library.substyles))]
    styles = [library.substyles[k] for k in order if library.substyles[k].kind == "garage-door"]
    return list(dict.fromkeys([*((s.style, s.width, s.height) for s in styles), *PLAIN]))


def _rows(
    piece: Piece, wall: Stretch, sizes: Iterable[Size], blocked: Floats
) -> Iterator[tuple[float, tuple[Element, ...]]]:
    """Yield area and elements of each row of doors that fits: of each size one, or all that fit."""
    start, length = wall[0], wall[1] - wall[0]
    for style, width, height in sizes:
        width, tall = min(width, length - 2 * BESIDE), min(height, piece.height - 0.15)
        most = max(int((length - 2 * BESIDE + BETWEEN) / (width + BETWEEN)), 1)
        for count in sorted({most, 1}, reverse=True):
            gap = (length - count * width) / (count + 1)
            at = [round(start + gap + k * (width + gap), 3) for k in range(count)]
            row = tuple(Element("garage-door", style, u, 0.0, width, tall) for u in at)
            if not overlaps(element_rectangles(row), blocked).any():
                yield count * width * tall, row


def _widest(rows: list[tuple[float, tuple[Element, ...]]], room: float) -> tuple[Element, ...]:
    """Return the first row of about the largest area within `room`, or else the smallest row."""
    if not rows:
        return ()
    within = [area for area, _ in rows if area <= room]
    wanted = max(within) / 1.05 if within else min(area for area, _ in rows)
    fitting = [row for area, row in rows if area >= wanted and (not within or area <= room)]
    return fitting[0] if within else min(rows, key=lambda pair: pair[0])[1]
