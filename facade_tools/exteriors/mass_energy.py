"""The mass energy of FW16 eq. 3."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.building import Box
from ..compiled import compiled
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Rectangles
from .attributes import attribute_vector, packed_boxes
from .mass_attributes import (
    ARF,
    BBOX,
    BCR,
    BDRY,
    FAR,
    GARAGE_AT,
    MASS_SIZE,
    PORCH_AT,
    mass_vector,
    plan_edges,
)
from .mass_layout import (
    CAPACITY,
    HEIGHT_LOCKED,
    LEAST_THICKNESS,
    PLAN_LOCKED,
    Layout,
    Work,
    attributes_of_layout,
    connected,
    new_layout,
    new_work,
    thinness,
)

DISCONNECTED = 1e6
MOST_BOXES = 10
ABSENT_NORM = 100.0  # stands for the squared norm of a target group that is 0

GROUPS: dict[str, slice] = {
    "bbox": slice(BBOX, BCR),
    "bcr": slice(BCR, BDRY),
    "bdry": slice(BDRY, FAR),
    "far": slice(FAR, ARF),
    "arf": slice(ARF, GARAGE_AT),
    "garage": slice(GARAGE_AT, PORCH_AT),
    "porch": slice(PORCH_AT, MASS_SIZE),
}
"""The seven mass attributes and their places; the porch is one group of 12."""


class Target(NamedTuple):
    """What an energy wants.

    values: (27,); weights: (27,) of each squared difference, 0 where the value is unknown and only
    a hint to the search. extra: how many general boxes may be added to the locked ones. tower:
    whether one box should suit a tower. styles: how many styles of roof the general boxes should
    carry. zones: (n, 4) plan rectangles before observed walls, where no box may stand that is not
    locked.
    """

    values: Floats
    weights: Floats
    storey_height: float
    extra: int
    tower: bool
    styles: int
    zones: Rectangles


def target_of(attributes: Attributes, without: Iterable[str] = ()) -> Target:
    """Return the target of an energy; unknown values and the groups `without` weigh nothing."""
    values = attribute_vector(attributes)[:MASS_SIZE]
    known = ~np.isnan(values)
    values = np.where(known, values, 0.0)
    weights = np.zeros(MASS_SIZE)
    for name, place in GROUPS.items():
        norm = float((values[place] ** 2).sum()) or ABSENT_NORM
        weights[place] = 0.0 if name in without else known[place] / norm
    tower = attributes.element.special.get("tower") == 1
    storey_height = float(attributes.storey_height)
    styles = max(sum(bit == 1 for bit in attributes.element.roof.values()), 1) + tower
    return Target(values, weights, storey_height, MOST_BOXES, tower, styles, np.empty((0, 4)))


@compiled
def layout_energy(layout: Layout, target: Target, work: Work) -> float:
    """Return E(M) of FW16 eq. 3; `work.values` then holds the attributes."""
    total = 0.0
    if attributes_of_layout(layout, target.storey_height, work):
        total += thinness(work, LEAST_THICKNESS)
    if not connected(layout):
        total += DISCONNECTED
    for i in range(MASS_SIZE):
        difference = work.values[i] - target.values[i]
        total += target.weights[i] * difference * difference
    return total


def layout_of(boxes: Iterable[Box], *, locked: bool = False) -> Layout:
    """Return boxes as a layout; `locked` ones keep their plan, and their height where known.

    Raises InvalidInput on more boxes than a search takes.
    """
    boxes = tuple(boxes)
    if len(boxes) > CAPACITY - 4:
        message = f"{len(boxes)} boxes; expected at most {CAPACITY - 4} for a generated mass"
        raise InvalidInput(message, pointer="/boxes")
    layout = new_layout()
    packed, kinds = packed_boxes(boxes)
    n = len(boxes)
    layout.rows[:n, :4] = plan_edges(packed)
    layout.rows[:n, 4] = packed[:, 4]
    layout.kinds[:n] = kinds
    if locked:
        layout.locks[:n] = PLAN_LOCKED + HEIGHT_LOCKED * ~np.isnan(packed[:, 4])
    return layout


def mass_energy(boxes: Iterable[Box], target: Target) -> tuple[float, dict[str, float]]:
    """Return E(M) of boxes and the share of each group, `topology` and `thickness` in it.

    The attributes are those of `mass_vector`, that is of `facade attributes`.
    """
    boxes = tuple(boxes)
    values = mass_vector(*packed_boxes(boxes), target.storey_height)
    terms = target.weights * (np.nan_to_num(values) - target.values) ** 2
    shares = {name: float(terms[place].sum()) for name, place in GROUPS.items()}
    layout, work = layout_of(boxes), new_work()
    shares["thickness"] = 0.0
    if attributes_of_layout(layout, target.storey_height, work):
        shares["thickness"] = float(thinness(work, LEAST_THICKNESS))
    shares["topology"] = 0.0 if connected(layout) else DISCONNECTED
    return sum(shares.values()), shares


def relative_residuals(shares: dict[str, float], least: float) -> dict[str, float]:
    """Return √share of the groups that miss their target by more than the relative `least`."""
    return {name: share**0.5 for name, share in shares.items() if share > least**2}
