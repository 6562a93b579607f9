"""Names of coordinate reference systems, their units, and the way from them to local metres."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ..errors import InvalidInput
from ..geometry.arrays import Floats, Points2, Points3
from .crs_units import METRES, unit_of
from .projection import crs_name, to_metres

EPSG = re.compile(r"EPSG[:/]+(?:[0-9.]*[:/]+)?(\d{4,6})", re.I)
ETRS89_UTM = re.compile(r"ETRS89[_/ ]*UTM[_/ ]*(?:zone[_ ]*)?(\d{2})", re.I)
CRS84 = re.compile(r"CRS:?84|OGC:?CRS84", re.I)
FORMAL = re.compile(r"urn:|/def/crs/", re.I)  # names that stand for the axes in EPSG's own order
CELL = 0.25  # degrees: what lies in one cell shares a projection (scale error below 3e-6)


def named(text: str) -> str:
    """Return `EPSG:n` for the ways in which files name a reference system, else the text.

    >>> named("https://www.opengis.net/def/crs/EPSG/0/25832")
    'EPSG:25832'
    >>> named("urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH")
    'EPSG:25832'
    """
    if match := EPSG.search(text):
        return f"EPSG:{int(match[1])}"
    if match := ETRS89_UTM.search(text):
        return f"EPSG:258{int(match[1]):02d}"
    if CRS84.search(text):
        return "OGC:CRS84"
    return text[:200]


def _unit(name: str) -> str:
    if name == "OGC:CRS84":
        return "degree"
    match = EPSG.fullmatch(name)
    return unit_of(int(match[1])) if match else "metre"


@dataclass(frozen=True, slots=True)
class System:
    """What a source's coordinates are: their system's name, its unit, the order of its axes.

    degrees: longitude and latitude; None where the source names no system and its buildings tell.
    metres: in a unit of the axes. north_first: latitude before longitude.
    """

    name: str = ""
    degrees: bool | None = None
    metres: float = 1.0
    north_first: bool = False

    @classmethod
    def of(cls, text: str, formal_order: bool = False) -> System:
        """Return the system that a source names; with `formal_order` in EPSG's order of axes."""
        name = named(text)
        unit = _unit(name)
        if not name:
            return cls()
        north_first = formal_order and name != "OGC:CRS84" and bool(FORMAL.search(text))
        if unit == "degree":
            return cls(name, True, 1.0, north_first)
        if unit == "metre":
            return cls(name, False)
        return cls(f"{name} in metres", False, METRES[unit])

    def local(self, points: Points3, offset: Floats) -> tuple[Points3, Floats, str]:
        """Return points near zero in metres (n, 3), their origin (3,), and the system of both.

        points + offset are coordinates of the source; apart, so that huge ones lose no precision.
        Degrees are projected around the middle of a cell of 0.25°, so that neighbours share their
        system. Raises InvalidInput for degrees that cannot be.
        """
        if self.degrees or (self.degrees is None and _look_like_degrees(points, offset)):
            return self._projected(points + offset)
        metres = points * self.metres
        origin = np.round(metres[0]) if len(metres) else np.zeros(3)
        return metres - origin, origin + offset * self.metres, self.name

    def _projected(self, points: Points3) -> tuple[Points3, Floats, str]:
        plan = points[:, 1::-1] if self.north_first else points[:, :2]
        if np.abs(plan[:, 1]).max(initial=0.0) > 90.0:  # the other order is meant
            plan = plan[:, ::-1]
        if len(plan) and np.ptp(plan[:, 0]) > 180.0:  # across the 180th meridian
            plan = np.column_stack([plan[:, 0] % 360.0, plan[:, 1]])
        check_degrees(plan)
        cell = cell_of(plan)
        metres = np.column_stack([to_metres(plan, cell), points[:, 2]])
        origin = np.round(metres[0]) if len(metres) else np.zeros(3)
        return metres - origin, origin, crs_name(cell)


def check_degrees(plan: Points2) -> None:
    """Raise InvalidInput unless (n, 2) may be longitudes and latitudes."""
    largest = np.abs(plan).max(axis=0, initial=0.0)
    if not (largest[0] <= 360.0 and largest[1] <= 90.0):
        text = "coordinates are no degrees; of GeoJSON, --metres says that they are planar"
        raise InvalidInput(text)


def cell_of(plan: Points2) -> tuple[float, float]:
    """Return the middle (longitude, latitude) of the cell in which points in degrees lie.

    >>> cell_of(np.array([[11.43, 48.76]]))
    (11.5, 48.75)
    >>> cell_of(np.array([[-179.99, -16.5]])) == cell_of(np.array([[179.99, -16.5]]))
    True
    """
    if not len(plan):
        return 0.0, 0.0
    middle = (plan.min(axis=0) + plan.max(axis=0)) / 2.0
    longitude, latitude = (np.round(middle / CELL) * CELL).tolist()
    return (longitude + 180.0) % 360.0 - 180.0, latitude


def _look_like_degrees(points: Points3, offset: Floats) -> bool:
    """Tell a building in degrees in a file that names no system: taller than 1 m on no plan."""
    if not len(points):
        return False
    size, low = np.ptp(points, axis=0), np.abs(points + offset).max(axis=0)
    return bool(size[:2].max() < 0.05 and size[2] > 1.0 and low[0] <= 180.0 and low[1] <= 180.0)
