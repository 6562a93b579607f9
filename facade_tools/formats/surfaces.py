"""A building as a city model gives it: polygons in space with a meaning each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from shapely.geometry.base import BaseGeometry

from ..geometry.arrays import Floats, Points3
from ..geometry.rectilinear import valid_polygon
from .crs import System

Meaning = Literal["wall", "roof", "ground", "window", "door", "closure", "other"]

FLAT_NORMAL = 0.17  # |z| of a unit normal below which a surface is a wall (10°)
LEAST_AREA = 1e-4  # m²: smaller polygons carry no direction


@dataclass(frozen=True)
class Surface:
    """A planar polygon: outer ring counter-clockwise from outside, then holes; (n, 3) metres.

    group: polygons of the same number, not 0, are one window or door.
    """

    meaning: Meaning
    rings: tuple[Points3, ...]
    group: int = 0

    @cached_property
    def vector_area(self) -> Floats:
        """Normal times area (m²), of the outer ring (Newell)."""
        fan = (self.rings[0][1:] - self.rings[0][0]).T
        (a, b, c), (d, e, f) = fan[:, :-1], fan[:, 1:]
        return 0.5 * np.array([b @ f - c @ e, c @ d - a @ f, a @ e - b @ d])

    @property
    def area(self) -> float:
        """Area of the outer ring, m²."""
        return float(np.linalg.norm(self.vector_area))

    @property
    def normal(self) -> Floats:
        """Unit normal; upward where the polygon is too small to have one."""
        if self.area < LEAST_AREA:
            return np.array([0.0, 0.0, 1.0])
        unit: Floats = self.vector_area / self.area
        return unit

    @cached_property
    def plan(self) -> BaseGeometry:
        """The polygon seen from above, repaired."""
        return valid_polygon([ring[:, :2] for ring in self.rings])

    def moved(self, turn: Floats, shift: Floats) -> Surface:
        """Return the surface at points @ turn.T + shift."""
        return replace(self, rings=tuple(ring @ turn.T + shift for ring in self.rings))


@dataclass(frozen=True)
class Model:
    """One building of a source: its surfaces around `origin`, and what the source says of it.

    origin: metres, added to the surfaces' coordinates it gives those of the source; kept apart
    so that huge map coordinates lose no precision. function: the source's code. parts: surfaces
    of each building part; a building without parts has one. roof_types: the source's code of each
    part's roof. outside: surfaces of installations (chimneys, dormers, balconies), a list each.
    artifact: the document of the artifact that our own export left in the file.
    """

    id: str
    parts: tuple[tuple[Surface, ...], ...]
    origin: tuple[float, ...]
    crs: str = ""
    function: str = ""
    roof_types: tuple[str, ...] = ()
    storeys: int | None = None
    outside: tuple[tuple[Surface, ...], ...] = ()
    artifact: Mapping[str, Any] | None = None

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """All surfaces of all parts."""
        return tuple(surface for part in self.parts for surface in part)


def told(surfaces: Sequence[Surface]) -> tuple[Surface, ...]:
    """Return surfaces all of which mean something: what says nothing is told by its normal.

    Below the middle of its heights a level surface is ground, above it roof.
    """
    if all(surface.meaning != "other" for surface in surfaces):
        return tuple(surfaces)
    heights = [ring[:, 2] for surface in surfaces for ring in surface.rings]
    middle = (min(h.min() for h in heights) + max(h.max() for h in heights)) / 2.0
    return tuple(
        replace(surface, meaning=_meaning(surface, middle))
        if surface.meaning == "other"
        else surface
        for surface in surfaces
    )


def _meaning(surface: Surface, middle: float) -> Meaning:
    up = float(surface.normal[2])
    if abs(up) < FLAT_NORMAL:
        return "wall"
    low = float(surface.rings[0][:, 2].mean()) < middle
    return "ground" if low and abs(up) > 0.9 else "roof"


def bounds(surfaces: Iterable[Surface]) -> tuple[Floats, Floats]:
    """Return the lowest and the highest corner (3,) of surfaces."""
    points = np.concatenate([ring for surface in surfaces for ring in surface.rings])
    return points.min(axis=0), points.max(axis=0)


Lists = Sequence[Sequence[Surface]]


def localised(
    lists: Sequence[Lists], system: System, base: Floats
) -> tuple[list[tuple[tuple[Surface, ...], ...]], Floats, str]:
    """Return surfaces in metres near zero, their origin (3,), and the name of their system.

    The points of `lists` + base are coordinates of the source.
    """
    every = [surface for rows in lists for row in rows for surface in row]
    rings = [ring for surface in every for ring in surface.rings]
    points, origin, crs = system.local(np.concatenate([np.empty((0, 3)), *rings]), base)
    ends = np.cumsum([len(ring) for ring in rings], dtype=np.int64)
    placed = iter(np.split(points, ends[:-1]))
    moved = iter([replace(s, rings=tuple(next(placed) for _ in s.rings)) for s in every])
    found = [tuple(tuple(next(moved) for _ in row) for row in rows) for rows in lists]
    return found, origin, crs


def ring(points: Any) -> Points3 | None:
    """Return an open ring (n, 3) without repeated points; None where fewer than three are left."""
    array = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    if len(array) and np.array_equal(array[0], array[-1]):
        array = array[:-1]
    apart = np.ones(len(array), dtype=bool)
    apart[1:] = (array[1:] != array[:-1]).any(axis=1)
    kept = array[apart]
    return kept if len(kept) >= 3 else None
