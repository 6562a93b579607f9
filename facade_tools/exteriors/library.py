"""The element library: substyles by k-means, parts a building, and the most similar building."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.building import SIDES, Building, Element, Piece, Side
from ..artifacts.documents import decode, parse_json
from ..artifacts.library import Level, Library, LibraryBuilding, Part, PartSide, Substyle
from ..artifacts.store import read
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Integers, Points2
from .attributes import NAMES, attribute_matrix, attribute_vector, building_attributes

SUBSTYLES = 5  # sizes a style (FW16 6.2)
ROUNDS = 50  # of k-means: it stops long before
_ELEMENT = ("roof", "window", "special")
_BITS = np.array([name.split(".")[0] in _ELEMENT for name in NAMES])
_NUMBERS = ~_BITS
Style = tuple[str, str]  # kind and style of an element
END: dict[Side, PartSide] = {"front": "front", "back": "back", "left": "end", "right": "end"}


@dataclass(frozen=True, slots=True)
class Seen:
    """One element of a training building, where it stands, and its head over the floor (m)."""

    element: Element
    side: PartSide
    level: Level
    head: float


class Likeness:
    """How like buildings are to one that is asked for, by their attributes (n, 49)."""

    def __init__(self, matrix: Floats) -> None:
        self.matrix = matrix
        known = ~np.isnan(matrix).all(axis=0)
        spread = np.ones(len(NAMES))
        if len(matrix) > 1:
            spread[known] = np.nanstd(matrix[:, known], axis=0)
        self.scale = np.where(spread > 1e-6, spread, 1.0)

    def distances(self, wanted: Attributes) -> Floats:
        """Return how unlike each building is to `wanted`: element bits first, then the numbers.

        Only numbers known on both sides count; a bit that differs outweighs all of them.
        """
        row = attribute_vector(wanted)
        difference = np.abs(self.matrix - row)
        bits = np.nansum(difference[:, _BITS], axis=1)
        rest = np.clip(difference[:, _NUMBERS] / self.scale[_NUMBERS], 0.0, 3.0)
        known = np.maximum((~np.isnan(rest)).sum(axis=1), 1)
        return np.asarray(bits + np.nansum(rest, axis=1) / known / 3.001)

    def nearest(self, wanted: Attributes, among: int, rng: np.random.Generator) -> list[int]:
        """Return those of the `among` most similar buildings with fewest wrong bits, shuffled."""
        distances = self.distances(wanted)
        order = np.argsort(distances, kind="stable")[:among]
        near = order[np.floor(distances[order]) == np.floor(distances[order[0]])]
        return [int(k) for k in rng.permutation(near)]


class ElementLibrary:
    """A library ready for use."""

    def __init__(self, library: Library) -> None:
        self.library = library
        self._likeness = Likeness(attribute_matrix(row.attributes for row in library.buildings))

    def nearest(
        self, wanted: Attributes, among: int, rng: np.random.Generator
    ) -> list[LibraryBuilding]:
        """Return the most similar buildings: `Likeness.nearest`."""
        return [self.library.buildings[k] for k in self._likeness.nearest(wanted, among, rng)]

    def observed(self, entry: LibraryBuilding, partial: Building) -> LibraryBuilding:
        """Return a library building whose windows are, in style and size, those of `partial`.

        Its doors stay, and all of its parts where nothing was observed.
        """
        styles = {(s.kind, s.style) for s in self.library.substyles}
        seen = [
            item
            for item in _seen(partial)
            if item.element.kind == "window" and ("window", item.element.style) in styles
        ]
        if not seen:
            return entry
        substyles = self.library.substyles
        doors = tuple(p for p in entry.parts if substyles[p.substyle].kind != "window")
        return replace(entry, parts=_parts(seen, substyles) + doors)


@cache
def default_library() -> ElementLibrary:
    """Return the library that ships with the package, made from the sample houses."""
    data = files(__package__).joinpath("library.json").read_bytes()
    return ElementLibrary(decode(parse_json(data), "library"))


def read_library(path: str) -> ElementLibrary:
    """Return the library of a prepared `library.json`, or of buildings (.json, .jsonl, folder)."""
    items = list(read(path, Library, Building))
    prepared = [item for item in items if isinstance(item, Library)]
    if prepared and len(items) > 1:
        raise InvalidInput("holds a library and more; expected one library, or buildings").at(path)
    try:
        return ElementLibrary(prepared[0] if prepared else build_library(items))
    except InvalidInput as error:
        raise error.at(path) from None


def build_library(buildings: Iterable[Building], identity: str = "library") -> Library:
    """Return the library of training buildings; sides that were not observed add nothing.

    Raises InvalidInput where there is no building, or not one window in all of them.
    """
    rows = [(building, list(_seen(building))) for building in buildings]
    sizes: dict[Style, list[tuple[float, float]]] = {}
    for _, elements in rows:
        for seen in elements:
            e = seen.element
            sizes.setdefault((e.kind, e.style), []).append((e.width, e.height))
    if not any(kind == "window" for kind, _ in sizes):
        raise InvalidInput("the library's buildings have no window; expected some with facades")
    substyles = [
        Substyle(kind, style, float(w), float(h))  # type: ignore[arg-type]
        for (kind, style), points in sorted(sizes.items())
        for w, h in np.round(kmeans(np.array(points), SUBSTYLES)[0], 3)
    ]
    entries = tuple(_entry(building, seen, substyles) for building, seen in rows)
    return Library(identity, tuple(substyles), entries)


def _seen(building: Building) -> Iterable[Seen]:
    for side in SIDES:
        if side in building.facades:
            for piece in building.facades[side].pieces:
                storey = storey_of(piece, building.storey_height)
                below = piece.origin[2] - storey * building.storey_height
                for e in piece.elements:
                    level: Level = "upper" if storey else "ground"
                    if e.style != "unknown":
                        yield Seen(e, END[side], level, below + e.v + e.height)


def storey_of(piece: Piece, storey_height: float) -> int:
    """Return the storey in which a piece lies; the ground floor is 0."""
    return int(np.floor(piece.origin[2] / storey_height + 1e-6))


def _entry(building: Building, seen: list[Seen], substyles: Sequence[Substyle]) -> LibraryBuilding:
    attributes = replace(building_attributes(building), provenance=None)
    return LibraryBuilding(building.id, attributes, _parts(seen, substyles), building.colors)


def _parts(seen: Iterable[Seen], substyles: Sequence[Substyle]) -> tuple[Part, ...]:
    groups: dict[tuple[int, PartSide, Level], list[Seen]] = {}
    for item in seen:
        key = closest(item.element, substyles), item.side, item.level
        groups.setdefault(key, []).append(item)
    return tuple(
        Part(index, side, level, len(items), *_averages(items))
        for (index, side, level), items in sorted(groups.items())
    )


def _averages(items: list[Seen]) -> tuple[float, float, float]:
    sizes = np.array([(item.element.width, item.element.height, item.head) for item in items])
    width, height, head = np.round(sizes.mean(axis=0), 3).tolist()
    return width, height, max(head, height)


def closest(element: Element, substyles: Sequence[Substyle]) -> int:
    """Return the index of the substyle of the element's style that is nearest in size."""
    same = [
        (abs(s.width - element.width) + abs(s.height - element.height), index)
        for index, s in enumerate(substyles)
        if (s.kind, s.style) == (element.kind, element.style)
    ]
    return min(same)[1]


def kmeans(points: Points2, count: int) -> tuple[Points2, Integers]:
    """Return at most `count` centres (k, 2) and each point's centre, without randomness.

    The first centre is the most frequent point; each next one is the point farthest from all
    centres (ties: the first), then Lloyd's rounds run until nothing moves.

    >>> kmeans(np.array([[0, 0], [0, 0], [4, 4.0]]), 5)[0].tolist()
    [[0.0, 0.0], [4.0, 4.0]]
    """
    distinct, counts = np.unique(np.round(points, 3), axis=0, return_counts=True)
    centres = distinct[[int(np.argmax(counts))]]
    while len(centres) < min(count, len(distinct)):
        away = np.linalg.norm(distinct[:, None] - centres[None], axis=2).min(axis=1)
        centres = np.vstack([centres, distinct[[int(np.argmax(away))]]])
    for _ in range(ROUNDS):
        label = _nearest_centre(points, centres)
        moved = np.array([points[label == k].mean(axis=0) for k in range(len(centres))])
        if np.array_equal(moved, centres):
            break
        centres = moved
    return centres, _nearest_centre(points, centres)


def _nearest_centre(points: Points2, centres: Points2) -> Integers:
    away = np.linalg.norm(points[:, None] - centres[None], axis=2)
    return np.asarray(away.argmin(axis=1), dtype=np.int64)
