"""Roofs that massgen takes from other buildings: what the element attributes do not tell of them.

A roof bit says gable or hip; whether a hip is a mansard, how steep it is and how far its eaves
stand out are those of a building of the library that is like the one asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.building import Building, Roof
from ..artifacts.store import read
from ..errors import InvalidInput
from .attributes import ROOF_OF_STYLE, attribute_matrix, building_attributes
from .library import Likeness

SIMILAR = 3  # buildings of which one is drawn
Roofs = Mapping[str, Roof]  # by roof bit: flat, gable, hip


class RoofLibrary:
    """Buildings' roofs by bit, of the largest general box that has such a one; sheds are none.

    A shed falls to one side, which depends on what it leans on.
    """

    def __init__(self, buildings: Iterable[Building]) -> None:
        """Raise InvalidInput where no building has a roof."""
        rows = [(building, roofs) for building in buildings if (roofs := _roofs(building))]
        if not rows:
            raise InvalidInput("the library's buildings have no roof; expected some with roofs")
        self._roofs = [roofs for _, roofs in rows]
        self._likeness = Likeness(
            attribute_matrix(building_attributes(building) for building, _ in rows)
        )

    def like(self, wanted: Attributes, *, rng: np.random.Generator) -> Roofs:
        """Return the roofs of one of the most similar buildings."""
        return self._roofs[self._likeness.nearest(wanted, SIMILAR, rng)[0]]


def read_roof_library(path: str) -> RoofLibrary:
    """Return the roofs of buildings (.json, .jsonl, folder)."""
    try:
        return RoofLibrary(read(path, Building))
    except InvalidInput as error:
        raise error.at(path) from None


def _roofs(building: Building) -> dict[str, Roof]:
    found: dict[str, Roof] = {}
    general = (box for box in building.boxes if box.kind == "general")
    for box in sorted(general, key=lambda box: -box.width * box.depth):
        if box.roof is not None and box.roof.style in ROOF_OF_STYLE and box.roof.style != "shed":
            found.setdefault(ROOF_OF_STYLE[box.roof.style], box.roof)
    return found
