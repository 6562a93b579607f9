"""A city model's footprints and roofs to boxes with roofs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..artifacts.building import Box, BoxKind, Chimney, Roof
from ..geometry.arrays import Floats
from ..geometry.rectilinear import areas, partition
from .surfaces import Model, bounds, told
from .surfaces_roofs import Plane, bodies, eaves_height, heights_at, roof_of, roof_plane

DETAIL_AREA = 6.0  # m²: a roof body smaller than this, above another one, is a dormer
DETAIL_SHARE = 0.12  # of the footprint: likewise
LEFT_OVER = 0.1  # m²: footprint without a roof above it (below a window in it) that counts
SAME_EAVES = 0.2  # metres: eaves nearer than this are level
LOWEST = 1.6  # metres: lower masses are terraces and ramps
CHIMNEY_SIDE = (0.2, 2.5)  # metres: least and largest width of a chimney
CHIMNEY_AREA = 1.6  # m²: a larger one is a dormer
CHIMNEY_RISE = 0.4  # metres above the highest roof around it
DORMER_SIDE = (0.7, 12.0)  # metres: least and largest width of a dormer
DORMER_RISE = 0.6  # metres above the roof at its lowest corner
MOST_FACES = 40  # of a chimney: a railing or a vent has more
MOST = 100  # chimneys, and dormers, of one building


@dataclass(frozen=True)
class Mass:
    """What stands under one roof: its plan, its eaves above the ground, its roof planes."""

    plan: BaseGeometry
    eaves: float
    planes: tuple[Plane, ...]
    code: str
    kind: BoxKind = "general"


@dataclass(frozen=True)
class Dormer:
    """What rises out of a roof on one side: plan centre, plan size and height of its top (m)."""

    x: float
    y: float
    width: float
    depth: float
    top: float


def footprint(model: Model) -> BaseGeometry:
    """Return the plan of a model: of its ground surfaces, else of its roofs, else of its walls."""
    surfaces = [surface for part in model.parts for surface in told(part)]
    for meanings in (("ground",), ("roof",), ("wall", "closure")):
        plans = [s.plan for s in surfaces if s.meaning in meanings and not s.plan.is_empty]
        union = areas(shapely.union_all(plans, grid_size=1e-4)) if plans else shapely.Polygon()
        if union.area > 1.0:
            return union
    return shapely.Polygon()


def masses(model: Model, ground: float, notes: Counter[str]) -> tuple[list[Mass], list[Mass]]:
    """Return what stands under each roof of a model, and the small roofs above others (dormers).

    ground: height of the ground in the model's frame, metres. Parts of the footprint without a
    roof go to the neighbour with which they share most of their outline.
    """
    found: list[Mass] = []
    for index, part in enumerate(model.parts):
        surfaces = told(part)
        code = model.roof_types[index] if index < len(model.roof_types) else ""
        plan = footprint(Model("", (part,), model.origin))
        planes = [p for s in surfaces if s.meaning == "roof" and (p := roof_plane(s)) is not None]
        for body in bodies(planes):
            over = areas(shapely.union_all([p.plan for p in body]).intersection(plan))
            if over.area > 0.05:
                height = eaves_height(body, over) - ground
                found.append(Mass(over, height, tuple(body), code))
    found.sort(key=lambda mass: (-mass.plan.area, mass.eaves))
    kept, details = _without_details(found)
    return _levelled(_without_gaps(kept, footprint(model)), notes), details


def _without_details(found: list[Mass]) -> tuple[list[Mass], list[Mass]]:
    """Separate the roofs that stand above larger ones from those that stand beside them."""
    kept: list[Mass] = []
    details: list[Mass] = []
    total = sum(mass.plan.area for mass in found)
    for mass in found:
        covered = shapely.union_all([other.plan for other in kept])
        free = areas(mass.plan.difference(covered))
        small = mass.plan.area < max(DETAIL_AREA, DETAIL_SHARE * total)
        if free.area < (0.6 if small else 0.25) * mass.plan.area:
            details.append(mass)
        elif free.area > 0.2:
            kept.append(Mass(free, mass.eaves, mass.planes, mass.code))
    return kept, details


def _without_gaps(found: list[Mass], whole: BaseGeometry) -> list[Mass]:
    gaps = areas(whole.difference(shapely.union_all([mass.plan for mass in found]).buffer(1e-3)))
    plans = [mass.plan for mass in found]
    for gap in shapely.get_parts(gaps):
        if gap.area > LEFT_OVER and plans:
            rim = gap.buffer(0.05)
            shared = [rim.intersection(mass.plan.boundary).length for mass in found]
            best = int(np.argmax(shared))
            plans[best] = areas(shapely.union_all([plans[best], gap.buffer(2e-3)]))
    return [
        Mass(plan, mass.eaves, mass.planes, mass.code, mass.kind)
        for plan, mass in zip(plans, found, strict=True)
    ]


def _levelled(found: list[Mass], notes: Counter[str]) -> list[Mass]:
    """Return masses whose nearly equal eaves are equal; too low ones are dropped."""
    level: list[Mass] = []
    for mass in found:
        if mass.eaves < LOWEST:
            notes["mass lower than 1.6 m: left out"] += 1
            continue
        same = [m.eaves for m in level if abs(m.eaves - mass.eaves) < SAME_EAVES]
        eaves = same[0] if same else round(mass.eaves, 3)
        level.append(Mass(mass.plan, eaves, mass.planes, mass.code, mass.kind))
    return level


def boxes_of(found: Sequence[Mass], notes: Counter[str]) -> tuple[tuple[Box, ...], float]:
    """Return the boxes of masses, largest first, and the residual of their plan."""
    parts = partition([mass.plan for mass in found])
    boxes: list[Box] = []
    counts: Counter[str] = Counter()
    for mass, rectangles in zip(found, parts.rectangles, strict=True):
        for x0, y0, x1, y1 in rectangles.tolist():
            area = shapely.box(x0, y0, x1, y1)
            counts[mass.kind] += 1
            boxes.append(
                Box(
                    f"{mass.kind}-{counts[mass.kind]}",
                    mass.kind,
                    round((x0 + x1) / 2.0, 6),
                    round((y0 + y1) / 2.0, 6),
                    round(x1 - x0, 6),
                    round(y1 - y0, 6),
                    mass.eaves,
                    _roof(mass, area, notes),
                )
            )
    return tuple(boxes), parts.residual


def _roof(mass: Mass, area: BaseGeometry, notes: Counter[str]) -> Roof:
    """Return the roof of a box: the body's style and pitch, the ridge as over this box."""
    whole = roof_of(mass.planes, mass.plan, mass.code, notes)
    here = roof_of(mass.planes, area, "", Counter())
    direction = here.direction if here.style == whole.style else whole.direction
    return Roof(whole.style, round(whole.pitch, 4), direction)


def on_the_roof(
    model: Model, planes: Sequence[Plane], details: Sequence[Mass], ground: float
) -> tuple[tuple[Chimney, ...], tuple[Dormer, ...]]:
    """Return what rises out of the roof: installations and small roofs above larger ones."""
    stacks: list[Chimney] = []
    dormers: list[Dormer] = []
    bodies = [(tuple(body), False) for body in model.outside]
    bodies += [(tuple(p.surface for p in mass.planes), True) for mass in details]
    for surfaces, is_roof in bodies:
        low, high = bounds(surfaces)
        chimney = None
        if len(surfaces) <= MOST_FACES:
            chimney = _chimney(low, high, planes, ground)
        if chimney is not None:
            stacks.append(chimney)
        elif _has_dormers_size(low, high) and (is_roof or _rises(low, high, planes)):
            dormers.append(Dormer(*_plan(low, high), round(float(high[2]) - ground, 3)))
    return tuple(stacks[:MOST]), tuple(dormers[:MOST])


def _plan(low: Floats, high: Floats) -> tuple[float, float, float, float]:
    """Return centre and size of a bounding box in plan, to the millimetre."""
    x, y = ((low + high)[:2] / 2.0).tolist()
    width, depth = (high - low)[:2].tolist()
    return round(x, 3), round(y, 3), round(width, 3), round(depth, 3)


def _around(low: Floats, high: Floats, planes: Sequence[Plane]) -> Floats:
    """Return the roof's height at the middle and the corners of a bounding box, NaN beside it."""
    middle = ((low + high)[:2] / 2.0).tolist()
    corners = [(a, b) for a in (low[0], high[0]) for b in (low[1], high[1])]
    return heights_at(planes, np.array([middle, *corners]))


def _has_dormers_size(low: Floats, high: Floats) -> bool:
    width, depth = (high - low)[:2].tolist()
    return bool(DORMER_SIDE[0] <= min(width, depth) <= max(width, depth) <= DORMER_SIDE[1])


def _rises(low: Floats, high: Floats, planes: Sequence[Plane]) -> bool:
    """Tell what stands above the roof on one side and goes through it on another."""
    around = _around(low, high, planes)
    if np.isnan(around[0]):
        return False
    lowest = float(np.nanmin(around))
    return bool(high[2] > lowest + DORMER_RISE and low[2] > lowest - 2.0 * DORMER_RISE)


def _chimney(low: Floats, high: Floats, planes: Sequence[Plane], ground: float) -> Chimney | None:
    """Return a thin upright body that rises out of the roof on all its sides.

    A dormer's top meets the roof on the uphill side, so it is none.
    """
    width, depth = (high - low)[:2].tolist()
    if not CHIMNEY_SIDE[0] <= min(width, depth) <= max(width, depth) <= CHIMNEY_SIDE[1]:
        return None
    if width * depth > CHIMNEY_AREA:
        return None
    around = _around(low, high, planes)
    if np.isnan(around[0]) or high[2] < np.nanmax(around) + CHIMNEY_RISE:
        return None
    return Chimney(*_plan(low, high), round(float(high[2]) - ground, 3))
