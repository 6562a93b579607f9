"""Names of coordinate reference systems, and which of them measure in degrees."""

from __future__ import annotations

import re

EPSG = re.compile(r"EPSG[:/]+(?:[0-9.]*[:/]+)?(\d{4,6})", re.I)
ETRS89_UTM = re.compile(r"ETRS89[_/ ]*UTM[_/ ]*(?:zone[_ ]*)?(\d{2})", re.I)
CRS84 = re.compile(r"CRS:?84|OGC:?CRS84", re.I)
DEGREES = frozenset({4326, 4979, 4258, 4937, 4269, 4617, 7843, 6318})


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


def in_degrees(name: str) -> bool:
    """Tell whether a reference system measures longitude and latitude in degrees."""
    if name == "OGC:CRS84":
        return True
    match = EPSG.fullmatch(name)
    return match is not None and int(match[1]) in DEGREES
