"""HOT2000 house surveys (EnerGuide) to attributes: no plan, but sizes, windows and ceilings.

Everything that the survey does not observe is null. `docs/hot2000.md` states every rule.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import BinaryIO

from ..artifacts.attributes import (
    ROOF_BITS,
    WINDOW_BITS,
    Attributes,
    Bit,
    ElementAttributes,
    FacadeAttributes,
    MassAttributes,
    Number,
    Present,
)
from ..artifacts.documents import parse_json
from ..errors import InvalidInput
from .hot2000_files import (
    COMPASS,
    Foundation,
    House,
    Wall,
    Window,
    house_from_json,
    house_from_xml,
)
from .reading import Built, Front, ReadOptions, Record, read_whole

WIDEST, TALLEST, MOST = 6.0, 3.0, 20.0  # of one window entry: metres, metres, copies
LEAST_WALLS = 1.0  # m²: less is no wall
GLASS_LIMIT = 0.8  # of a side's wall; more is an entry error
LOWEST_EAVES, HIGHEST_EAVES = 2.0, 12.0  # metres
LEAST_LEVEL = 1.2  # metres: lower walls are knee walls, headers and dormers' cheeks
SMALL_LEVEL = 0.25  # of the main floor's perimeter: shorter ones are dormers and gables
ONE_WALL_FOR_ALL = 4.0  # metres: a wall as high as this stands for all storeys together
LONGEST_PLAN = 3.0  # length over width of a rectangular plan
ROUNDEST, RAGGED = 0.98, 4.0  # of perimeter²/(16 area), which is 1 for a square
LARGEST_JETTY = 1.25  # upper over main floor area; more stands above a garage
LEAST_UPPER = SMALL_LEVEL**2  # … less than a level of `SMALL_LEVEL` holds: one floor was entered
STOREYS = {
    "One storey": 1,
    "One and a half": 1,
    "Two storeys": 2,
    "Two and a half": 2,
    "Three storeys": 3,
}
ROOF_WALL = re.compile(r"gable|pign|cath|knee|dormer|lucarne|skylight|puits|header|attic|comble")
LEVELS = (
    (2, re.compile(r"third|3rd|\b3e|trois")),
    (1, re.compile(r"second|2nd|\b2e|\b2l|\buf\b|upper|sup[eé]r|\btop\b|haut")),
    (0, re.compile(r"main|rdc|\brc\b|rez|princ|1st|first|\b1er|\b1l|\bmf\b|ground")),
)
ROOF_OF_CEILING = {"Attic/gable": "gable", "Attic/hip": "hip", "Flat": "flat"}
SLOPING = ("Cathedral", "Scissor")  # ceilings under a gable or a hip
STYLE_OF_WINDOW = {
    "Picture": "fixed",
    "Hinged": "casement",
    "Slider": "sliding",
    "Slider with sash": "sash",
    "Semi-sash slider": "sash",
    "Double Hung": "sash",
    "Single Hung": "sash",
}
ABOVE_GRADE = ("Wall", "Door", "FloorHeader")
NO_WINDOW = ("Patio door", "Skylight")


def detect(head: bytes) -> bool:
    """Tell a house file, or a line of the extract, by its first bytes."""
    if b"<HouseFile" in head:
        return True
    line = head.lstrip().split(b"\n", 1)[0]
    return line.startswith(b"{") and all(
        key in line for key in (b'"plan_shape"', b'"foundations"', b'"area_above"')
    )


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield one record a house: a whole .h2k file, or each line of the extract."""
    first = stream.readline()
    if not first.lstrip().startswith(b"{"):
        yield Record(first + read_whole(stream))
        return
    number = 1
    while first:
        if first.strip():
            yield Record(None, line=number, data=first)
        first = stream.readline()
        number += 1


def build(record: Record, options: ReadOptions) -> Built:
    """Return the attributes of one house; raises InvalidInput where it is not one."""
    if record.data is None:
        house = house_from_xml(record.payload)
    else:
        row = parse_json(record.data)
        if not isinstance(row, dict):
            raise InvalidInput("is no object; expected a HOT2000 house")
        house = house_from_json(row)
    if not house.id:
        raise InvalidInput("has no identification; expected a HOT2000 house")
    return attributes_of(house, options.front)


def attributes_of(house: House, front: Front) -> Built:
    """Return the 49 attributes of a surveyed house, null where nothing was observed."""
    notes: Counter[str] = Counter()
    plan = _plan(house, notes)
    height, storeys = eaves_height(house, notes)
    rectangular = house.plan_shape == "Rectangular"
    width, depth = _sides(plan, front, notes) if rectangular else (None, None)
    far, arf = _floors(_upper_over_main(house, plan, storeys, notes), rectangular)
    garage = _garage(house)
    mass = MassAttributes(
        bbox=(width, depth, height),
        bcr=1.0 if rectangular else None,
        bdry=None if plan is None else plan.perimeter / math.sqrt(plan.area),
        far=far,
        arf=arf,
        garage=(0.0,) * 6 if garage is False else (None,) * 6,
    )
    facade = FacadeAttributes(wwr=_glazing(house, notes))
    attributes = Attributes(
        id=house.id,
        mass=mass,
        facade=facade,
        element=ElementAttributes(roof=_roof_bits(house.ceilings), window=_styles(house.windows)),
        storey_height=3.0 if height is None else round(height / storeys, 4),
        present=None if garage is None else Present(garage=garage),
    )
    return Built((attributes,), notes)


# --- plan ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Plan:
    """Area (m²) and perimeter (m) of the main floor."""

    area: float
    perimeter: float


def _plan(house: House, notes: Counter[str]) -> Plan | None:
    """Return the main floor as its foundation gives it: both numbers of one measurement.

    Several foundations are one floor, whose outline is the exposed part of theirs. Perimeters
    too short or too long for the area are refused.
    """
    if not house.foundations:
        notes["no foundation with area and perimeter: plan unknown"] += 1
        return None
    area = sum(item.area for item in house.foundations)
    perimeter = _outline(house.foundations)
    roundness = perimeter * perimeter / (16.0 * area)
    if not ROUNDEST <= roundness <= RAGGED:
        notes["perimeter does not fit the area: plan refused"] += 1
        return None
    return Plan(area, max(perimeter, 4.0 * math.sqrt(area)))


def _outline(foundations: tuple[Foundation, ...]) -> float:
    if len(foundations) == 1:
        return foundations[0].perimeter
    return sum(item.exposed or item.perimeter for item in foundations)


def _sides(plan: Plan | None, front: Front, notes: Counter[str]) -> tuple[Number, Number]:
    """Return width and depth of a rectangle of known area and perimeter."""
    if plan is None or front == "unknown":
        return None, None
    half = plan.perimeter / 4.0
    swing = math.sqrt(max(half * half - plan.area, 0.0))
    long, short = half + swing, half - swing
    if long > LONGEST_PLAN * short:
        notes["rectangular plan longer than 3 times its width: width and depth refused"] += 1
        return None, None
    return (long, short) if front == "long" else (short, long)


def _floors(ratio: float | None, rectangular: bool) -> tuple[Number, tuple[Number, ...]]:
    """Return far and arf from upper over main floor area; far needs bcr, that is a rectangle."""
    if ratio is None:
        return None, (None,) * 3
    total = 1.0 + ratio
    return (total if rectangular else None), (1.0 / total, ratio / total, 0.0)


def _upper_over_main(
    house: House, plan: Plan | None, levels: int, notes: Counter[str]
) -> float | None:
    if house.storeys == "One storey":
        return 0.0 if levels == 1 else None
    if house.storeys not in ("Two storeys", "One and a half") or plan is None:
        return None
    if not house.area_above:
        return None
    ratio = house.area_above / plan.area - 1.0
    if not LEAST_UPPER <= ratio <= LARGEST_JETTY:
        notes["upper floor area does not fit the main floor's: far and arf refused"] += 1
        return None
    return min(ratio, 1.0)


def _garage(house: House) -> bool | None:
    """Tell whether a wall adjoins an enclosed space; None where that may be an attic."""
    adjacent = [wall for wall in house.walls if wall.adjacent]
    if not adjacent:
        return False
    return True if any(not ROOF_WALL.search(wall.label.lower()) for wall in adjacent) else None


# --- heights ------------------------------------------------------------------------------------


def eaves_height(house: House, notes: Counter[str]) -> tuple[Number, int]:
    """Return the sum of the heights of the wall levels (m), and how many levels there are.

    Entries of one level (brick here, siding there) count once, with the mean of their heights
    weighted by length. Labels tell the level; where they do not, the number of storeys does.
    """
    named, unnamed = _by_level(house.walls)
    expected = STOREYS.get(house.storeys, 1)
    heights = [_mean_height(walls) for _, walls in sorted(named.items())]
    if heights and heights[0] >= ONE_WALL_FOR_ALL and len(heights) < expected:
        return _plausible(heights[0], expected, notes)
    if len(heights) < expected and unnamed:
        heights += _unnamed_heights(unnamed, expected - len(heights))
    if len(heights) < expected or not heights:
        notes["a storey has no wall of its own: eaves height unknown"] += 1
        return None, expected
    return _plausible(sum(heights), len(heights), notes)


def _plausible(height: float, storeys: int, notes: Counter[str]) -> tuple[Number, int]:
    if LOWEST_EAVES <= height <= HIGHEST_EAVES:
        return height, storeys
    notes["eaves lower than 2 m or higher than 12 m: refused"] += 1
    return None, storeys


def _by_level(walls: Iterable[Wall]) -> tuple[dict[int, list[Wall]], list[Wall]]:
    named: dict[int, list[Wall]] = {}
    unnamed = []
    for wall in _storey_walls(walls):
        level = _level(wall.label.lower())
        if level is None:
            unnamed.append(wall)
        else:
            named.setdefault(level, []).append(wall)
    ground = sum(wall.perimeter for wall in named.get(0, ()))
    for level in [level for level in named if level > 0]:
        if sum(wall.perimeter for wall in named[level]) < SMALL_LEVEL * ground:
            del named[level]
    return named, unnamed


def _storey_walls(walls: Iterable[Wall]) -> list[Wall]:
    return [
        wall
        for wall in walls
        if not wall.adjacent
        and wall.height >= LEAST_LEVEL
        and wall.perimeter > 0.0
        and not ROOF_WALL.search(wall.label.lower())
    ]


def _level(label: str) -> int | None:
    return next((level for level, pattern in LEVELS if pattern.search(label)), None)


def _mean_height(walls: list[Wall]) -> float:
    length = sum(wall.perimeter for wall in walls)
    return sum(wall.height * wall.perimeter for wall in walls) / length


def _unnamed_heights(walls: list[Wall], missing: int) -> list[float]:
    """Return heights of `missing` levels: one a wall if that fits, else the mean of all."""
    if len(walls) == missing:
        return [wall.height for wall in walls]
    mean = _mean_height(walls)
    return [mean / missing if mean >= ONE_WALL_FOR_ALL and missing > 1 else mean] * missing


# --- windows and roof ---------------------------------------------------------------------------


def _glazing(house: House, notes: Counter[str]) -> tuple[Number, ...]:
    """Return window area over a quarter of the exposed wall area: front, back, left, right."""
    wall_area = sum(wall.height * wall.perimeter for wall in _storey_walls(house.walls))
    if house.front not in COMPASS or wall_area < LEAST_WALLS:
        notes["no front direction or no wall: glazing unknown"] += 1
        return (None,) * 4
    glass = [0.0] * 4
    for window in filter(_on_a_wall, house.windows):
        if window.facing not in COMPASS:
            notes["window without a direction: left out"] += 1
            continue
        glass[_side(window.facing, house.front)] += _area(window, notes)
    return tuple(_share(area / (wall_area / 4.0), notes) for area in glass)


def _share(value: float, notes: Counter[str]) -> Number:
    if value > GLASS_LIMIT:
        notes["windows fill more than 0.8 of a side: refused"] += 1
        return None
    return value


def _on_a_wall(window: Window) -> bool:
    return window.parent in ABOVE_GRADE and window.tilt >= 80.0


def _side(facing: str, front: str) -> int:
    """Return the index of the side; oblique directions go to the nearer of front and back."""
    turn = (COMPASS.index(facing) - COMPASS.index(front)) % 8
    return (0, 0, 3, 1, 1, 1, 2, 0)[turn]


def _area(window: Window, notes: Counter[str]) -> float:
    width, height = min(window.width, WIDEST), min(window.height, TALLEST)
    count = min(window.count, MOST)
    if (width, height, count) != (window.width, window.height, window.count):
        notes["window wider than 6 m, higher than 3 m or more than 20 copies: clipped"] += 1
    return max(width, 0.0) * max(height, 0.0) * max(count, 0.0)


def _roof_bits(ceilings: tuple[str, ...]) -> dict[str, Bit]:
    """Return 1 for what is seen, 0 for the rest; null where a ceiling may lie under any of it.

    A sloping ceiling beside an attic lies under the attic's roof. Were the rest null there, a
    second kind would be known wherever it stands and nowhere that it does not.
    """
    seen = {ROOF_OF_CEILING[ceiling] for ceiling in ceilings if ceiling in ROOF_OF_CEILING}
    rest = [ceiling for ceiling in ceilings if ceiling not in ROOF_OF_CEILING]
    told: set[str] = set()
    if ceilings and all(ceiling in SLOPING for ceiling in rest):
        told = {"flat"} if rest and not seen - {"flat"} else set(ROOF_BITS)
    return {name: 1 if name in seen else 0 if name in told else None for name in ROOF_BITS}


def _styles(windows: tuple[Window, ...]) -> dict[str, Bit]:
    """Return 1 for what is seen, 0 where every window tells its style and none is of this one.

    The standard list has neither a bay nor a plain slider, so these are never observed absent.
    """
    asked = [w.style for w in windows if _on_a_wall(w) and w.style not in NO_WINDOW]
    seen = {STYLE_OF_WINDOW[style] for style in asked if style in STYLE_OF_WINDOW}
    told = bool(asked) and all(style in STYLE_OF_WINDOW for style in asked)
    absent = {name: 0 if told and name not in ("bay", "sliding") else None for name in WINDOW_BITS}
    return {name: 1 if name in seen else absent[name] for name in WINDOW_BITS}
