"""OpenStreetMap's Simple 3D Buildings tags to eaves and roof."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Axis, Roof, RoofStyle
from ..errors import InvalidInput
from .surfaces_roofs import CODES

LEVEL_HEIGHT = 3.0  # metres a level, as the tagging scheme says
LEAST_WALL = 2.5  # metres of wall that must stay under the roof
USUAL_PITCH: Mapping[RoofStyle, float] = {"shed": 10.0, "mansard": 30.0, "flat": 0.0}
USUAL = 30.0  # degrees, of every other style
STEEPEST = 75.0
LEVELS = 2  # of a building that states neither height nor levels
SMALL = ("garage", "garages", "carport", "shed", "hut", "roof", "kiosk", "greenhouse")
ALIASES = {
    "num_floors": "building:levels",
    "levels": "building:levels",
    "measuredheight": "height",
    "building_height": "height",
    "building:height": "height",
}
OTHER_THINGS = ("highway", "waterway", "landuse", "natural", "leisure", "railway", "boundary")
NUMBER = r"([0-9]+(?:[.,][0-9]+)?)"
LENGTH = re.compile(rf"[~≈]?\s*{NUMBER}\s*(m|metres?|meters?|mt|cm)?", re.I)
FEET = re.compile(
    rf"[~≈]?\s*{NUMBER}\s*(?:'|′|’|ft\.?|feet|foot)\s*(?:{NUMBER}\s*(?:\"|″|”|''|in\.?|inch|inches)?)?",
    re.I,
)
FOOT = 0.3048  # metres
SHAPES: Mapping[str, RoofStyle] = {
    **CODES,
    "conical": "cone",
    "cross-gabled": "gable",
    "crosspitched": "gable",
    "double-saltbox": "gable",
    "hipped-and-gabled": "hip",
    "lean-to": "shed",
    "pitched": "gable",
    "pyramid": "hip",
    "quadruple-saltbox": "gable",
    "shed": "shed",
    "side-half-hipped": "hip",
    "side-hipped": "hip",
}
READ = ("height", "building:levels", "roof:height", "roof:levels", "roof:angle", "roof:direction")
COMPASS = ("N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE")
QUARTERS = (("NORTH", "N"), ("EAST", "E"), ("SOUTH", "S"), ("WEST", "W"))
COMPASS_SOUTH = ("S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW")


@dataclass(frozen=True, slots=True)
class Shape:
    """Eaves (m) and roof of a footprint."""

    height: float
    roof: Roof


def length(value: object) -> float | None:
    """Return metres of a length as mappers write it (`7.5`, `7,5 m`, `24 ft`, `24'6"`), or None.

    Of several values (`2;3`) the first counts.
    """
    text = str(value).split(";")[0].strip()
    if match := FEET.fullmatch(text):
        return FOOT * (_decimal(match[1]) + _decimal(match[2] or "0") / 12.0)
    if match := LENGTH.fullmatch(text):
        return _decimal(match[1]) / (100.0 if (match[2] or "").lower() == "cm" else 1.0)
    return None


def _decimal(text: str) -> float:
    return float(text.replace(",", "."))


def canonical(tags: Mapping[str, object]) -> dict[str, object]:
    """Return tags under the names of OpenStreetMap, of those that others write otherwise.

    Upper case, `roof_shape` for `roof:shape`, `num_floors` and `measuredHeight`.
    """
    found: dict[str, object] = {}
    for key, value in tags.items():
        name = key.lower()
        name = ALIASES.get(name, re.sub(r"^(roof|building)_", r"\1:", name))
        if key == name or name not in tags:
            found[name] = value
    return found


def is_building(tags: Mapping[str, object]) -> bool:
    """Tell whether a polygon is a building: it says so, or it says nothing else."""
    if "building" in tags:
        return tags["building"] not in ("no", None)
    return not is_part(tags) and not any(key in tags for key in OTHER_THINGS)


def is_part(tags: Mapping[str, object]) -> bool:
    """Tell whether a polygon is a part of a building."""
    return tags.get("building:part") not in ("no", None, "")


def shape_of(
    tags: Mapping[str, object], plan: BaseGeometry, turn: float, notes: Counter[str]
) -> Shape:
    """Return eaves and roof of a building by its tags.

    plan: the footprint along the axes, metres; turn: degrees by which the map was turned
    clockwise to get there. The tag `height` is the roof's top: the roof is subtracted, and where
    less than 2.5 m of wall would be left, its pitch is lowered.

    Raises InvalidInput on eaves that no building has (below 1 m, above 500 m).
    """
    tags = _readable(canonical(tags), notes)
    style = SHAPES[str(tags.get("roof:shape", "flat"))]
    direction = _direction(tags, plan, turn, style)
    span = _span(plan, style, direction)
    pitch = _pitch(tags, style, span)
    total, eaves = _heights(tags, notes)
    if eaves is None:
        rise = span * math.tan(math.radians(pitch))
        eaves = (total or 0.0) - rise
        if eaves < LEAST_WALL and pitch > 0.0:
            notes["less than 2.5 m of wall under the roof: pitch lowered"] += 1
            eaves = min(LEAST_WALL, total or 0.0)
            pitch = math.degrees(math.atan2((total or 0.0) - eaves, span))
    if not 1.0 <= eaves <= 500.0:
        raise InvalidInput(f"eaves at {eaves:.2f} m; expected 1 m to 500 m")
    if pitch < 0.5:
        return Shape(round(eaves, 6), Roof("flat", 0.0, direction))
    return Shape(round(eaves, 6), Roof(style, round(pitch, 6), direction))


def _readable(tags: Mapping[str, object], notes: Counter[str]) -> dict[str, object]:
    """Return tags without those that say nothing that can be built, which are counted."""
    found = {key: value for key, value in tags.items() if value not in (None, "")}
    for name in READ:
        value = found.get(name, 0)
        if (_bearing(value) if name == "roof:direction" else length(_bare(value))) is None:
            notes[f"{name} cannot be read: taken as not stated"] += 1
            del found[name]
    shape = re.sub(
        r"[_ ]+", "-", str(found.get("roof:shape", "flat")).split(";")[0].strip().lower()
    )
    if shape not in SHAPES:
        notes["roof:shape is none that is built: flat"] += 1
        shape = "flat"
    if length(found.get("min_height", found.get("building:min_level", 0))):
        notes["begins above the ground: carried down to it"] += 1
    return {**found, "roof:shape": shape}


def _bare(value: object) -> str:
    return re.sub(r"\s*(°|deg(rees?)?)$", "", str(value).strip(), flags=re.I)


def states_height(tags: Mapping[str, object]) -> bool:
    """Tell whether tags say how high a building is; otherwise its height is assumed."""
    known = canonical(tags)
    return any(length(known.get(name, "")) for name in ("height", "building:levels"))


def _heights(tags: Mapping[str, object], notes: Counter[str]) -> tuple[float | None, float | None]:
    """Return the height of the roof's top, or that of the eaves, whichever is stated."""
    total = length(tags.get("height", ""))
    if total:
        return total, None
    levels = length(tags.get("building:levels", ""))
    if levels:
        return None, LEVEL_HEIGHT * levels
    notes["neither height nor levels: 6 m assumed, 3 m of a garage or shed"] += 1
    small = str(tags.get("building", "")) in SMALL
    return None, LEVEL_HEIGHT * (1 if small else LEVELS)


def _pitch(tags: Mapping[str, object], style: RoofStyle, span: float) -> float:
    if style == "flat":
        return 0.0
    angle = length(_bare(tags.get("roof:angle", "")))
    rise = length(tags.get("roof:height", ""))
    if rise is None and (levels := length(tags.get("roof:levels", ""))):
        rise = LEVEL_HEIGHT * levels
    if rise is not None and span > 0.0:
        return min(math.degrees(math.atan2(rise, span)), STEEPEST)
    return min(USUAL_PITCH.get(style, USUAL) if angle is None else angle, STEEPEST)


def _direction(
    tags: Mapping[str, object], plan: BaseGeometry, turn: float, style: RoofStyle
) -> Axis:
    """Return the axis of the ridge, or of a shed's fall, in the turned plan."""
    bearing = _bearing(tags.get("roof:direction"))
    x0, y0, x1, y1 = plan.bounds
    along: Axis = "x" if x1 - x0 >= y1 - y0 else "y"
    if bearing is not None:
        # The roof faces this way: counter-clockwise from east, then into the turned plan.
        faces = (90.0 - bearing - turn) % 180.0
        falls: Axis = "x" if faces < 45.0 or faces > 135.0 else "y"
        return falls if style == "shed" else _other(falls)
    across = str(tags.get("roof:orientation", "along")) == "across"
    ridge = _other(along) if across else along
    return _other(ridge) if style == "shed" else ridge


def _other(axis: Axis) -> Axis:
    return "y" if axis == "x" else "x"


def _bearing(value: object) -> float | None:
    text = _bare(value)
    points = COMPASS + COMPASS_SOUTH
    letters = re.sub(r"[-_ ]", "", text.upper())
    for word, letter in QUARTERS:
        letters = letters.replace(word, letter)
    if letters in points:
        return 22.5 * points.index(letters)
    size = length(text.removeprefix("-"))
    return -size if size and text.startswith("-") else size


def _span(plan: BaseGeometry, style: RoofStyle, direction: Axis) -> float:
    """Return the horizontal length over which the roof rises, metres."""
    x0, y0, x1, y1 = plan.bounds
    width, depth = x1 - x0, y1 - y0
    if style == "shed":
        return width if direction == "x" else depth
    if style == "gable":
        return (depth if direction == "x" else width) / 2.0
    return min(width, depth, 2.0 * _inradius(plan)) / 2.0


def _inradius(plan: BaseGeometry) -> float:
    circle = shapely.maximum_inscribed_circle(np.array([plan]), tolerance=0.05)
    return float(shapely.length(circle)[0])
