"""Roofs over unions of boxes and over polygons of maps (docs/roofs.md)."""

from __future__ import annotations

from .roofs_box import box_roof, rectangle_of
from .roofs_patch import Patch, Rectangle
from .roofs_polygon import footprint_patches, sloped_patches, truncated
from .roofs_union import union_patches

__all__ = [
    "Patch",
    "Rectangle",
    "box_roof",
    "footprint_patches",
    "rectangle_of",
    "sloped_patches",
    "truncated",
    "union_patches",
]
