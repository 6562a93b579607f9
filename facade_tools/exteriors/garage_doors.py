"""The doors of garages, placed before the search."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from ..artifacts.building import SIDES, Building, Element, Piece, Side
from ..artifacts.library import Library, LibraryBuilding
from ..geometry.arrays import Floats, Rectangles
from ..geometry.checks import GARAGE_WALL, element_rectangles, overlaps

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

    blocked: by piece id, where none may be. sizes: as `garage_sizes` gives them. room: how much
    area the target ratio of a side leaves for garage doors (m²); the smallest door is placed even
    where that is too little.
    """
    doors: dict[str, tuple[Element, ...]] = {}
    for box in building.boxes:
        for side, piece in _walls(box.id, pieces) if box.kind == "garage" else ():
            placed = _widest(list(_rows(piece, sizes, blocked[piece.id])), room[side])
            if placed:
                doors[piece.id] = placed
                break
    return doors


def _walls(box: str, pieces: Mapping[Side, Sequence[Piece]]) -> list[tuple[Side, Piece]]:
    """Return the walls of a box that may take its door, the best first."""
    walls = [
        (side, piece)
        for side in SIDES
        for piece in pieces.get(side, ())
        if piece.box == box and _takes_door(piece)
    ]
    return sorted(walls, key=lambda wall: (wall[0] != "front", -wall[1].width))


def _takes_door(piece: Piece) -> bool:
    large = piece.width >= GARAGE_WALL[0] - 0.2 and piece.height >= GARAGE_WALL[1] - 0.1
    return large and piece.origin[2] < 1e-6 and not piece.elements


def garage_sizes(library: Library, entry: LibraryBuilding) -> list[Size]:
    """Return sizes of garage doors: the building's own first, then all of the library."""
    own = [part.substyle for part in entry.parts]
    order = [*own, *range(len(library.substyles))]
    styles = [library.substyles[k] for k in order if library.substyles[k].kind == "garage-door"]
    return list(dict.fromkeys([*((s.style, s.width, s.height) for s in styles), *PLAIN]))


def _rows(
    piece: Piece, sizes: Iterable[Size], blocked: Floats
) -> Iterator[tuple[float, tuple[Element, ...]]]:
    """Yield area and elements of each row of doors that fits: of each size one, or all that fit."""
    for style, width, height in sizes:
        width, tall = min(width, piece.width - 2 * BESIDE), min(height, piece.height - 0.15)
        most = max(int((piece.width - 2 * BESIDE + BETWEEN) / (width + BETWEEN)), 1)
        for count in sorted({most, 1}, reverse=True):
            gap = (piece.width - count * width) / (count + 1)
            row = tuple(
                Element("garage-door", style, round(gap + k * (width + gap), 3), 0.0, width, tall)
                for k in range(count)
            )
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
