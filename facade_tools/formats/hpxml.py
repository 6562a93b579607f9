"""HPXML home surveys to attributes: no plan, but sizes, windows by direction, garage.

Everything that the survey does not observe is null. `docs/hpxml.md` states every rule.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO
from xml.etree.ElementTree import Element

from ..artifacts.attributes import (
    ROOF_BITS,
    Attributes,
    Bit,
    ElementAttributes,
    FacadeAttributes,
    MassAttributes,
    Number,
    Present,
)
from ..errors import InvalidInput
from . import xmltree
from .reading import BY_NAME, Built, ReadOptions, Record, read_whole
from .xmltree import number, text

FOOT = 0.3048
SQUARE_FOOT = FOOT**2
DETACHED = "single-family detached"
COMPASS = ("north", "northeast", "east", "southeast", "south", "southwest", "west", "northwest")
LEAST_GARAGE = 100.0 * SQUARE_FOOT  # m²: smaller garage slabs are the publisher's placeholders
ROUNDEST, RAGGED = 0.98, 4.0  # of perimeter²/(16 area), which is 1 for a square
LARGEST_JETTY = 1.25
GLASS_LIMIT = 0.8
CEILINGS = (2.0, 4.5)  # metres: plausible mean heights of a storey
ROOT = re.compile(rb"<([A-Za-z_][\w.-]*:)?HPXML[\s>/]")
OUTSIDE = ("outside", "ambient")  # the second of HPXML 2
WHOLE_WALL = 0.5  # share of the walls that must state a direction to be used by direction


def detect(head: bytes) -> bool:
    """Tell HPXML by its root element."""
    return ROOT.search(head) is not None


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a building.

    Raises InvalidInput where there is none.
    """
    root = xmltree.parse(read_whole(stream))
    buildings = root.findall("Building")
    if not buildings:
        raise InvalidInput("has no <Building>; expected a home survey")
    for index, building in enumerate(buildings):
        name = BY_NAME if len(buildings) == 1 else f"{BY_NAME}-{index + 1}"
        yield Record((name, building), pointer=f"/Building[{index + 1}]")


def build(record: Record, options: ReadOptions) -> Built:
    """Return the attributes of one home; raises InvalidInput unless it stands alone."""
    name, building = record.payload
    details = building.find("BuildingDetails")
    if details is None:
        raise InvalidInput("has no <BuildingDetails>; expected a home survey")
    said = "BuildingSummary/BuildingConstruction"
    facility = text(details, f"{said}/ResidentialFacilityType")
    if facility != DETACHED:
        raise InvalidInput(f"is {facility or 'of no stated type'}; expected {DETACHED}")
    notes: Counter[str] = Counter()
    storeys = number(text(details, f"{said}/NumberofConditionedFloorsAboveGrade")) or 0.0
    ceiling = _ceiling(details, said, notes)
    height = ceiling * storeys if ceiling and storeys else None
    plan = _plan(details, notes)
    arf = _arf(details, said, storeys, plan, notes)
    garage = _garage(details)
    mass = MassAttributes(
        bbox=(None, None, height),
        bdry=None if plan is None else plan.perimeter / math.sqrt(plan.area),
        arf=arf,
        garage=(0.0,) * 6 if garage is False else (None,) * 6,
    )
    attributes = Attributes(
        id=name,
        mass=mass,
        facade=FacadeAttributes(wwr=_glazing(details, notes)),
        element=ElementAttributes(roof=_roof_bits(details)),
        storey_height=round(ceiling, 4) if ceiling else 3.0,
        present=None if garage is None else Present(garage=garage),
    )
    return Built((attributes,), notes)


@dataclass(frozen=True, slots=True)
class Plan:
    """Area (m²) and perimeter (m) of the floor on the ground."""

    area: float
    perimeter: float


def _value(element: Element, name: str, factor: float = 1.0) -> float:
    return (number(text(element, name)) or 0.0) * factor


def _ceiling(details: Element, said: str, notes: Counter[str]) -> float | None:
    """Return the mean height of a storey: as stated, else volume over floor area (m)."""
    stated = number(text(details, f"{said}/AverageCeilingHeight"))
    volume = number(text(details, f"{said}/ConditionedBuildingVolume"))
    area = number(text(details, f"{said}/ConditionedFloorArea"))
    found = stated if stated else volume / area if volume and area else None
    if found is None or not CEILINGS[0] <= found * FOOT <= CEILINGS[1]:
        notes["storey lower than 2 m or higher than 4.5 m: height refused"] += 1
        return None
    return found * FOOT


def _ground_slabs(details: Element) -> list[Element]:
    slabs = details.findall("Enclosure//Slab")
    return [slab for slab in slabs if "garage" not in text(slab, "InteriorAdjacentTo")]


def _plan(details: Element, notes: Counter[str]) -> Plan | None:
    slabs = _ground_slabs(details)
    area = sum(_value(slab, "Area", SQUARE_FOOT) for slab in slabs)
    perimeter = sum(_value(slab, "ExposedPerimeter", FOOT) for slab in slabs)
    if area <= 0.0 or not ROUNDEST <= perimeter**2 / (16.0 * area) <= RAGGED:
        notes["perimeter of the slabs does not fit their area: plan refused"] += 1
        return None
    return Plan(area, max(perimeter, 4.0 * math.sqrt(area)))


def _arf(
    details: Element, said: str, storeys: float, plan: Plan | None, notes: Counter[str]
) -> tuple[Number, ...]:
    """Return the floors' shares: one floor, or two from the floor area and the slabs'."""
    if storeys == 1.0:
        return (1.0, 0.0, 0.0)
    if storeys > 2.0 or storeys < 1.0 or plan is None:
        return (None,) * 3
    below = sum(
        _value(slab, "Area", SQUARE_FOOT)
        for slab in _ground_slabs(details)
        if text(slab, "InteriorAdjacentTo") == "basement - conditioned"
    )
    total = _value(details, f"{said}/ConditionedFloorArea", SQUARE_FOOT) - below
    ratio = total / plan.area - 1.0
    if not 0.0 < ratio <= LARGEST_JETTY:
        notes["upper floor area does not fit the main floor's: arf refused"] += 1
        return (None,) * 3
    ratio = min(ratio, 1.0)
    return (1.0 / (1.0 + ratio), ratio / (1.0 + ratio), 0.0)


def _garage(details: Element) -> bool | None:
    """Tell an attached garage by its slab; None where only a placeholder or a wall speaks of it."""
    slabs = [
        slab
        for slab in details.findall("Enclosure//Slab")
        if "garage" in text(slab, "InteriorAdjacentTo")
    ]
    if any(_value(slab, "Area", SQUARE_FOOT) >= LEAST_GARAGE for slab in slabs):
        return True
    walls = details.findall("Enclosure/Walls/Wall")
    spoken = slabs or any("garage" in text(w, "ExteriorAdjacentTo") for w in walls)
    return None if spoken else False


# --- windows and roof ---------------------------------------------------------------------------


def _azimuth(element: Element, degrees: str, words: str) -> float | None:
    found = number(text(element, degrees))
    if found is not None:
        return found
    word = text(element, words)
    return 45.0 * COMPASS.index(word) if word in COMPASS else None


def _side(azimuth: float, front: float) -> int:
    """Return the index of the side: front, back, left, right; ties go to front and back."""
    turn = (azimuth - front) % 360.0
    if turn <= 45.0 or turn >= 315.0:
        return 0
    if 135.0 <= turn <= 225.0:
        return 1
    return 3 if turn > 225.0 else 2


def _glazing(details: Element, notes: Counter[str]) -> tuple[Number, ...]:
    """Return window area over wall area: front, back, left, right.

    A side's wall area is that of its walls where walls state directions, else a quarter of all.
    """
    site = details.find("BuildingSummary/Site")
    front = (
        None if site is None else _azimuth(site, "AzimuthOfFrontOfHome", "OrientationOfFrontOfHome")
    )
    if front is None:
        return (None,) * 4
    walls = _wall_areas(details, front)
    glass = [0.0] * 4
    for window in details.findall("Enclosure/Windows/Window"):
        azimuth = _azimuth(window, "Azimuth", "Orientation")
        if azimuth is None:
            notes["window without a direction: left out"] += 1
            continue
        glass[_side(azimuth, front)] += _value(window, "Area", SQUARE_FOOT)
    return tuple(_share(area, wall, notes) for area, wall in zip(glass, walls, strict=True))


def _wall_areas(details: Element, front: float) -> list[float]:
    outside = [
        wall
        for wall in details.findall("Enclosure/Walls/Wall")
        if text(wall, "ExteriorAdjacentTo") in OUTSIDE
        and text(wall, "InteriorAdjacentTo") in ("living space", "conditioned space")
    ]
    sides = [0.0] * 4
    for wall in outside:
        azimuth = _azimuth(wall, "Azimuth", "Orientation")
        if azimuth is not None:
            sides[_side(azimuth, front)] += _value(wall, "Area", SQUARE_FOOT)
    total = sum(_value(wall, "Area", SQUARE_FOOT) for wall in outside)
    if all(sides) and sum(sides) >= WHOLE_WALL * total:
        return sides
    return [total / 4.0] * 4


def _share(glass: float, wall: float, notes: Counter[str]) -> Number:
    if wall <= 0.0 or glass / wall > GLASS_LIMIT:
        notes["windows fill more than 0.8 of a side, or it has no wall: refused"] += 1
        return None
    return glass / wall


def _roof_bits(details: Element) -> dict[str, Bit]:
    """Return the flat bit by pitch; a slope does not tell gable from hip."""
    pitches = [number(text(roof, "Pitch")) for roof in details.findall("Enclosure//Roof")]
    known = [pitch for pitch in pitches if pitch is not None]
    flat = None if not known or len(known) < len(pitches) else int(any(p < 1.0 for p in known))
    only_flat = bool(known) and len(known) == len(pitches) and max(known) < 1.0
    sloped = 0 if only_flat else None
    return {name: flat if name == "flat" else sloped for name in ROOF_BITS}
