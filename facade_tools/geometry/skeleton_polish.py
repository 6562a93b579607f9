"""Nodes of a skeleton moved onto the planes of their faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .skeleton_shape import Contour, Skeleton

EXACT = 1e-9  # metres: a node nearer to its planes stays where it is
FARTHEST = 1e-4  # of the polygon's size: a node is never moved farther


def polished(skeleton: Skeleton, contour: Contour) -> Skeleton:
    """Return the skeleton with each inner node at the least-squares meeting of its planes.

    The plane of edge e is normal · x − speed · t = offset. Directions that the planes leave open
    (along a ridge between parallel edges) are not touched. The wavefront treats edges that are
    parallel within its tolerance as parallel; this takes the error out again.
    """
    _, normal, _ = contour.frames()
    edges, rings = skeleton.rings()
    edge = np.repeat(edges, [len(ring) for ring in rings])
    node = np.concatenate(rings)
    away = np.sum(normal[edge] * (skeleton.points[node] - contour.points[edge]), axis=1)
    error = contour.speeds[edge] * skeleton.times[node] - away
    off = np.zeros(len(skeleton.points), dtype=np.bool_)
    off[node[np.abs(error) > EXACT]] = True
    off[: len(contour.points)] = False
    if not off.any():
        return skeleton
    rows = np.column_stack([normal[edge], -contour.speeds[edge]])
    squares = np.zeros((len(off), 3, 3))
    np.add.at(squares, node, rows[:, :, None] * rows[:, None, :])
    sums = np.zeros((len(off), 3))
    np.add.at(sums, node, rows * error[:, None])
    inverse = np.linalg.pinv(squares[off], rcond=1e-8, hermitian=True)
    move = np.einsum("kij,kj->ki", inverse, sums[off])
    reach = FARTHEST * float(np.ptp(contour.points, axis=0).max())
    move[np.abs(move).max(axis=1) > reach] = 0.0
    points, times = skeleton.points.copy(), skeleton.times.copy()
    points[off] += move[:, :2]
    times[off] = np.maximum(times[off] + move[:, 2], 0.0)
    return replace(skeleton, points=points, times=times)
