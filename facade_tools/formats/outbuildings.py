"""Garages, canopies and sheds: told by function code or size, given to the house they adjoin."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from .model_building import ADJOINS, Neighbour
from .model_masses import footprint
from .model_store import ModelStore, Numbers, PlanBoxes, plan_box
from .surfaces import Model, bounds

# Ends of function codes: of the German cadastre (AdV), and words of other sources.
KINDS = {
    "garage": re.compile(r"(^|_)(2463)$|garage|carport", re.I),
    "canopy": re.compile(r"(^|_)(1610)$|canopy|^roof$", re.I),
    "shed": re.compile(r"(^|_)(2723)$|^shed$|outbuilding", re.I),
}
SMALL_PLAN = 60.0  # m²: a building without a function, no larger and no higher than these,
SMALL_HEIGHT = 4.5  # metres, that adjoins a larger one, is its garage


def kind_of(function: str) -> str:
    """Return `garage`, `canopy` or `shed` for an outbuilding's function code, else nothing."""
    return next((kind for kind, pattern in KINDS.items() if pattern.search(function)), "")


def is_small(model: Model) -> bool:
    """Tell whether a model of unknown function has the size of a garage."""
    if model.function or not model.surfaces:
        return False
    low, high = bounds(model.surfaces)
    size = high - low
    return bool(size[0] * size[1] <= 2.0 * SMALL_PLAN and size[2] <= SMALL_HEIGHT) and (
        footprint(model).area <= SMALL_PLAN
    )


class Outbuildings:
    """The outbuildings of a file, waiting on disk for their houses."""

    def __init__(self) -> None:
        """Start without any."""
        self._waiting = ModelStore()
        self._kinds: list[str] = []
        self._by_size = Numbers()
        self._boxes = PlanBoxes()
        self._taken = bytearray()

    def add(self, model: Model, kind: str, by_size: bool = False) -> None:
        """Let an outbuilding wait; all are added before the first house asks.

        by_size: nothing but its size says what it is.
        """
        if by_size:
            self._by_size.add(len(self._waiting))
        self._boxes.add(len(self._waiting), model.crs, plan_box(model))
        self._waiting.add(model)
        self._kinds.append(sys.intern(kind))
        self._taken.append(0)

    def of(self, house: Model) -> tuple[Neighbour, ...]:
        """Return the outbuildings that adjoin a house; each goes to the first that asks."""
        if not house.surfaces:
            return ()
        near = [
            k for k in self._boxes.near(house.crs, plan_box(house), ADJOINS) if not self._taken[k]
        ]
        found = []
        plan = placed_plan(house) if near else None
        for number in near:
            model = self._waiting[number]
            if shapely.dwithin(plan, placed_plan(model), ADJOINS):
                self._taken[number] = 1
                found.append(Neighbour(model, self._kinds[number]))
        return tuple(row for row in found if row.kind != "shed")

    def left(self) -> Iterator[str | Model]:
        """Yield what no house took: its kind, or where only its size told it, itself."""
        for number, (kind, taken) in enumerate(zip(self._kinds, self._taken, strict=True)):
            if not taken:
                yield self._waiting[number] if number in self._by_size else kind


def placed_plan(model: Model) -> BaseGeometry:
    """Return a model's footprint in the source's coordinates."""
    offset = np.array(model.origin[:2])
    return shapely.transform(footprint(model), lambda points: points + offset)
