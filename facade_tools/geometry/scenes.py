"""Scenes as wholes: bounds, moves, and several side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .arrays import Floats
from .mesh import Scene

GAP = 4.0  # metres between scenes that are put side by side


def bounds(scene: Scene) -> Floats:
    """Return lowest and highest corner (2, 3), metres; an empty scene is the origin."""
    points = [mesh.vertices for mesh in scene.meshes if len(mesh.vertices)]
    if not points:
        return np.zeros((2, 3))
    low = np.min([p.min(axis=0) for p in points], axis=0)
    return np.array([low, np.max([p.max(axis=0) for p in points], axis=0)])


def moved(scene: Scene, turn: Floats, step: Floats) -> Scene:
    """Return the scene turned by a rotation matrix (3, 3), then shifted by (x, y, z) metres."""
    meshes = tuple(replace(mesh, vertices=mesh.vertices @ turn.T + step) for mesh in scene.meshes)
    return replace(scene, meshes=meshes)


def shifts(boxes: Sequence[Floats], always: bool = False) -> Floats:
    """Return plan shifts (n, 3) that keep models of the given bounds (2, 3) out of one another.

    Models whose plans are apart stay where they are (a map) unless `always`; otherwise all are
    put on a grid in reading order, rows away from the viewer, each cell as large as the largest
    plan.
    """
    out = np.zeros((len(boxes), 3))
    if len(boxes) < 2 or not (always or _any_overlap(boxes)):
        return out
    columns = int(np.ceil(np.sqrt(len(boxes))))
    cell = np.max([box[1, :2] - box[0, :2] for box in boxes], axis=0) + GAP
    for index, box in enumerate(boxes):
        row, column = divmod(index, columns)
        out[index, :2] = np.array([column, row]) * cell - box[:, :2].mean(axis=0)
    return out


def _any_overlap(boxes: Sequence[Floats]) -> bool:
    order = sorted(boxes, key=lambda box: float(box[0, 0]))
    active: list[Floats] = []
    for box in order:
        active = [other for other in active if other[1, 0] > box[0, 0]]
        if any(_overlap(box, other) for other in active):
            return True
        active.append(box)
    return False


def _overlap(a: Floats, b: Floats) -> bool:
    return bool(np.all(np.minimum(a[1, :2], b[1, :2]) - np.maximum(a[0, :2], b[0, :2]) > 0.0))
