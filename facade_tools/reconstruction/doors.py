"""Doors of a parse: fragments are none, and those seen in part get the usual height."""

from __future__ import annotations

USUAL = (1.0, 2.1)  # m: width and height of a door
LEAST = (0.6, 1.0)  # m: narrower, or with a lower head, it is a fragment and no door
LOW = 1.6  # m: whose head is lower was seen in part


def door_head(width: float, head: float, storey: float) -> float | None:
    """Return how high the head of a door is above the ground (m), None where it is no door.

    width, head: as seen. storey: the room that there is.
    """
    if width < LEAST[0] or head < LEAST[1]:
        return None
    return head if head >= LOW else min(USUAL[1], 0.9 * storey)
