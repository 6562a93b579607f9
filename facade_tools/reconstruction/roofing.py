"""Roof operators: the weighted straight skeleton of an outline as planar faces (KSTTP09 2.1)."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..artifacts.building import Axis
from ..geometry.arrays import Floats, Points2, Points3
from ..geometry.polygons import Rings
from ..geometry.roofs import Patch, truncated
from ..geometry.roofs_gables import gable_edges
from ..geometry.skeleton import Contour, Skeleton, SkeletonFailed, straight_skeleton

log = logging.getLogger("facade_tools.reconstruction")

STEEPEST = 0.9  # share of a roof's depth that a mansard's lower slope may take
PITCHES = {"gable": 40.0, "hip": 30.0}  # degrees
MANSARD = (75.0, 20.0)
LOFT = 2.4  # metres, height of a mansard's lower slope


@dataclass(frozen=True, slots=True)
class RoofPlan:
    """What a roof operator is asked for.

    pitch, rise: lower and upper (the same but for a mansard), degrees and metres, None where not
    said. weights: speed of the edges by the side that they look to; direction: of a ridge.
    """

    style: str
    pitch: tuple[float | None, float | None] = (None, None)
    rise: tuple[float | None, float | None] = (None, None)
    weights: Mapping[str, float] | None = None
    direction: Axis | None = None


@dataclass(frozen=True, slots=True)
class RoofFace:
    """A face: kind (lower, upper, gable), the side that it looks to, points (n, 3) local, holes.

    rings: counter-clockwise seen from outside.
    """

    kind: str
    side: str
    rings: tuple[Points3, ...]


@dataclass(frozen=True, slots=True)
class Roof:
    """Faces for the eye, and patches (z relative to the eaves) for the mass; its height (m)."""

    faces: tuple[RoofFace, ...]
    patches: tuple[Patch, ...]


@dataclass(frozen=True, slots=True)
class _Profile:
    """Height over the wavefront's time: slope `lower` until `bend`, then `upper`."""

    bend: float
    lower: float
    upper: float

    def height(self, times: Floats) -> Floats:
        low = np.minimum(times, self.bend) * self.lower
        return np.asarray(low + np.maximum(times - self.bend, 0.0) * self.upper)


def side_of(outward: Floats) -> str:
    """Return which way a vector (2,) of the plan looks: front is −y, right +x."""
    x, y = outward
    if abs(y) >= abs(x) - 1e-9:
        return "front" if y < 0 else "back"
    return "right" if x > 0 else "left"


def edge_sides(contour: Contour) -> list[str]:
    """Return for every edge the side that it looks to."""
    _, normal, _ = contour.frames()
    return [side_of(-n) for n in normal]


def roof_over(rings: Rings, plan: RoofPlan) -> Roof:
    """Return the roof over an outline; one whose skeleton fails is flat, with a warning.

    rings: outer ring counter-clockwise, holes clockwise (m).
    """
    if plan.style == "flat":
        return _flat(rings)
    try:
        contour, skeleton = _skeleton(rings, plan)
    except SkeletonFailed as problem:
        log.warning("flat roof instead of %s: %s", plan.style, problem)
        return _flat(rings)
    profile = _profile(plan, float(skeleton.times.max()))
    faces, patches = [], []
    for kind, edge, piece in _pieces(contour, skeleton, profile):
        plane = _plane(contour, edge, profile, kind)
        side = edge_sides(contour)[edge]
        raised = tuple(np.column_stack([r, r @ plane[:2] + plane[2]]) for r in piece)
        faces.append(RoofFace(kind, side, raised))
        patches.append(Patch(piece, (float(plane[0]), float(plane[1]), float(plane[2]))))
    faces += list(_gables(contour, skeleton, profile))
    return Roof(tuple(faces), tuple(patches))


def _flat(rings: Rings) -> Roof:
    raised = tuple(np.column_stack([ring, np.zeros(len(ring))]) for ring in rings)
    return Roof((RoofFace("upper", "top", raised),), (Patch(rings, (0.0, 0.0, 0.0)),))


def _skeleton(rings: Rings, plan: RoofPlan) -> tuple[Contour, Skeleton]:
    speeds = np.ones(sum(map(len, rings)))
    contour = Contour.of(rings)
    if plan.weights:
        sides = edge_sides(contour)
        speeds = np.array([max(plan.weights.get(side, 1.0), 0.0) for side in sides])
        if not speeds.any():
            raise SkeletonFailed("no edge of the roof may move")
    elif plan.style == "gable":
        low, high = rings[0].min(axis=0), rings[0].max(axis=0)
        longer: Axis = "x" if high[0] - low[0] >= high[1] - low[1] else "y"
        speeds[gable_edges(rings, plan.direction or longer)] = 0.0
    try:
        return Contour.of(rings, speeds), straight_skeleton(rings, speeds)
    except SkeletonFailed:
        if speeds.min() >= 1.0:
            raise
        log.info("no roof with these gables: hipped instead")
        return contour, straight_skeleton(rings)


def _profile(plan: RoofPlan, span: float) -> _Profile:
    """Return the heights over time of a roof whose skeleton ends at time `span`."""
    if plan.style != "mansard":
        pitch = plan.pitch[0] if plan.pitch[0] is not None else PITCHES[plan.style]
        slope = _slope(pitch) if plan.rise[0] is None else max(plan.rise[0], 0.0) / span
        return _Profile(np.inf, slope, slope)
    lower = MANSARD[0] if plan.pitch[0] is None else plan.pitch[0]
    upper = MANSARD[1] if plan.pitch[1] is None else plan.pitch[1]
    loft = LOFT if plan.rise[0] is None else max(plan.rise[0], 1e-3)
    bend = min(loft / max(_slope(lower), 1e-6), STEEPEST * span)
    top = _slope(upper) if plan.rise[1] is None else max(plan.rise[1], 0.0) / (span - bend)
    return _Profile(bend, loft / bend, top)


def _slope(pitch: float) -> float:
    return math.tan(math.radians(min(max(pitch, 0.0), 88.0)))


def _pieces(
    contour: Contour, skeleton: Skeleton, profile: _Profile
) -> Iterator[tuple[str, int, Rings]]:
    """Yield kind, edge and plan rings of the sloping faces."""
    edges = [k for k, face in enumerate(skeleton.faces) if contour.speeds[k] > 0 and len(face) > 2]
    if not np.isfinite(profile.bend):
        yield from (("lower", k, skeleton.polygon(k)) for k in edges)
        return
    parts = truncated(contour, skeleton, profile.bend)
    for k in edges:
        for kind, pieces in zip(("lower", "upper"), parts[k], strict=True):
            yield from ((kind, k, piece) for piece in pieces)


def _plane(contour: Contour, edge: int, profile: _Profile, kind: str) -> Floats:
    """Return (a, b, c) of the plane z = a·x + b·y + c above an edge's face."""
    _, normal, offset = contour.frames()
    time = np.array([*normal[edge], -offset[edge]]) / contour.speeds[edge]
    slope, base = profile.lower, 0.0
    if kind == "upper":
        slope, base = profile.upper, profile.bend * (profile.lower - profile.upper)
    return np.asarray(time * slope + np.array([0.0, 0.0, base]))


def _gables(contour: Contour, skeleton: Skeleton, profile: _Profile) -> Iterator[RoofFace]:
    """Yield the upright faces over the edges that stand still."""
    sides = edge_sides(contour)
    for k in np.flatnonzero(contour.speeds == 0.0).tolist():
        ring = skeleton.faces[k]
        if len(ring) < 3:
            continue
        points, times = skeleton.points[ring], skeleton.times[ring]
        raised = _bent(points, times, profile)
        if np.ptp(raised[:, 2]) > 1e-6:
            yield RoofFace("gable", sides[k], (raised,))


def _bent(points: Points2, times: Floats, profile: _Profile) -> Points3:
    """Return the ring in space, with a point wherever an edge crosses the bend."""
    rows = np.column_stack([points, times])
    closed = [*rows, rows[0]]
    out = []
    for a, b in pairwise(closed):
        out.append(a)
        if (a[2] - profile.bend) * (b[2] - profile.bend) < 0.0:
            out.append(a + (b - a) * (profile.bend - a[2]) / (b[2] - a[2]))
    ring = np.array(out)
    return np.column_stack([ring[:, :2], profile.height(ring[:, 2])])
