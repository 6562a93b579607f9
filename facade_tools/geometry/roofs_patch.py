"""What roofs are made of: pieces of planes over polygons of the plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

from facade_tools.artifacts.building import Roof

from .polygons import Rings

FLAT = Roof("flat")
Plane = tuple[float, float, float]  # z = a·x + b·y + c
STEEPEST = 85.0  # degrees; a steeper pitch is taken as this
STEEP = 70.0  # lower slope of a mansard, degrees
STEEP_RISE = 2.2  # height of a mansard's lower slope, metres
SHALLOW = 25.0  # upper slope of a mansard whose pitch is above 45 degrees


@dataclass(frozen=True, slots=True)
class Patch:
    """One plane of a roof: z = a·x + b·y + c over a polygon of the plan.

    rings: outer ring counter-clockwise, holes clockwise (m). owner: id of the box. group: patches
    of one group tile a polygon and never cross one another.
    """

    rings: Rings
    plane: Plane
    owner: str = ""
    group: int = 0


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Plan rectangle (m) with the height of its eaves."""

    x0: float
    y0: float
    x1: float
    y1: float
    eaves: float


def slope_of(roof: Roof) -> float:
    """Return rise over run of a roof's pitch."""
    return math.tan(math.radians(min(max(roof.pitch, 0.0), STEEPEST)))


def mansard_profile(roof: Roof, half_span: float) -> tuple[float, float, float]:
    """Return width (m) and slope of a mansard's lower part, and the slope of its upper part.

    The lower part rises at 70 degrees (or the pitch, if steeper) by 2.2 m, but takes at most two
    fifths of the half span; the upper part has the pitch, or 25 degrees where that is above 45.
    """
    lower = math.tan(math.radians(max(STEEP, min(roof.pitch, STEEPEST))))
    upper = slope_of(roof) if roof.pitch <= 45.0 else math.tan(math.radians(SHALLOW))
    return min(STEEP_RISE / lower, 0.4 * half_span), lower, upper
