"""The conditions that a straight skeleton must meet before anyone sees it."""

from __future__ import annotations

import numpy as np

from facade_tools.compiled import compiled

from .arrays import Booleans, Floats, Integers, Points2
from .skeleton_shape import Contour, Skeleton

TOLERANCE = 1e-6  # metres, and share of the area


def fault(skeleton: Skeleton, contour: Contour) -> str:
    """Return what is wrong with a skeleton, "" when nothing is.

    Faces are simple and run counter-clockwise, and their edges cancel but for the polygon's own
    (they were assembled so); so their areas add up to the polygon's only if they tile it.
    """
    if skeleton.times.min(initial=0.0) < 0:
        return "a node below the eaves"
    if plane_error(skeleton, contour) > TOLERANCE:
        return "a node off the planes of its faces"
    edges, rings = skeleton.rings()
    ends = np.cumsum([len(ring) for ring in rings])
    flat = np.concatenate(rings)
    areas = _ring_areas(skeleton.points, flat, ends)
    faces, holes = np.split(areas, [len(skeleton.faces)])
    if abs(areas.sum() - contour.area) > TOLERANCE * contour.area:
        return "faces do not add up to the polygon"
    # A face is empty only where a faster edge in the same line takes its place at once.
    alike = bool(np.all(contour.speeds == contour.speeds[0]))
    if faces.min() < -TOLERANCE * contour.area or (alike and faces.min() <= 0):
        return "a face without area"
    if holes.max(initial=0.0) > TOLERANCE * contour.area:
        return "a face in two parts"
    if _crossing(skeleton.points, flat, ends, contour.speeds[edges] == 0):
        return "a face that crosses itself"
    return ""


def plane_error(skeleton: Skeleton, contour: Contour) -> float:
    """Return the largest difference (m) between a node's time and that of an edge it belongs to.

    For an edge of speed w: |distance to its line − w · time|.
    """
    _, normal, _ = contour.frames()
    edges, rings = skeleton.rings()
    edge = np.repeat(edges, [len(ring) for ring in rings])
    node = np.concatenate(rings)
    distance = np.sum(normal[edge] * (skeleton.points[node] - contour.points[edge]), axis=1)
    return float(np.abs(distance - contour.speeds[edge] * skeleton.times[node]).max(initial=0.0))


@compiled
def _ring_areas(points: Points2, flat: Integers, ends: Integers) -> Floats:
    areas = np.zeros(len(ends))
    start = 0
    for f in range(len(ends)):
        end = ends[f]
        x0, y0 = points[flat[start], 0], points[flat[start], 1]
        for k in range(start + 1, end - 1):
            ax, ay = points[flat[k], 0] - x0, points[flat[k], 1] - y0
            bx, by = points[flat[k + 1], 0] - x0, points[flat[k + 1], 1] - y0
            areas[f] += 0.5 * (ax * by - ay * bx)
        start = end
    return areas


@compiled
def _side(points: Points2, a: int, b: int, c: int) -> float:
    """Return twice the area of the triangle of three nodes; rounding counts as zero."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    turn = ux * vy - uy * vx
    reach = max(abs(ux), abs(uy)) * 1e-6 + max(abs(vx), abs(vy)) * 1e-6
    return 0.0 if abs(turn) <= reach else float(turn)


@compiled
def _crossing(points: Points2, flat: Integers, ends: Integers, upright: Booleans) -> bool:
    """Whether two edges of one ring cross properly."""
    start = 0
    for f in range(len(ends)):
        end = ends[f]
        for i in range(start, end if not upright[f] else start):
            a, b = flat[i], flat[i + 1 if i + 1 < end else start]
            for j in range(i + 2, end):
                c, d = flat[j], flat[j + 1 if j + 1 < end else start]
                if _side(points, a, b, c) * _side(points, a, b, d) < 0 and (
                    _side(points, c, d, a) * _side(points, c, d, b) < 0
                ):
                    return True
        start = end
    return False
