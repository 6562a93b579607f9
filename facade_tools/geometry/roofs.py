"""Roofs as patches: pieces of planes over polygons of the plan (docs/roofs.md)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from facade_tools.artifacts.building import Box, Roof

from .arrays import Floats, Points2
from .polygons import Rings

FLAT = Roof("flat")
STEEP = 70.0  # lower slope of a mansard, degrees
STEEP_RISE = 2.2  # height of a mansard's lower slope, metres
CONE_SIDES = 16


@dataclass(frozen=True, slots=True)
class Patch:
    """One plane of a roof: z = a·x + b·y + c over a polygon of the plan.

    rings: outer ring counter-clockwise, holes clockwise (m). owner: id of the box.
    """

    rings: Rings
    plane: tuple[float, float, float]
    owner: str = ""


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Plan rectangle (m) with the height of its eaves."""

    x0: float
    y0: float
    x1: float
    y1: float
    eaves: float


def rectangle_of(box: Box) -> Rectangle:
    """Return the plan rectangle of a box, snapped to 1e-6 m."""
    half_w, half_d = box.width / 2, box.depth / 2
    corners = (box.x - half_w, box.y - half_d, box.x + half_w, box.y + half_d)
    x0, y0, x1, y1 = (round(value, 6) for value in corners)
    return Rectangle(x0, y0, x1, y1, round(box.height or 0.0, 6))


def box_roof(box: Box) -> list[Patch]:
    """Return the patches of the roof of one box, as if it stood alone."""
    roof = box.roof or FLAT
    rectangle = rectangle_of(box)
    along_x = roof.direction == "x"
    faces = _LOCAL[roof.style](_Frame(rectangle, along_x), roof)
    return [Patch([_ring(points)], _plane_through(points), box.id) for points in faces]


@dataclass(frozen=True, slots=True)
class _Frame:
    """Local frame of a rectangle: u along the ridge, v across, z from the ground."""

    rectangle: Rectangle
    along_x: bool

    @property
    def size(self) -> tuple[float, float]:
        r = self.rectangle
        width, depth = r.x1 - r.x0, r.y1 - r.y0
        return (width, depth) if self.along_x else (depth, width)

    def face(self, points: list[tuple[float, float, float]]) -> Floats:
        """Return (n, 3) points in plan; z of the input counts from the eaves."""
        r = self.rectangle
        u, v, z = np.array(points, dtype=np.float64).T
        x, y = (u, v) if self.along_x else (v, u)
        return np.column_stack([x + r.x0, y + r.y0, z + r.eaves])


def _slope(roof: Roof) -> float:
    return math.tan(math.radians(min(max(roof.pitch, 0.0), 85.0)))


def _flat(frame: _Frame, roof: Roof) -> list[Floats]:
    length, span = frame.size
    return [frame.face([(0, 0, 0), (length, 0, 0), (length, span, 0), (0, span, 0)])]


def _shed(frame: _Frame, roof: Roof) -> list[Floats]:
    length, span = frame.size
    top = length * _slope(roof)
    return [frame.face([(0, 0, 0), (length, 0, top), (length, span, top), (0, span, 0)])]


def _gable(frame: _Frame, roof: Roof) -> list[Floats]:
    length, span = frame.size
    middle, top = span / 2, span / 2 * _slope(roof)
    low = [(0, 0, 0), (length, 0, 0), (length, middle, top), (0, middle, top)]
    high = [(0, middle, top), (length, middle, top), (length, span, 0), (0, span, 0)]
    return [frame.face(low), frame.face(high)]


def _hip(frame: _Frame, roof: Roof) -> list[Floats]:
    return _hipped(frame, 0.0, 0.0, _slope(roof))


def _hipped(frame: _Frame, inset: float, base: float, slope: float) -> list[Floats]:
    """Return the faces of a hip over the rectangle shrunk by `inset`, from height `base`."""
    length, span = frame.size
    half = min(length, span) / 2 - inset
    top = base + half * slope
    low, far, wide = inset, length - inset, span - inset
    a, b, c, d = (low, low, base), (far, low, base), (far, wide, base), (low, wide, base)
    if length >= span:
        p, q = (low + half, span / 2, top), (far - half, span / 2, top)
        rings = [[a, b, q, p], [b, c, q], [c, d, p, q], [d, a, p]]
    else:
        p, q = (length / 2, low + half, top), (length / 2, wide - half, top)
        rings = [[a, b, p], [b, c, q, p], [c, d, q], [d, a, p, q]]
    return [frame.face(_distinct(ring)) for ring in rings]


def _mansard(frame: _Frame, roof: Roof) -> list[Floats]:
    length, span = frame.size
    lower = math.tan(math.radians(max(STEEP, min(roof.pitch, 85.0))))
    upper = _slope(roof) if roof.pitch <= 45.0 else math.tan(math.radians(25.0))
    inset = min(STEEP_RISE / lower, 0.2 * min(length, span))
    rise = inset * lower
    outer = [(0.0, 0.0), (length, 0.0), (length, span), (0.0, span)]
    inner = [
        (inset, inset),
        (length - inset, inset),
        (length - inset, span - inset),
        (inset, span - inset),
    ]
    steep = []
    for k in range(4):
        n = (k + 1) % 4
        ring = [(*outer[k], 0.0), (*outer[n], 0.0), (*inner[n], rise), (*inner[k], rise)]
        steep.append(frame.face(ring))
    return steep + _hipped(frame, inset, rise, upper)


def _cone(frame: _Frame, roof: Roof) -> list[Floats]:
    """Return a many-sided cone on the ellipse inside the rectangle, and its flat corners."""
    length, span = frame.size
    top = min(length, span) / 2 * _slope(roof)
    turn = np.arange(CONE_SIDES + 1) * (2 * np.pi / CONE_SIDES)
    u = np.round(length / 2 * (1 + np.cos(turn)), 6)
    v = np.round(span / 2 * (1 + np.sin(turn)), 6)
    rim = [(float(u[k]), float(v[k]), 0.0) for k in range(CONE_SIDES + 1)]
    apex = (length / 2, span / 2, top)
    sides = [frame.face([rim[k], rim[k + 1], apex]) for k in range(CONE_SIDES)]
    quarter = CONE_SIDES // 4
    corners = [(length, span), (0.0, span), (0.0, 0.0), (length, 0.0)]
    flats = [
        frame.face([(*corner, 0.0), *rim[k * quarter : (k + 1) * quarter + 1][::-1]])
        for k, corner in enumerate(corners)
    ]
    return sides + flats


_LOCAL = {
    "flat": _flat,
    "gable": _gable,
    "hip": _hip,
    "shed": _shed,
    "cone": _cone,
    "mansard": _mansard,
}


def _distinct(ring: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    return [p for k, p in enumerate(ring) if p != ring[k - 1]]


def _ring(points: Floats) -> Points2:
    ring = points[:, :2]
    x, y = ring.T
    area = np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))
    return ring if area > 0 else ring[::-1]


def _plane_through(points: Floats) -> tuple[float, float, float]:
    """Return (a, b, c) of z = a·x + b·y + c through a planar ring (n, 3)."""
    origin = points[0]
    solved = np.linalg.lstsq(points[1:, :2] - origin[:2], points[1:, 2] - origin[2], rcond=None)
    a, b = (float(value) for value in solved[0])
    return a, b, float(origin[2] - a * origin[0] - b * origin[1])
