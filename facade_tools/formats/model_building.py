"""A city model's building, with its neighbours, as a parametric building in its own frame."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Box, BoxKind, Building, ElementKind, Frame
from ..errors import InvalidInput
from ..geometry.arrays import Floats
from ..geometry.rectilinear import areas, main_direction, rotated
from .model_masses import Dormer, Mass, boxes_of, footprint, masses, on_the_roof
from .openings import Opening, opening_of, placed, side_of, storey_height
from .reading import Front
from .surfaces import Model, Surface, bounds, told

ADJOINS = 0.6  # metres between a house and a garage that belongs to it
LEAST_HOUSE = 4.0  # m²: a smaller footprint is no building
MOST_SURFACES = 200_000
HIGHEST = 400.0  # metres
LARGEST = 2000.0  # metres
DOOR_WEIGHT = 2.0  # the street side has the door
HIGHEST_PORCH = 4.5  # metres
QUARTERS = ("front", "right", "back", "left")
OPENINGS: tuple[ElementKind, ...] = ("window", "door")


@dataclass(frozen=True)
class Neighbour:
    """A building beside a house that belongs to it: its garage, or a canopy (a porch)."""

    model: Model
    kind: str


def building_of(
    model: Model, neighbours: Sequence[Neighbour], front: Front
) -> tuple[Building, Counter[str]]:
    """Return the building of a model and the rules applied.

    Raises InvalidInput where it makes no boxes.

    The building is partial: mass, garage and roof are complete, porches are unknown, and of the
    facades only the sides with openings were observed.
    """
    notes: Counter[str] = Counter()
    site = site_of(model, front, notes)
    local, frame, whole, details = site.model, site.frame, site.plan, site.details
    found = [*site.masses, *_neighbours(neighbours, frame, model.origin, whole, notes)]
    boxes, residual = boxes_of(found, notes)
    planes = [plane for mass in found if mass.kind == "general" for plane in mass.planes]
    stacks, dormers = on_the_roof(local, planes, details, 0.0)
    openings = list(_openings(local, whole, notes))
    eaves = max(box.height or 0.0 for box in boxes if box.kind == "general")
    building = Building(
        id=model.id,
        boxes=boxes,
        storey_height=_storey(openings, boxes, eaves, model.storeys),
        features=("chimney",) if stacks else (),
        chimneys=stacks,
        partial=True,
        complete=("mass", "garage", "roof"),
        frame=frame,
        tags=_tags(model, residual, dormers, openings),
    )
    return replace(building, facades=placed(building, openings, notes)), notes


@dataclass(frozen=True)
class Site:
    """A model in its own frame: its plan, what stands on it, and the small roofs above."""

    model: Model
    frame: Frame
    plan: BaseGeometry
    masses: list[Mass]
    details: list[Mass]


def site_of(model: Model, front: Front, notes: Counter[str]) -> Site:
    """Return a model in its own frame; raises InvalidInput where it is no building."""
    _refuse_implausible(model)
    plan = footprint(model)
    if plan.area < LEAST_HOUSE:
        raise InvalidInput(f"a footprint of {plan.area:.2f} m²; expected at least {LEAST_HOUSE:g}")
    local, frame, whole = _framed(model, plan, _rotation(model, plan, front))
    found, details = masses(local, 0.0, notes)
    if not found:
        raise InvalidInput("no roof higher than 1.6 m above its footprint; expected a building")
    return Site(local, frame, whole, found, details)


def _refuse_implausible(model: Model) -> None:
    surfaces = model.surfaces
    if not surfaces:
        raise InvalidInput("no surfaces; expected a building with LoD1, LoD2 or LoD3 geometry")
    if len(surfaces) > MOST_SURFACES:
        raise InvalidInput(f"{len(surfaces)} surfaces; expected at most {MOST_SURFACES}")
    everything = bounds([*surfaces, *(s for part in model.outside for s in part)])
    if not np.isfinite(everything).all():
        raise InvalidInput("a coordinate is no finite number")
    low, high = bounds(surfaces)
    size = high - low
    if size[2] > HIGHEST or max(size[:2]) > LARGEST:
        text = " × ".join(f"{value:.0f}" for value in size)
        raise InvalidInput(f"{text} m large; expected one building in metres")


# --- the frame ----------------------------------------------------------------------------------


def _rotation(model: Model, plan: BaseGeometry, front: Front) -> float:
    """Return the angle (degrees) from the building's own frame to the source's.

    The main direction of the footprint gives it up to right angles. The front is the side with
    most window and door area; without openings it is the long or the short side, as the user
    says, and of two such turns the smaller.
    """
    main = main_direction(plan)
    weights = _opening_area(model, main)
    if max(weights) > 0.0:
        turn = 90.0 * int(np.argmax(weights))
    else:
        turn = _turn_by_size(rotated(plan, -main), main, front)
    angle = (main + turn) % 360.0
    return angle - 360.0 if angle > 180.0 else angle


def _opening_area(model: Model, main: float) -> list[float]:
    """Return the opening area by quarter turn of the main direction: front, right, back, left."""
    c, s = math.cos(math.radians(-main)), math.sin(math.radians(-main))
    total = dict.fromkeys(QUARTERS, 0.0)
    for surface in model.surfaces:
        if surface.meaning in OPENINGS and abs(float(surface.normal[2])) < 0.5:
            x, y, _ = surface.normal.tolist()
            weight = DOOR_WEIGHT if surface.meaning == "door" else 1.0
            total[side_of(np.array([c * x - s * y, s * x + c * y]))] += weight * surface.area
    return [total[quarter] for quarter in QUARTERS]


def _turn_by_size(plan: BaseGeometry, main: float, front: Front) -> float:
    x0, y0, x1, y1 = plan.bounds
    if front == "unknown" or math.isclose(x1 - x0, y1 - y0, rel_tol=0.02):
        return 0.0
    across = (x1 - x0 < y1 - y0) == (front == "long")
    return (-90.0 if main > 0.0 else 90.0) if across else 0.0


def _framed(model: Model, plan: BaseGeometry, rotation: float) -> tuple[Model, Frame, BaseGeometry]:
    """Return the model in its own frame, the frame, and its plan there.

    The middle of the footprint's bounding box is the origin, the lowest ground its height.
    """
    turned = rotated(plan, -rotation)
    x0, y0, x1, y1 = turned.bounds
    middle = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0])
    ground = _ground(model)
    turn = _turn(-rotation)
    shift = np.array([-middle[0], -middle[1], -ground])
    local = replace(
        model,
        parts=tuple(tuple(s.moved(turn, shift) for s in part) for part in model.parts),
        outside=tuple(tuple(s.moved(turn, shift) for s in part) for part in model.outside),
    )
    back = _turn(rotation) @ np.array([*middle, ground])
    origin = tuple(round(float(a) + b, 6) for a, b in zip(back, model.origin, strict=True))
    frame = Frame(round(rotation, 9), origin, model.crs)
    return local, frame, shapely.transform(turned, lambda points: points - middle)


def _ground(model: Model) -> float:
    """Return the height on which the building stands: the lowest of its ground surfaces."""
    surfaces = [surface for part in model.parts for surface in told(part)]
    grounds = [s for s in surfaces if s.meaning == "ground"] or surfaces
    return float(bounds(grounds)[0][2])


def _turn(degrees: float) -> Floats:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


# --- neighbours ---------------------------------------------------------------------------------


def _neighbours(
    neighbours: Iterable[Neighbour],
    frame: Frame,
    origin: Sequence[float],
    house: BaseGeometry,
    notes: Counter[str],
) -> list[Mass]:
    """Return garages and porches that adjoin the house, moved up to it, in its frame."""
    found = []
    turn = _turn(-frame.rotation)
    for neighbour in neighbours:
        offset = np.array(neighbour.model.origin) - np.array(frame.shift)
        shift = turn @ offset
        parts = tuple(tuple(s.moved(turn, shift) for s in part) for part in neighbour.model.parts)
        near = replace(neighbour.model, parts=parts, outside=())
        for mass in masses(near, _ground(near), notes)[0]:
            plan = _moved_up(mass.plan, house)
            if plan is None:
                notes[f"{neighbour.kind} apart from its house: left out"] += 1
                continue
            kind: BoxKind = "garage" if neighbour.kind == "garage" else "porch"
            if kind == "porch" and mass.eaves > HIGHEST_PORCH:
                notes["canopy higher than 4.5 m: left out"] += 1
                continue
            found.append(Mass(plan, mass.eaves, mass.planes, mass.code, kind))
    return found


def _moved_up(plan: BaseGeometry, house: BaseGeometry) -> BaseGeometry | None:
    """Return the plan moved to touch the house, less the house; None where it is too far."""
    gap = plan.distance(house)
    if gap > ADJOINS:
        return None
    start, stop = shapely.get_coordinates(shapely.shortest_line(plan, house))[[0, -1]]
    moved = shapely.transform(plan, lambda points: points + (stop - start))
    free = areas(moved.difference(house))
    return free if free.area > 1.0 else None


# --- openings -----------------------------------------------------------------------------------


def _openings(local: Model, house: BaseGeometry, notes: Counter[str]) -> Iterable[Opening]:
    for kind, polygons in _grouped(local.surfaces):
        opening = opening_of(kind, polygons, house)
        if opening is None:
            notes[f"{kind} in a roof: left out"] += 1
        else:
            yield opening


def _grouped(surfaces: Iterable[Surface]) -> Iterable[tuple[ElementKind, list[Surface]]]:
    """Yield openings: polygons that the source calls one, in the order of the source."""
    groups: dict[tuple[ElementKind, int], list[Surface]] = {}
    for number, surface in enumerate(surfaces):
        for kind in OPENINGS:
            if surface.meaning == kind:
                groups.setdefault((kind, surface.group or -1 - number), []).append(surface)
    for (kind, _), polygons in groups.items():
        yield kind, polygons


def _storey(
    openings: Sequence[Opening], boxes: Sequence[Box], eaves: float, count: int | None
) -> float:
    """Return the storey height, low enough that every mass is higher than half of it."""
    lowest = min(box.height or 0.0 for box in boxes if box.kind != "porch")
    return min(storey_height(openings, eaves, count), round(1.99 * lowest, 4))


def _tags(
    model: Model, residual: float, dormers: Sequence[Dormer], openings: Sequence[Opening]
) -> dict[str, object]:
    seen: dict[str, object] = {
        "dormers": [asdict(dormer) for dormer in dormers],
        "openings": len(openings),
    }
    kept = {name: value for name, value in seen.items() if value}
    return {**source_tags(model), **kept, "plan_residual": round(residual, 6)}


def source_tags(model: Model) -> dict[str, object]:
    """Return what a source says of a model: function and roof codes."""
    codes = sorted({code for code in model.roof_types if code})
    said = {"function": model.function, "roof_types": codes}
    return {name: value for name, value in said.items() if value}
