"""Floors of a building: which boxes reach into which storey."""

from __future__ import annotations

from ..artifacts.building import Box, Building
from .arrays import Rectangles
from .boxes import box_rectangles

FLOORS = 3
TOLERANCE = 1e-6  # a height that equals a threshold within this does not reach above it (m)


def storeys(height: float, storey_height: float) -> int:
    """Return into how many storeys a wall of `height` metres reaches (half-storey rule).

    >>> [storeys(h, 3.0) for h in (1.5, 1.6, 4.5, 4.6, 12.0)]
    [0, 1, 1, 2, 4]
    """
    count = max(int((height - 0.5 * storey_height) // storey_height), 0)
    while height > (count + 0.5) * storey_height + TOLERANCE:
        count += 1
    while count and height <= (count - 0.5) * storey_height + TOLERANCE:
        count -= 1
    return count


def mass_boxes(building: Building) -> tuple[Box, ...]:
    """Return the boxes that make the mass: general and garage boxes of known height."""
    return tuple(b for b in building.boxes if b.kind != "porch" and b.height is not None)


def floor_boxes(building: Building, floor: int) -> tuple[Box, ...]:
    """Return the boxes of a floor: those that reach above (floor + 0.5) · storey height."""
    threshold = (floor + 0.5) * building.storey_height + TOLERANCE
    return tuple(b for b in mass_boxes(building) if (b.height or 0.0) > threshold)


def floor_rectangles(building: Building, floor: int) -> Rectangles:
    """Return the plan rectangles (n, 4) of floor 0, 1 or 2, metres."""
    return box_rectangles(floor_boxes(building, floor))
