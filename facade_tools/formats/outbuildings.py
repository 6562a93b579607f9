"""Garages, canopies and sheds: told by function code or size, given to the house they adjoin."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from .model_building import ADJOINS, Neighbour
from .model_masses import footprint
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


@dataclass
class Outbuildings:
    """The outbuildings of a file, waiting for their houses."""

    models: list[tuple[Model, str]]
    plans: list[BaseGeometry] = field(default_factory=list)
    taken: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Place all plans in the source's coordinates, for the search by distance."""
        self.plans = [placed_plan(model) for model, _ in self.models]
        self.tree = shapely.STRtree(self.plans)

    def of(self, house: Model) -> tuple[Neighbour, ...]:
        """Return the outbuildings that adjoin a house; each goes to the first that asks."""
        if not self.models:
            return ()
        plan = placed_plan(house)
        near = self.tree.query(plan, predicate="dwithin", distance=ADJOINS)
        fresh = [k for k in sorted(near.tolist()) if k not in self.taken]
        self.taken.update(fresh)
        rows = [self.models[k] for k in fresh]
        return tuple(Neighbour(model, kind) for model, kind in rows if kind != "shed")

    def left(self) -> list[str]:
        """Return the kinds of those that no house took."""
        return [kind for k, (_, kind) in enumerate(self.models) if k not in self.taken]


def placed_plan(model: Model) -> BaseGeometry:
    """Return a model's footprint in the source's coordinates."""
    offset = np.array(model.origin[:2])
    return shapely.transform(footprint(model), lambda points: points + offset)


def adjoining(small: Iterable[Model], boxes: Iterable[float]) -> list[Model]:
    """Return the small models whose bounding box is near that of a larger building.

    boxes: x0, y0, x1, y1 of each larger building in the source's coordinates, metres.
    """
    rows = np.fromiter(boxes, dtype=np.float64).reshape(-1, 4)
    tree = shapely.STRtree([shapely.box(*row) for row in rows])
    return [
        model
        for model in small
        if len(tree.query(placed_plan(model), predicate="dwithin", distance=ADJOINS))
    ]
