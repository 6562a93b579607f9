"""The common second half of all city model formats: models to records to artifacts."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Building
from ..artifacts.documents import decode
from ..artifacts.footprint import Footprint
from ..errors import InvalidInput
from ..geometry.boxes import box_rectangles
from ..geometry.rectilinear import valid_polygon
from .model_building import ADJOINS, Neighbour, building_of, site_of, source_tags
from .model_masses import footprint
from .model_store import ModelStore, Numbers, PlanBoxes, plan_box
from .outbuildings import Outbuildings, is_small, kind_of
from .reading import Built, ReadOptions, Record
from .surfaces import Model
from .surfaces_roofs import roof_of

SAME = 2e-3  # metres


@dataclass(frozen=True, slots=True)
class Line:
    """Where the models that follow stand in a file of one feature a line."""

    number: int
    data: bytes


Models = Callable[[], Iterator[Model | InvalidInput | Line]]


@dataclass(frozen=True)
class House:
    """A model with the outbuildings that belong to it."""

    model: Model
    neighbours: tuple[Neighbour, ...] = ()


def records(models: Models, options: ReadOptions) -> Iterator[Record]:
    """Yield a record for every building; outbuildings go to the house that they adjoin.

    `models` reads the file from its start each time it is called: once to find the outbuildings,
    which wait on disk, once to give them away. Footprints need no more than the second.
    """
    alone = options.kind == "footprints"
    outbuildings, numbers = (Outbuildings(), Numbers()) if alone else _outbuildings(models)
    number = -1
    line: Line | None = None
    for model in models():
        if isinstance(model, Line):
            line = model
            continue
        number += 1
        if isinstance(model, InvalidInput):
            yield _record(model, line, model.place.pointer)
        elif model.artifact is not None:
            yield _record(House(model), line, f"/{model.id}")
        elif number not in numbers:
            yield _record(House(model, outbuildings.of(model)), line, f"/{model.id}")
    for left in outbuildings.left():
        if isinstance(left, Model):
            yield Record(House(left), pointer=f"/{left.id}")
        else:
            yield Record(Counter({f"{left} that adjoins no house: left out": 1}))


def _record(payload: House | InvalidInput, line: Line | None, pointer: str) -> Record:
    if line is None:
        return Record(payload, pointer=pointer)
    return Record(payload, line.number, pointer, line.data)


def _outbuildings(models: Models) -> tuple[Outbuildings, Numbers]:
    """Return the outbuildings of a file, and the places of them among its models."""
    found, numbers = Outbuildings(), Numbers()
    small, places = ModelStore(), array("q")
    large = PlanBoxes()
    number = -1
    for model in models():
        number += not isinstance(model, Line)
        if not isinstance(model, Model) or not model.surfaces or model.artifact is not None:
            continue
        kind = kind_of(model.function)
        if kind:
            numbers.add(number)
            found.add(model, kind)
        elif is_small(model):
            small.add(model)
            places.append(number)
        else:
            large.add(number, model.crs, plan_box(model))
    for place, number in enumerate(places):
        model = small[place]
        if large.near(model.crs, plan_box(model), ADJOINS):
            numbers.add(number)
            found.add(model, "garage", by_size=True)
    return found, numbers


def build(record: Record, options: ReadOptions) -> Built:
    """Return the artifacts of a record; raises InvalidInput where it makes none."""
    payload = record.payload
    if isinstance(payload, InvalidInput):
        raise payload
    if isinstance(payload, Counter):
        return Built((), payload)
    house: House = payload
    ours, notes = exported(house.model)
    if ours is not None and options.kind != "footprints":
        return Built((ours,), notes)
    if options.kind == "footprints":
        return footprint_of(house.model, options)
    building, applied = building_of(house.model, house.neighbours, options.front)
    return Built((building,), notes + applied)


def exported(model: Model) -> tuple[Building | Footprint | None, Counter[str]]:
    """Return the artifact that our own export left in a model, if the model still looks like it.

    The plans of both must have the same area and perimeter (2 mm along the outline), so that a
    model edited elsewhere is read by its geometry.
    """
    notes: Counter[str] = Counter()
    if model.artifact is None or not model.surfaces:
        return None, notes
    artifact: Building | Footprint = decode(model.artifact, "building", "footprint")
    seen, stored = footprint(model), _plan(artifact)
    alike = abs(seen.area - stored.area) <= SAME * stored.length
    if alike and abs(seen.length - stored.length) <= SAME * (8.0 + 0.1 * stored.length):
        return artifact, notes
    notes["geometry differs from the artifact stored with it: geometry read"] += 1
    return None, notes


def _plan(artifact: Building | Footprint) -> BaseGeometry:
    if isinstance(artifact, Footprint):
        return valid_polygon([np.array(ring) for ring in artifact.polygon])
    rectangles = box_rectangles([box for box in artifact.boxes if box.kind != "porch"])
    return shapely.union_all([shapely.box(*row) for row in rectangles], grid_size=1e-4)


def footprint_of(model: Model, options: ReadOptions) -> Built:
    """Return the plan of a model in its own frame, with eaves and roof of its largest mass."""
    notes: Counter[str] = Counter()
    site = site_of(model, options.front, notes)
    parts = shapely.get_parts(site.plan)
    if len(parts) > 1:
        notes["plan in several pieces: its largest kept"] += 1
    polygon = shapely.orient_polygons(max(parts, key=lambda part: part.area))
    rings = [
        tuple(tuple(row) for row in np.round(points, 6).tolist())
        for ring in shapely.get_rings(polygon)
        if len(points := shapely.get_coordinates(ring)[:-1]) >= 3
    ]
    largest = max(site.masses, key=lambda mass: mass.plan.area)
    roof = roof_of(largest.planes, largest.plan, largest.code, notes)
    roof = replace(roof, pitch=round(roof.pitch, 4))
    tags = source_tags(model)
    found = Footprint(model.id, tuple(rings), largest.eaves, roof, site.frame, tags)
    return Built((found,), notes)
