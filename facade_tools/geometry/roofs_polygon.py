"""Roofs over any polygon, laid on its straight skeleton (docs/roofs.md, section 3)."""

from __future__ import annotations

import logging

import numpy as np
import shapely

from facade_tools.artifacts.building import Roof
from facade_tools.artifacts.footprint import Footprint

from .polygons import Rings, rings_of, sound
from .rectilinear import valid_polygon
from .roofs_gables import gable_ends, turns
from .roofs_patch import FLAT, Patch, Plane, mansard_profile, slope_of
from .skeleton import Contour, Skeleton, SkeletonFailed, straight_skeleton

LOG = logging.getLogger("facade_tools.geometry")


def footprint_patches(footprint: Footprint) -> list[Patch]:
    """Return the patches of the roof of a footprint, repaired where its rings are not sound."""
    patches: list[Patch] = []
    for rings in sound(footprint.polygon):
        parts = sloped_patches(rings, footprint.height, footprint.roof or FLAT)
        patches += [Patch(part.rings, part.plane, "", len(patches)) for part in parts]
    return patches


def sloped_patches(rings: Rings, eaves: float, roof: Roof) -> list[Patch]:
    """Return the patches of a roof of any style over a polygon; they tile it.

    rings: outer ring counter-clockwise, holes clockwise (m). eaves: their height (m). A polygon
    whose skeleton cannot be found gets a flat roof, with a warning in the log.
    """
    if roof.style == "flat" or slope_of(roof) <= 0:
        return [Patch(rings, (0.0, 0.0, eaves))]
    if roof.style == "shed":
        return [_shed(rings, eaves, roof)]
    try:
        return _skeletal(rings, eaves, roof)
    except SkeletonFailed as problem:
        LOG.warning("flat roof instead of %s: %s", roof.style, problem)
        return [Patch(rings, (0.0, 0.0, eaves))]


def _skeletal(rings: Rings, eaves: float, roof: Roof) -> list[Patch]:
    contour = Contour.of(rings)
    skeleton = straight_skeleton(rings)
    if roof.style == "cone" and _is_convex(contour):
        return _pyramid(contour, eaves, float(skeleton.times.max()) * slope_of(roof))
    if roof.style == "gable":
        contour, skeleton = _gabled(rings, contour, skeleton, roof)
    if roof.style == "mansard":
        return _mansard(contour, skeleton, eaves, roof)
    distances = _distances(contour)
    return [
        Patch(skeleton.polygon(k), _raised(distances[k], slope_of(roof), eaves))
        for k, face in enumerate(skeleton.faces)
        if contour.speeds[k] > 0 and len(face) > 2
    ]


def _shed(rings: Rings, eaves: float, roof: Roof) -> Patch:
    """Return one plane that rises along the walls nearest to the roof's axis."""
    edges = np.roll(rings[0], -1, axis=0) - rings[0]
    longest = edges[int(np.argmax(np.round(np.hypot(*edges.T), 3)))]
    u, v = longest / np.hypot(*longest)
    axis = 0 if roof.direction == "x" else 1
    a, b = max([(u, v), (-v, u), (-u, -v), (v, -u)], key=lambda way: float(way[axis]))
    plane = slope_of(roof) * np.array([a, b])
    low = float((rings[0] @ plane).min())
    return Patch(rings, (float(plane[0]), float(plane[1]), eaves - low))


def _distances(contour: Contour) -> list[Plane]:
    """Return per edge (a, b, c): the distance of (x, y) from its line is a·x + b·y + c."""
    _, normal, offset = contour.frames()
    return [(float(a), float(b), -float(c)) for (a, b), c in zip(normal, offset, strict=True)]


def _raised(distance: Plane, slope: float, base: float) -> Plane:
    a, b, c = distance
    return a * slope, b * slope, c * slope + base


def _is_convex(contour: Contour) -> bool:
    return bool(np.all(turns(contour) > -1e-9))


def _pyramid(contour: Contour, eaves: float, rise: float) -> list[Patch]:
    """Return triangles from every edge to an apex above the centroid."""
    apex = shapely.get_coordinates(shapely.centroid(shapely.Polygon(contour.points)))[0]
    patches = []
    for a, b, c in _distances(contour):
        slope = rise / (a * apex[0] + b * apex[1] + c)
        patches.append(_raised((a, b, c), float(slope), eaves))
    ends = contour.points[contour.following]
    return [
        Patch([np.array([start, end, apex])], plane)
        for start, end, plane in zip(contour.points, ends, patches, strict=True)
    ]


def _gabled(
    rings: Rings, contour: Contour, skeleton: Skeleton, roof: Roof
) -> tuple[Contour, Skeleton]:
    """Return contour and skeleton with gables at as many ends as have a roof together."""
    ends = gable_ends(rings, roof.direction)
    chosen = [edge for end in ends.sure for edge in end]
    gabled = _with_gables(rings, chosen) if chosen else None
    tried = ends.possible
    if gabled is None:
        chosen, tried = [], [*ends.sure, *ends.possible]
    for end in tried:
        found = _with_gables(rings, [*chosen, *end])
        if found is not None:
            gabled, chosen = found, [*chosen, *end]
    return gabled or (contour, skeleton)


def _with_gables(rings: Rings, edges: list[int]) -> tuple[Contour, Skeleton] | None:
    """Return contour and skeleton with upright faces over edges; None where they have no roof."""
    speeds = np.ones(sum(map(len, rings)))
    speeds[edges] = 0.0
    try:
        return Contour.of(rings, speeds), straight_skeleton(rings, speeds)
    except SkeletonFailed:
        LOG.debug("no roof with gables at edges %s", edges)
        return None


# --- mansards -------------------------------------------------------------------------------------
def _mansard(contour: Contour, skeleton: Skeleton, eaves: float, roof: Roof) -> list[Patch]:
    """Return the faces cut at the height where the slope changes."""
    inset, lower, upper = mansard_profile(roof, float(skeleton.times.max()))
    patches = []
    for distance, (low, high) in zip(
        _distances(contour), truncated(contour, skeleton, inset), strict=True
    ):
        base = eaves + inset * (lower - upper)
        patches += [Patch(rings, _raised(distance, lower, eaves)) for rings in low]
        patches += [Patch(rings, _raised(distance, upper, base)) for rings in high]
    return patches


def truncated(
    contour: Contour, skeleton: Skeleton, time: float
) -> list[tuple[list[Rings], list[Rings]]]:
    """Return per face its polygons below and above the wavefront's place at `time`."""
    along, normal, _ = contour.frames()
    reach = 2.0 * float(np.ptp(skeleton.points, axis=0).sum())
    found = []
    for k in range(len(skeleton.faces)):
        shape = valid_polygon(skeleton.polygon(k))  # nodes a micrometre apart may cross
        far, side = reach * normal[k], reach * along[k]
        level = contour.points[k] + time * contour.speeds[k] * normal[k]
        above = shapely.Polygon(
            [level - side, level + side, level + side + far, level - side + far]
        )
        parts = shapely.difference(shape, above), shapely.intersection(shape, above)
        found.append((_polygons(parts[0]), _polygons(parts[1])))
    return found


def _polygons(shape: shapely.Geometry) -> list[Rings]:
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon)]
    return [rings_of(part) for part in parts if part.area > 1e-9]
