"""Weighted straight skeletons of polygons with holes, verified before they are returned."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from facade_tools.errors import FacadeError

from .arrays import Floats, Points2
from .polygons import Rings
from .skeleton_check import fault
from .skeleton_faces import faces_of
from .skeleton_polish import polished
from .skeleton_shape import Contour, Skeleton
from .wavefront import DONE, propagate
from .wavefront_front import Edges, Front, traced, wavefront

__all__ = ["Contour", "Skeleton", "SkeletonFailed", "skeleton_by", "straight_skeleton"]

LOG = logging.getLogger("facade_tools.geometry")
MOST_EDGES = 6000  # time and memory grow with their square: about 3 s and 400 MB


class SkeletonFailed(FacadeError):
    """No path gave a skeleton that passes verification."""


@dataclass(frozen=True, slots=True)
class _Path:
    """One way to compute.

    near: what counts as one place, relative to the polygon's size, and as parallel (sine).
    turn: of the polygon before (degrees). displacement: of its edges, relative to its size.
    """

    near: float
    turn: float = 0.0
    displacement: float = 0.0


_PATHS = (
    _Path(1e-9),
    _Path(5e-8),
    _Path(1e-8),
    _Path(2e-7),
    _Path(1e-11),
    _Path(5e-8, turn=17.3),
    _Path(1e-11, displacement=3e-9),
    _Path(1e-6, turn=51.7),
    _Path(1e-12, turn=33.1, displacement=3e-9),
    _Path(1e-11, turn=71.9, displacement=1e-8),
)


def straight_skeleton(rings: Rings, speeds: Sequence[float] | Floats | None = None) -> Skeleton:
    """Return the weighted straight skeleton of a simple polygon.

    rings: outer ring counter-clockwise, holes clockwise, none closed (m). speeds: (n,) ≥ 0, one
    an edge in the order of the concatenated rings: how fast its wavefront moves inwards; 1 by
    default; 0 leaves a gable. Of two parallel edges of unequal speed that come to touch, the
    faster one goes on in the place of both.

    Every result is verified (faces tile the polygon, one an edge, every node on the planes of
    its faces); one that fails is computed again with other tolerances, turned, and with its
    edges displaced by at most 1e-8 of its size; nodes are then put back on their planes. Raises
    SkeletonFailed when none passes, and for more than MOST_EDGES edges.
    """
    contour = Contour.of(rings, speeds)
    if len(contour.points) > MOST_EDGES:
        raise SkeletonFailed(f"{len(contour.points)} edges, at most {MOST_EDGES} are taken")
    for path in range(len(_PATHS)):
        skeleton, problem = skeleton_by(contour, path)
        if skeleton is not None and not problem:
            return skeleton
        LOG.debug("skeleton of %d edges failed on path %d: %s", len(contour.points), path, problem)
    raise SkeletonFailed(f"no skeleton of a polygon of {len(contour.points)} edges")


def skeleton_by(contour: Contour, number: int) -> tuple[Skeleton | None, str]:
    """Return the skeleton by one of the paths and what is wrong with it ("" for nothing)."""
    path = _PATHS[number]
    low, high = contour.points.min(axis=0), contour.points.max(axis=0)
    centre, size = (low + high) / 2, float(np.hypot(*(high - low))) / 2
    local = replace(contour, points=(contour.points - centre) @ _rotation(path.turn) / size)
    front, status = _propagated(local, path)
    if status != DONE:
        return None, f"wavefront ended with status {status}"
    nodes, arcs = traced(front)
    rings = faces_of(nodes, arcs, contour.following)
    if rings is None:
        return None, "a face that does not close"
    points = nodes[:, :2] @ _rotation(-path.turn) * size + centre
    points[: len(contour.points)] = contour.points
    times = nodes[:, 2] * size
    count = len(contour.points)
    faces = tuple(ring for _, ring in rings[:count])
    skeleton = Skeleton(points, times, faces, tuple(rings[count:]))
    skeleton = polished(skeleton, contour)
    return skeleton, fault(skeleton, contour)


def _propagated(local: Contour, path: _Path) -> tuple[Front, int]:
    along, normal, offset = local.frames()
    points = local.points
    if path.displacement:
        offset, points = _displaced(local, path.displacement)
    edges = Edges(along, normal, offset, local.speeds)
    front = wavefront(points, local.following)
    limit = 2.0 / float(local.speeds[local.speeds > 0].min())
    return front, propagate(edges, front, path.near, limit)


def _displaced(local: Contour, reach: float) -> tuple[Floats, Points2]:
    """Return offsets (n,) displaced by at most `reach`, each differently, and points that fit.

    Edges in one line move together, all others apart, so that no two events are simultaneous.
    """
    along, normal, offset = local.frames()
    golden = np.arange(1, len(offset) + 1) * 0.6180339887498949
    moves = reach * (2.0 * (golden % 1.0) - 1.0)
    points = np.empty_like(local.points)
    for e, f in enumerate(local.following):
        cross = along[e, 0] * along[f, 1] - along[e, 1] * along[f, 0]
        if abs(cross) <= 1e-6:
            moves[f] = moves[e]
    for e, f in enumerate(local.following):
        cross = along[e, 0] * along[f, 1] - along[e, 1] * along[f, 0]
        if abs(cross) <= 1e-6:
            step = moves[e] * normal[f]
        else:
            step = (along[f] * moves[e] - along[e] * moves[f]) / cross
        points[f] = local.points[f] + step
    return offset + moves, points


def _rotation(degrees: float) -> Floats:
    turn = np.radians(degrees)
    return np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
