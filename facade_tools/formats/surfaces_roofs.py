"""Roof surfaces to bodies (what stands under one roof), and to style, pitch and direction."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Axis, Roof, RoofStyle
from ..geometry.arrays import Floats, Points2
from ..geometry.rectilinear import areas
from .surfaces import Surface

LEVEL = 7.0  # degrees: flatter is flat
STEEPEST = 80.0  # degrees: steeper is a wall
SHARE = 0.07  # of the sloped area: a direction with less is a detail
MANSARD_TURN = 18.0  # degrees between two slopes to one side
INSET = 1e-3  # metres: heights are read this far inside the outline
EDGE = 0.02  # metres: corners nearer than this are one
CODES: dict[str, RoofStyle] = {
    "1000": "flat",
    "2100": "shed",
    "3100": "gable",
    "3200": "hip",
    "3300": "hip",
    "3400": "mansard",
    "3500": "hip",
    "flat": "flat",
    "monopitch": "shed",
    "skillion": "shed",
    "gabled": "gable",
    "gable": "gable",
    "hipped": "hip",
    "hip": "hip",
    "half-hipped": "hip",
    "pyramidal": "hip",
    "mansard": "mansard",
    "gambrel": "mansard",
    "cone": "cone",
    "dome": "cone",
    "onion": "cone",
    "round": "gable",
    "saltbox": "gable",
}
QUARTERS = ("right", "back", "left", "front")


@dataclass(frozen=True)
class Plane:
    """A roof plane: its plan area, its slope (degrees), where it faces, z = a·x + b·y + c."""

    plan: BaseGeometry
    slope: float
    quarter: str
    coefficients: tuple[float, float, float]
    surface: Surface


def roof_plane(surface: Surface) -> Plane | None:
    """Return the plane of a roof surface; None where it is vertical or has no area."""
    normal = surface.normal
    up = abs(float(normal[2]))
    if up < math.cos(math.radians(STEEPEST)) or surface.plan.is_empty:
        return None
    if normal[2] < 0.0:
        normal = -normal
    middle = surface.rings[0].mean(axis=0)
    a, b = -float(normal[0]) / up, -float(normal[1]) / up
    c = float(middle[2]) - a * float(middle[0]) - b * float(middle[1])
    turn = math.degrees(math.atan2(float(normal[1]), float(normal[0])))
    slope = math.degrees(math.acos(min(up, 1.0)))
    return Plane(surface.plan, slope, QUARTERS[round(turn / 90.0) % 4], (a, b, c), surface)


def bodies(planes: Sequence[Plane]) -> list[list[Plane]]:
    """Return groups of planes that meet along an edge in space: each is one roof."""
    group = list(range(len(planes)))

    def find(k: int) -> int:
        while group[k] != k:
            k = group[k]
        return k

    where: dict[tuple[int, ...], list[int]] = {}
    for k, plane in enumerate(planes):
        for corner in {tuple(p) for ring in plane.surface.rings for p in _rounded(ring)}:
            where.setdefault(corner, []).append(k)
    pairs = Counter(
        (i, j) for at in where.values() for n, i in enumerate(at) for j in at[n + 1 :] if i != j
    )
    for (i, j), corners in pairs.items():
        if corners >= 2:
            group[find(j)] = find(i)
    roots = [find(k) for k in range(len(planes))]
    return [[planes[k] for k in range(len(planes)) if roots[k] == r] for r in sorted(set(roots))]


def _rounded(ring: Floats) -> list[tuple[int, ...]]:
    return [tuple(row) for row in np.round(ring / EDGE).astype(np.int64).tolist()]


def eaves_height(planes: Sequence[Plane], plan: BaseGeometry) -> float:
    """Return the height of the eaves: what a tenth of the roof along the walls stays below.

    The roof is measured above the outline of `plan`, so that an overhang does not lower it. A
    gable's ends rise above the eaves, its sides are at least a third of the outline.
    """
    points = _outline_points(plan)
    heights = heights_at(planes, points)
    if np.isnan(heights).all():
        return float(min(ring[:, 2].min() for p in planes for ring in p.surface.rings))
    return float(np.nanquantile(heights, 0.1))


def _outline_points(plan: BaseGeometry) -> Points2:
    inside = areas(plan.buffer(-INSET))
    border = (plan if inside.is_empty else inside).boundary
    count = max(12, min(200, int(border.length / 0.3)))
    places = (np.arange(count) + 0.5) / count
    points = shapely.line_interpolate_point(np.array(border), places, normalized=True)
    return shapely.get_coordinates(points)


def heights_at(planes: Sequence[Plane], points: Points2) -> Floats:
    """Return the height of the highest plane above or below plan points (n, 2); NaN outside all."""
    highest = np.full(len(points), -np.inf)
    x, y = points.T
    for plane in planes:
        a, b, c = plane.coefficients
        over = shapely.intersects_xy(plane.plan, x, y)
        highest = np.where(over, np.maximum(highest, a * x + b * y + c), highest)
    return np.where(np.isinf(highest), np.nan, highest)


def roof_of(planes: Sequence[Plane], area: BaseGeometry, code: str, notes: Counter[str]) -> Roof:
    """Return the roof above an area of the plan, told by the planes over it and the code.

    The code of the source decides the style where it names one; pitch and direction are always
    measured. Without a slope the roof is flat.
    """
    weights = [float(plane.plan.intersection(area).area) for plane in planes]
    total = sum(weights)
    sloped = [(p, w) for p, w in zip(planes, weights, strict=True) if p.slope > LEVEL]
    steep = sum(weight for _, weight in sloped)
    if total <= 0.0 or steep < 0.5 * total:
        return Roof("flat", 0.0, "x")
    by_quarter = {q: sum(w for p, w in sloped if p.quarter == q) for q in QUARTERS}
    faced = [quarter for quarter in QUARTERS if by_quarter[quarter] >= SHARE * steep]
    style = _style(sloped, faced, steep)
    named = CODES.get(code)
    if named and named != "flat" and _agrees(named, faced):
        style = named
    if style == "shed" and faced[0] in ("back", "right"):
        notes["shed falls to the back or right: written as falling to the front or left"] += 1
    return Roof(style, _pitch(sloped), _direction(style, by_quarter))


def _style(sloped: Sequence[tuple[Plane, float]], faced: list[str], steep: float) -> RoofStyle:
    if _broken(sloped, faced, steep):
        return "mansard"
    if len(faced) <= 1:
        return "shed"
    if len(faced) == 2:
        return "gable"
    return "hip"


def _agrees(named: RoofStyle, faced: list[str]) -> bool:
    """Tell whether the planes can be of the named style: a gable falls to two sides."""
    return {"shed": 1, "gable": 2}.get(named, len(faced)) == len(faced)


def _broken(sloped: Sequence[tuple[Plane, float]], faced: list[str], steep: float) -> bool:
    """Tell a mansard: on two sides a steep lower slope under a flatter one."""
    sides = 0
    for quarter in faced:
        slopes = [p.slope for p, w in sloped if p.quarter == quarter and w >= SHARE * steep / 2.0]
        sides += bool(slopes) and max(slopes) - min(slopes) > MANSARD_TURN and max(slopes) > 50.0
    return sides >= 2


def _pitch(sloped: Sequence[tuple[Plane, float]]) -> float:
    """Return the slope of the middle of the area, degrees."""
    rows = sorted((plane.slope, weight) for plane, weight in sloped)
    weights = np.cumsum([weight for _, weight in rows])
    return rows[int(np.searchsorted(weights, weights[-1] / 2.0))][0]


def _direction(style: RoofStyle, by_quarter: dict[str, float]) -> Axis:
    """Return the axis along which the ridge runs, or along which a shed falls."""
    sideways = by_quarter["left"] + by_quarter["right"]
    lengthways = by_quarter["front"] + by_quarter["back"]
    falls: Axis = "x" if sideways > lengthways else "y"
    if style == "shed":
        return falls
    return "y" if falls == "x" else "x"
