"""Closed solids of buildings and footprints: ground, walls and roof in one surface."""

from __future__ import annotations

from facade_tools.artifacts.building import Building
from facade_tools.artifacts.footprint import Footprint
from facade_tools.errors import InvalidInput

from .roofs import footprint_patches, union_patches
from .solids_envelope import envelope_solid
from .solids_surface import Face, Label, Semantic, Solid, triangulated

__all__ = [
    "Face",
    "Label",
    "Semantic",
    "Solid",
    "building_solid",
    "footprint_solid",
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
    return envelope_solid(union_patches(boxes))


def footprint_solid(footprint: Footprint) -> Solid:
    """Return the extrusion of a footprint with its roof as one closed solid.

    Raises InvalidInput when its polygon has no area.
    """
    patches = footprint_patches(footprint)
    if not patches:
        raise InvalidInput("the polygon has no area", pointer="/polygon")
    return envelope_solid(patches)
