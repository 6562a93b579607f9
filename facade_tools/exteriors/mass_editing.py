"""What an edit contradicts is drawn anew from the model (the suggestions of FW16 Fig. 19)."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..artifacts.attributes import Attributes, Bounds, Number, Present
from ..artifacts.building import Building
from ..artifacts.model import Model
from ..errors import Infeasible
from .attributes import NAMES, attribute_vector, attributes_of_vector, building_attributes
from .mass_attributes import GARAGE_AT
from .mass_energy import GROUPS
from .samples import sample_attributes

log = logging.getLogger("facade_tools.massgen")

CONTRADICTED = 1e-4  # share of the energy from which a group counts as contradicted
DIMENSIONS = ("bbox", "bcr", "bdry", "far", "arf")


def contradicted(shares: dict[str, float]) -> tuple[str, ...]:
    """Return the attribute groups that the best mass around an edit does not meet.

    Where one of the plan's or floors' groups is among them all five are: they are not independent.
    """
    missed = {name for name in GROUPS if shares[name] > CONTRADICTED}
    return tuple(
        name
        for name in GROUPS
        if name in missed or (name in DIMENSIONS and missed & set(DIMENSIONS))
    )


def loosened(attributes: Attributes, keep: Building, groups: tuple[str, ...]) -> Attributes:
    """Return the attributes with `groups` unknown, but for what the kept boxes say of them.

    Kept garages and porches are known to be there, with their size; the kept mass bounds bbox.
    """
    vector = attribute_vector(attributes)
    known = building_attributes(replace(keep, partial=True))
    seen = attribute_vector(known)
    for name in groups:
        vector[GROUPS[name]] = np.nan
    sizes = [GARAGE_AT + 6 * part + k for part in range(3) for k in (2, 3, 4)]
    for at in sizes:
        if not np.isnan(seen[at]):
            vector[at] = seen[at]
    free = attributes_of_vector(attributes.id, vector, attributes.storey_height)
    present = known.present or Present()
    return replace(
        free,
        bounds=known.bounds or Bounds((0.0, 0.0, 0.0)),
        present=Present(
            garage=_present(free.mass.garage, present.garage),
            porch_front=_present(free.mass.porch[0], present.porch_front),
            porch_back=_present(free.mass.porch[1], present.porch_back),
        ),
    )


def _present(values: tuple[Number, ...], seen: bool | None) -> bool | None:
    if seen is not None:
        return seen
    return None if values[2] is None else values[2] > 0


def suggestion(
    attributes: Attributes,
    keep: Building,
    shares: dict[str, float],
    model: Model,
    *,
    rng: np.random.Generator,
) -> Attributes | None:
    """Return attributes near the wanted ones that suit the edit; None where there is nothing to do.

    shares: those of the best mass around the edit. Groups that it misses are drawn from the
    model given all the others. Where the model knows no such building, less and less of what was
    wanted is held to (`_givens`); None also where nothing at all fits.
    """
    groups = contradicted(shares)
    if not groups:
        return None
    for given, what in _givens(attributes, keep, groups):
        try:
            (drawn,) = sample_attributes(model, 1, rng=rng, given=given)
        except Infeasible as error:
            log.info("%s: %s: %s", attributes.id, what, error)
            continue
        log.info("%s: drawn anew from the model: %s", attributes.id, what)
        return replace(drawn, id=attributes.id)
    log.warning("%s: the model has nothing that suits the edit", attributes.id)
    return None


def _givens(
    attributes: Attributes, keep: Building, groups: tuple[str, ...]
) -> Iterator[tuple[Attributes, str]]:
    """Yield what to hold to, and in words what is free, from most to least held to."""
    yield loosened(attributes, keep, groups), ", ".join(groups)
    mass = loosened(attributes, keep, tuple(GROUPS))
    blank = np.full(len(NAMES), np.nan)
    nothing = attributes_of_vector(attributes.id, blank, attributes.storey_height)
    free = replace(mass, facade=nothing.facade, element=nothing.element)
    yield free, "everything that the kept boxes do not show"
    width, depth, height = free.bounds.bbox_min if free.bounds else (0.0, 0.0, 0.0)
    if min(width, depth) > 0.0:
        for top in (None, height):
            same = replace(free, mass=replace(free.mass, bbox=(width, depth, top)))
            yield same, "everything, in the bounding box of the kept boxes"
