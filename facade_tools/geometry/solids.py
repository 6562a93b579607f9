"""Closed solids of buildings and footprints: ground, walls and roof in one surface."""

from __future__ import annotations

from facade_tools.artifacts.building import Box, Building
from facade_tools.artifacts.footprint import Footprint
from facade_tools.errors import InvalidInput

from .polygons import oriented
from .roofs import Patch, box_roof
from .solids_envelope import envelope_solid
from .solids_surface import Face, Label, Semantic, Solid, triangulated

__all__ = [
    "Face",
    "Label",
    "Semantic",
    "Solid",
    "building_solid",
    "footprint_solid",
    "roof_patches",
    "triangulated",
]


def building_solid(building: Building) -> Solid:
    """Return the union of the general and garage boxes with their roofs as one closed solid.

    Raises InvalidInput when there is no such box or a height is missing.
    """
    boxes = [box for box in building.boxes if box.kind != "porch"]
    if not boxes:
        raise InvalidInput("no general or garage box to build a solid of", pointer="/boxes")
    for place, box in enumerate(building.boxes):
        if box.kind != "porch" and not box.height:
            raise InvalidInput("a box needs a height", pointer=f"/boxes/{place}/height")
    return envelope_solid(roof_patches(boxes))


def roof_patches(boxes: list[Box]) -> list[Patch]:
    """Return the patches whose upper envelope is the roof of the union of the boxes."""
    return [patch for box in boxes for patch in box_roof(box)]


def footprint_solid(footprint: Footprint) -> Solid:
    """Return the extrusion of a footprint with its roof as one closed solid."""
    return envelope_solid([Patch(oriented(footprint.polygon), (0.0, 0.0, footprint.height))])
