"""Roofs over one rectangle: the lower envelope of a few planes, or a cone."""

from __future__ import annotations

import math

import numpy as np

from facade_tools.artifacts.building import Box, Roof

from .arrays import Points2
from .polygons import signed_area
from .roofs_patch import Patch, Plane, Rectangle, mansard_profile, slope_of

CONE_SIDES = 16
Sides = tuple[bool, bool, bool, bool]  # left (x0), right (x1), front (y0), back (y1)


def rectangle_of(box: Box) -> Rectangle:
    """Return the plan rectangle of a box and its eaves, snapped to 1e-6 m."""
    half_w, half_d = box.width / 2, box.depth / 2
    corners = (box.x - half_w, box.y - half_d, box.x + half_w, box.y + half_d)
    x0, y0, x1, y1 = (round(value, 6) for value in corners)
    return Rectangle(x0, y0, x1, y1, round(box.height or 0.0, 6))


def sloping_sides(roof: Roof) -> Sides:
    """Return at which sides of its rectangle a roof comes down to the eaves."""
    along_x = roof.direction == "x"
    return {
        "flat": (False, False, False, False),
        "gable": (not along_x, not along_x, along_x, along_x),
        "shed": (along_x, False, not along_x, False),
    }.get(roof.style, (True, True, True, True))


def box_roof(
    rectangle: Rectangle, roof: Roof, owner: str, group: int, sides: Sides | None = None
) -> list[Patch]:
    """Return the patches of a roof over a rectangle.

    sides: where it slopes, by default as its style says.
    """
    if roof.style == "cone":
        return _cone(rectangle, roof, owner, group)
    planes = _planes(rectangle, roof, sides or sloping_sides(roof))
    ring = rectangle_ring(rectangle)
    found = [(_lowest(ring, plane, planes), plane) for plane in planes]
    return [Patch([part], plane, owner, group) for part, plane in found if len(part)]


def rectangle_ring(rectangle: Rectangle) -> Points2:
    """Return the corners (4, 2), counter-clockwise."""
    r = rectangle
    return np.array([[r.x0, r.y0], [r.x1, r.y0], [r.x1, r.y1], [r.x0, r.y1]])


def _planes(rectangle: Rectangle, roof: Roof, sides: Sides) -> list[Plane]:
    """Return the planes (a, b, c) whose lower envelope is the roof."""
    r = rectangle
    inward = [(1.0, 0.0, -r.x0), (-1.0, 0.0, r.x1), (0.0, 1.0, -r.y0), (0.0, -1.0, r.y1)]
    distances = [plane for plane, slopes in zip(inward, sides, strict=True) if slopes]
    if not distances:
        return [(0.0, 0.0, r.eaves)]
    if roof.style != "mansard":
        return [_raised(distance, slope_of(roof), r.eaves) for distance in distances]
    inset, lower, upper = mansard_profile(roof, min(r.x1 - r.x0, r.y1 - r.y0) / 2)
    steep = [_raised(distance, lower, r.eaves) for distance in distances]
    base = r.eaves + inset * (lower - upper)
    return steep + [_raised(distance, upper, base) for distance in distances]


def _raised(distance: Plane, slope: float, base: float) -> Plane:
    a, b, c = distance
    return a * slope, b * slope, c * slope + base


def _lowest(ring: Points2, plane: Plane, planes: list[Plane]) -> Points2:
    """Return the part of a convex ring where `plane` is the lowest, (0, 2) if there is none."""
    for other in planes:
        if other is not plane:
            a, b, c = np.subtract(other, plane)
            ring = _clipped(ring, a * ring[:, 0] + b * ring[:, 1] + c)
            if len(ring) < 3:
                return np.zeros((0, 2))
    return ring if signed_area(ring) > 1e-9 else np.zeros((0, 2))


def _clipped(ring: Points2, height: np.ndarray) -> Points2:
    """Return the part of a convex ring (n, 2) where the values (n,) at its points are ≥ 0."""
    height = np.where(np.abs(height) < 1e-9, 0.0, height)
    kept = []
    for k, point in enumerate(ring):
        before = height[k - 1]
        if before * height[k] < 0:
            share = before / (before - height[k])
            kept.append(ring[k - 1] + share * (point - ring[k - 1]))
        if height[k] >= 0:
            kept.append(point)
    return np.array(kept).reshape(-1, 2)


def _cone(rectangle: Rectangle, roof: Roof, owner: str, group: int) -> list[Patch]:
    """Return a many-sided cone on the ellipse inside the rectangle, and its flat corners."""
    r = rectangle
    centre = np.array([r.x0 + r.x1, r.y0 + r.y1]) / 2
    radii = np.array([r.x1 - r.x0, r.y1 - r.y0]) / 2
    turn = np.arange(CONE_SIDES) * (2 * math.pi / CONE_SIDES)
    rim = np.round(centre + radii * np.column_stack([np.cos(turn), np.sin(turn)]), 6)
    rise = float(radii.min()) * slope_of(roof)
    patches = []
    for k in range(CONE_SIDES):
        ring = np.array([rim[k], rim[(k + 1) % CONE_SIDES], centre])
        a, b = np.linalg.solve(ring[:2] - centre, [-rise, -rise])
        c = r.eaves + rise - a * centre[0] - b * centre[1]
        patches.append(Patch([ring], (float(a), float(b), float(c)), owner, group))
    quarter = CONE_SIDES // 4
    corners = rectangle_ring(rectangle)[[2, 3, 0, 1]]
    for k, corner in enumerate(corners):
        arc = np.take(rim, range(k * quarter, (k + 1) * quarter + 1), axis=0, mode="wrap")
        ring = np.vstack([[corner], arc[::-1]])
        patches.append(Patch([ring], (0.0, 0.0, r.eaves), owner, group))
    return patches
