"""Small city models made for the tests: houses with known boxes, turned and moved."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Polygon = tuple[str, list[list[tuple[float, float, float]]]]


def gable_house(width: float, depth: float, eaves: float, pitch: float) -> list[Polygon]:
    """A box with its ridge along x, centred at the origin: ground, four walls, two planes."""
    w, d = width / 2, depth / 2
    top = eaves + d * math.tan(math.radians(pitch))
    a, b, c, e = (-w, -d), (w, -d), (w, d), (-w, d)
    at = lambda p, z: (*p, z)  # noqa: E731
    left, right = (-w, 0.0, top), (w, 0.0, top)
    return [
        ("GroundSurface", [[at(a, 0), at(e, 0), at(c, 0), at(b, 0)]]),
        ("WallSurface", [[at(a, 0), at(b, 0), at(b, eaves), at(a, eaves)]]),
        ("WallSurface", [[at(b, 0), at(c, 0), at(c, eaves), right, at(b, eaves)]]),
        ("WallSurface", [[at(c, 0), at(e, 0), at(e, eaves), at(c, eaves)]]),
        ("WallSurface", [[at(e, 0), at(a, 0), at(a, eaves), left, at(e, eaves)]]),
        ("RoofSurface", [[at(a, eaves), at(b, eaves), right, left]]),
        ("RoofSurface", [[at(c, eaves), at(e, eaves), left, right]]),
    ]


def flat_box(x0: float, y0: float, x1: float, y1: float, height: float) -> list[Polygon]:
    """A flat-roofed box."""
    a, b, c, e = (x0, y0), (x1, y0), (x1, y1), (x0, y1)
    ring = [a, b, c, e]
    walls: list[Polygon] = [
        ("WallSurface", [[(*p, 0.0), (*q, 0.0), (*q, height), (*p, height)]])
        for p, q in zip(ring, [*ring[1:], ring[0]], strict=True)
    ]
    ground: Polygon = ("GroundSurface", [[(*p, 0.0) for p in reversed(ring)]])
    roof: Polygon = ("RoofSurface", [[(*p, height) for p in ring]])
    return [ground, *walls, roof]


def front_window(u: float, v: float, width: float, height: float, depth: float) -> Polygon:
    """A window in the front wall of a house of this depth, from u, v."""
    y = -depth / 2
    corners = [(u, y, v), (u + width, y, v), (u + width, y, v + height), (u, y, v + height)]
    return "Window", [corners]


class City:
    """A CityJSON document that grows by houses."""

    def __init__(self, crs: str = "EPSG/0/25832") -> None:
        self.objects: dict[str, Any] = {}
        self.vertices: list[list[int]] = []
        self.crs = crs
        self.translate = [678000.0, 5403000.0, 400.0]

    def add(
        self,
        name: str,
        polygons: list[Polygon],
        turn: float = 0.0,
        shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
        lod: str = "2",
        **attributes: Any,
    ) -> City:
        """Add a building whose polygons are turned by degrees and moved by metres."""
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        boundaries, surfaces = [], []
        for kind, rings in polygons:
            surfaces.append({"type": kind})
            boundaries.append([self._ring(np.array(r) @ matrix.T + shift) for r in rings])
        geometry = {
            "type": "MultiSurface",
            "lod": lod,
            "boundaries": boundaries,
            "semantics": {"surfaces": surfaces, "values": list(range(len(surfaces)))},
        }
        self.objects[name] = {"type": "Building", "attributes": attributes, "geometry": [geometry]}
        return self

    def _ring(self, points: Any) -> list[int]:
        start = len(self.vertices)
        self.vertices += np.rint(points * 1000).astype(int).tolist()
        return list(range(start, start + len(points)))

    def document(self) -> dict[str, Any]:
        """Return the CityJSON document."""
        return {
            "type": "CityJSON",
            "version": "2.0",
            "transform": {"scale": [0.001] * 3, "translate": self.translate},
            "metadata": {"referenceSystem": f"https://www.opengis.net/def/crs/{self.crs}"},
            "CityObjects": self.objects,
            "vertices": self.vertices,
        }
