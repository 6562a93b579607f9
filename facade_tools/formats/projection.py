"""Longitude and latitude to metres around a point, and back: transverse Mercator on WGS84.

Krüger's series in the third flattening to fourth order (C. F. F. Karney, Transverse Mercator with
an accuracy of a few nanometers, 2011, eq. 7 to 11, 35, 36); the error is below a micrometre within
a thousand kilometres.
"""

from __future__ import annotations

import math

import numpy as np

from ..geometry.arrays import Floats, Points2

AXIS = 6378137.0  # WGS84, metres
FLATTENING = 1.0 / 298.257223563
N = FLATTENING / (2.0 - FLATTENING)
ECCENTRICITY = math.sqrt(FLATTENING * (2.0 - FLATTENING))
RECTIFYING = AXIS / (1.0 + N) * (1.0 + N**2 / 4.0 + N**4 / 64.0)
ALPHA = (
    N / 2.0 - 2.0 * N**2 / 3.0 + 5.0 * N**3 / 16.0 + 41.0 * N**4 / 180.0,
    13.0 * N**2 / 48.0 - 3.0 * N**3 / 5.0 + 557.0 * N**4 / 1440.0,
    61.0 * N**3 / 240.0 - 103.0 * N**4 / 140.0,
    49561.0 * N**4 / 161280.0,
)
BETA = (
    N / 2.0 - 2.0 * N**2 / 3.0 + 37.0 * N**3 / 96.0 - N**4 / 360.0,
    N**2 / 48.0 + N**3 / 15.0 - 437.0 * N**4 / 1440.0,
    17.0 * N**3 / 480.0 - 37.0 * N**4 / 840.0,
    4397.0 * N**4 / 161280.0,
)


def to_metres(degrees: Points2, origin: tuple[float, float]) -> Points2:
    """Return metres east and north of `origin` (longitude, latitude) of points in degrees."""
    longitude, latitude = np.radians(degrees).T
    turn = longitude - math.radians(origin[0])
    conformal = _conformal(np.tan(latitude))
    xi = np.arctan2(conformal, np.cos(turn))
    eta = np.arcsinh(np.sin(turn) / np.hypot(conformal, np.cos(turn)))
    z = xi + 1j * eta
    z = z + sum(a * np.sin(2.0 * (k + 1) * z) for k, a in enumerate(ALPHA))
    return RECTIFYING * np.column_stack([z.imag, z.real - _meridian(origin[1])])


def to_degrees(metres: Points2, origin: tuple[float, float]) -> Points2:
    """Return longitude and latitude of points in metres around `origin`."""
    east, north = metres.T / RECTIFYING
    z = (north + _meridian(origin[1])) + 1j * east
    z = z - sum(b * np.sin(2.0 * (k + 1) * z) for k, b in enumerate(BETA))
    conformal = np.sin(z.real) / np.hypot(np.sinh(z.imag), np.cos(z.real))
    turn = np.arctan2(np.sinh(z.imag), np.cos(z.real))
    latitude = np.arctan(_geographic(conformal))
    return np.column_stack([origin[0] + np.degrees(turn), np.degrees(latitude)])


def crs_name(origin: tuple[float, float]) -> str:
    """Return the PROJ string of the metres around `origin`."""
    longitude, latitude = origin
    return f"+proj=tmerc +lat_0={latitude:.7f} +lon_0={longitude:.7f} +k=1 +ellps=WGS84 +units=m"


def _meridian(latitude: float) -> float:
    """Return the rectifying latitude of a parallel, radians."""
    xi = math.atan(float(_conformal(np.array(math.tan(math.radians(latitude))))))
    return xi + sum(a * math.sin(2.0 * (k + 1) * xi) for k, a in enumerate(ALPHA))


def _conformal(tangent: Floats) -> Floats:
    """Return the tangent of the conformal latitude (Karney eq. 7, 8)."""
    root = np.hypot(1.0, tangent)
    sigma = np.sinh(ECCENTRICITY * np.arctanh(ECCENTRICITY * tangent / root))
    return np.asarray(tangent * np.hypot(1.0, sigma) - sigma * root)


def _geographic(conformal: Floats) -> Floats:
    """Return the tangent of the geographic latitude by Newton's method (Karney eq. 19 to 21)."""
    tangent = conformal / (1.0 - ECCENTRICITY**2)
    for _ in range(4):
        found = _conformal(tangent)
        slope = (1.0 + (1.0 - ECCENTRICITY**2) * tangent**2) / (
            (1.0 - ECCENTRICITY**2) * np.hypot(1.0, tangent)
        )
        tangent = tangent + (conformal - found) / np.hypot(1.0, found) * slope
    return tangent
