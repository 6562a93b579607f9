"""Facades for a whole building: from a mass and attributes to windows and doors (FW16 6.2)."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, islice

import numpy as np

from ..artifacts.attributes import WINDOW_BITS, Attributes, FacadeAttributes
from ..artifacts.building import SIDES, Building, Element, Energy, Facade, Piece, Side
from ..artifacts.library import LibraryBuilding
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Rectangles
from ..geometry.blocked import blocked_walls
from ..geometry.garage_walls import house_beside
from ..geometry.pieces import facade_pieces
from .attributes import building_attributes
from .designed import Designer, designed_pieces
from .facade_energy import LEAST_TARGET, energy, has_door, side_targets, widths
from .facade_layout import OPEN
from .facade_layout import Side as SearchSide
from .facade_parts import (
    Codes,
    MainDoor,
    PartRow,
    fitting_door,
    main_doors,
    part_rows,
    reachable,
    usual_heads,
)
from .facade_site import Solution, facade_of, search_side_of, storey_heads, with_door
from .garage_doors import garage_doors, garage_sizes
from .genetic import Search, search_side
from .kept import Standing, refuse_contradictions, standing_sides
from .library import ElementLibrary, default_library
from .palette import house_colors

log = logging.getLogger("facade_tools.facadegen")

# The main door is in the front, or else in the first of the others that takes it.
ENTRANCES: tuple[Side, ...] = ("front", "left", "right", "back")

SIMILAR = 3  # buildings that may lend their elements, in random order
TRIES = 3  # walls of one rank in which the main door is tried where the first does not do
ENOUGH = 5e-3  # energy over its lower bound that needs no elements of another library building
GOOD = 2e-3  # energy of a side over its lower bound that needs no further try
MAIN_DOOR_AREA = 2.0  # set aside before the garage door is chosen (m²)
MISSED = 0.05  # relative difference from which an attribute counts as not met


@dataclass(frozen=True, slots=True)
class FacadeOptions:
    """How facades are made.

    library: where elements come from; None: the shipped one. keep: a partial building whose listed
    sides were observed. candidates: how many different buildings to make of each. designs: sides
    whose largest wall is designed.
    """

    library: ElementLibrary | None = None
    keep: Building | None = None
    candidates: int = 1
    search: Search = field(default_factory=Search)
    designs: Mapping[Side, Designer] = field(default_factory=dict)


def generate_facades(
    building: Building,
    options: FacadeOptions = FacadeOptions(),
    *,
    rng: np.random.Generator,
) -> Iterator[Building]:
    """Yield a building with windows and doors on all sides, `options.candidates` times.

    Targets come from `building.targets`; where it has none, from the most similar building of
    the library. Elements of `options.keep` stay to the millimetre and nothing is added to the
    sides that it lists. Several candidates get `-1`, `-2`, … after the building's id. Raises
    InvalidInput on a partial building and on a side both kept and designed, Infeasible where a kept
    element has no wall.
    """
    _refuse_unfinished(building)
    _refuse_designed(options)
    shelf = options.library or default_library()
    pieces = facade_pieces(building)
    blocked = blocked_walls(building, pieces)
    designed = designed_pieces(building, pieces, blocked, options.designs)
    among = max(SIMILAR, options.candidates)
    for number, own in enumerate(rng.spawn(options.candidates), start=1):
        identity = building.id if options.candidates == 1 else f"{building.id}-{number}"
        similar = shelf.nearest(_known(building, options.keep), among, own)
        wanted = _wanted(building, similar[0])
        if options.keep is not None:
            similar = [shelf.observed(entry, options.keep) for entry in similar]
        walls = _Walls(pieces, blocked, designed)
        tries = (_Attempt(building, walls, shelf, entry, options, own) for entry in similar)
        done = replace(_first_good(attempt.finished(wanted) for attempt in tries), id=identity)
        if not _has_main_door(done):
            log.warning("%s: no main door: no wall is left that takes one", identity)
        yield done


def _has_main_door(building: Building) -> bool:
    pieces = [piece for facade in building.facades.values() for piece in facade.pieces]
    return any(e.main for piece in pieces for e in piece.elements)


def _first_good(attempts: Iterable[tuple[Building, float]]) -> Building:
    """Return the first building whose energy is near its lower bound, or else the best."""
    best, least = None, np.inf
    for building, excess in attempts:
        if best is None or excess < least:
            best, least = building, excess
        if least <= ENOUGH:
            break
    assert best is not None
    return best


def _refuse_unfinished(building: Building) -> None:
    if building.partial or any(box.height is None for box in building.boxes):
        message = "a partial building has no mass for facades; run facade massgen --keep first"
        raise InvalidInput(message, pointer="/partial")
    if all(box.kind == "porch" for box in building.boxes):
        raise InvalidInput("no general or garage box; expected at least one", pointer="/boxes")


def _refuse_designed(options: FacadeOptions) -> None:
    for side in options.keep.facades if options.keep else ():
        if side in options.designs:
            message = (
                f"the {side} was observed (keep) and cannot be designed; expected another side"
            )
            raise InvalidInput(message)


def _known(building: Building, keep: Building | None) -> Attributes:
    """Return what is known for choosing the library's building.

    The mass; its targets' bits, or else its own and those of the windows that were observed; the
    facade attributes of observed sides.
    """
    bare = building_attributes(replace(building, facades={}))
    if keep is not None:
        seen = building_attributes(replace(keep, partial=True))
        bare = replace(bare, facade=seen.facade)
    if building.targets is not None:
        return replace(bare, element=building.targets.element)
    windows = dict.fromkeys(WINDOW_BITS) if keep is None else seen.element.window
    return replace(bare, element=replace(bare.element, window=windows))


def _wanted(building: Building, entry: LibraryBuilding) -> FacadeAttributes:
    return entry.attributes.facade if building.targets is None else building.targets.facade


@dataclass(frozen=True, slots=True)
class _Walls:
    """The pieces of a building by side; by their ids, where no element may be, and its design."""

    pieces: Mapping[Side, Sequence[Piece]]
    blocked: Mapping[str, Rectangles]
    designed: Mapping[str, tuple[Element, ...]]


@dataclass(frozen=True, slots=True)
class _Attempt:
    """One candidate in the making: the building, its elements' source, its random numbers."""

    building: Building
    walls: _Walls
    shelf: ElementLibrary
    entry: LibraryBuilding
    options: FacadeOptions
    rng: np.random.Generator

    def finished(self, wanted: FacadeAttributes) -> tuple[Building, float]:
        """Return the building with facades, colours and energy, and the energy over its bound."""
        colors = self.building.colors or house_colors([self.entry], rng=self.rng)
        facades, excess = self._facades(wanted)
        done = replace(self.building, facades=facades, colors=colors)
        return replace(done, energy=_energy(done, wanted)), excess

    def _facades(self, wanted: FacadeAttributes) -> tuple[dict[Side, Facade], float]:
        library = self.shelf.library
        sides = self._standing(wanted)
        front = next(side for side in sides if side.name == "front")
        free = [piece for piece in front.pieces if piece.id not in front.closed]
        parts, usual = reachable(part_rows(library, self.entry), usual_heads(library, self.entry))
        rows, codes = fitting_door(parts, free), Codes()
        heads = storey_heads(self.building, sides, usual)
        known = [e for side in sides for piece in side.pieces for e in piece.elements]
        doorless = not any(e.main for e in known)
        targets = side_targets(wanted)
        facades: dict[Side, Facade] = {}
        excess = 0.0
        while len(facades) < len(SIDES):
            order = ENTRANCES if doorless else SIDES
            name = next(side for side in order if side not in facades)
            standing = sides[SIDES.index(name)]
            plain = search_side_of(self.building, standing, rows, codes, heads, self.walls.blocked)
            doors = self._main_doors(standing, plain, rows) if doorless else []
            found, main = self._best(plain, doors, targets[SIDES.index(name)])
            doorless = doorless and main < 0
            facades[standing.name] = facade_of(standing, plain, found, codes, main)
            excess += found.energy - found.least
        return {side: facades[side] for side in SIDES}, excess

    def _standing(self, wanted: FacadeAttributes) -> list[Standing]:
        """Return the sides with known elements and garage doors."""
        keep, library = self.options.keep, self.shelf.library
        made, blocked = self.walls.pieces, self.walls.blocked
        sides = [
            _with_elements(side, self.walls.designed)
            for side in standing_sides(self.building, made, keep)
        ]
        refuse_contradictions(sides)
        free = {s.name: [p for p in s.pieces if p.id not in s.closed] for s in sides}
        room = {
            name: _area(pieces, ratio) - (name == "front") * MAIN_DOOR_AREA
            for (name, pieces), ratio in zip(made.items(), wanted.wwr, strict=True)
        }
        sizes = garage_sizes(library, self.entry)
        doors = garage_doors(self.building, free, blocked, sizes, room)
        return [_with_garage_doors(side, doors, self.building) for side in sides]

    def _main_doors(
        self, standing: Standing, plain: SearchSide, rows: Sequence[PartRow]
    ) -> list[MainDoor]:
        free = [bool(value) for value in plain.room[:, OPEN]]
        return main_doors(self.building, standing.name, standing.pieces, free, rows)

    def _best(
        self, plain: SearchSide, doors: Sequence[MainDoor], targets: Floats
    ) -> tuple[Solution, int]:
        """Return the best layout of a side over the walls of the first rank that has room."""
        best, main, homeless = None, -1, True
        for _, rank in groupby(doors or [MainDoor()], key=lambda door: door.rank):
            for door in islice(rank, TRIES):
                side, least = with_door(plain, door, targets)
                genome, counts, value = search_side(side, self.options.search, least, rng=self.rng)
                missing = door.piece >= 0 and not has_door(side, genome, counts)
                if best is None or (missing, value) < (homeless, best.energy):
                    best = Solution(genome, counts, widths(side, genome, counts), value, least)
                    main, homeless = -1 if missing else door.piece, missing
                if value <= least + GOOD and not missing:
                    break
            if not homeless:
                break
        assert best is not None
        return best, main


def _with_elements(side: Standing, elements: Mapping[str, tuple[Element, ...]]) -> Standing:
    """Return a side whose pieces have the elements given by piece id, and take no more."""
    pieces = tuple(replace(p, elements=elements.get(p.id, p.elements)) for p in side.pieces)
    return replace(
        side, pieces=pieces, closed=side.closed | {p.id for p in pieces if p.id in elements}
    )


def _with_garage_doors(
    side: Standing, doors: Mapping[str, tuple[Element, ...]], building: Building
) -> Standing:
    """Return a side with garage doors: a garage's own wall takes no more, a house's wall does.

    Where house and garage stand in one plane the wall is of both, though it names the garage.
    """
    done = _with_elements(side, doors)
    garages = {box.id: box for box in building.boxes if box.kind == "garage"}
    own = {
        p.id
        for p in done.pieces
        if p.id in doors and p.box in garages and not house_beside(garages[p.box], side.name, p)
    }
    return replace(done, closed=side.closed | own)


def _area(pieces: Sequence[Piece], ratio: float | None) -> float:
    """Return the area of elements (m²) that a target ratio means."""
    return np.inf if ratio is None else ratio * sum(p.width * p.height for p in pieces)


def _energy(done: Building, wanted: FacadeAttributes) -> Energy:
    """Return the energy with what was not met, named `wwr.front` and so on."""
    reached = building_attributes(done).facade
    residuals = {}
    for name in ("wwr", "sym", "align"):
        pairs = zip(SIDES, getattr(reached, name), getattr(wanted, name), strict=True)
        for side, value, target in pairs:
            if value is not None and target is not None:
                off = abs(value - target) / max(target, LEAST_TARGET)
                if off > MISSED:
                    residuals[f"{name}.{side}"] = off
    before = done.energy or Energy()
    merged = {**before.residuals, **residuals}
    return replace(before, facade=energy(reached, wanted), residuals=merged)
