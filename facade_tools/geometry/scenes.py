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

    Models stay where they are (a map) unless `always`, or unless most of them stand on one
    another; then all are put on a grid in reading order, rows away from the viewer, each cell as
    large as the largest plan.
    """
    out = np.zeros((len(boxes), 3))
    if len(boxes) < 2 or not (always or _on_one_another(boxes)):
        return out
    columns = int(np.ceil(np.sqrt(len(boxes))))
    cell = np.max([box[1, :2] - box[0, :2] for box in boxes], axis=0) + GAP
    for index, box in enumerate(boxes):
        row, column = divmod(index, columns)
        out[index, :2] = np.array([column, row]) * cell - box[:, :2].mean(axis=0)
    return out


def _on_one_another(boxes: Sequence[Floats]) -> bool:
    """Tell variants of one house from a town, in which bounds of neighbours may overlap a little.

    Most of the models share more than half of their plan's bounds with another one.
    """
    order = sorted([*low[:2], *high[:2]] for low, high in (box.tolist() for box in boxes))
    met: set[int] = set()
    active: list[int] = []
    for index, box in enumerate(order):
        active = [k for k in active if order[k][2] > box[0]]
        met.update(next(((index, k) for k in active if _share_half(box, order[k])), ()))
        if 2 * len(met) > len(order):
            return True
        active.append(index)
    return False


def _share_half(a: Sequence[float], b: Sequence[float]) -> bool:
    width, depth = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    smaller = min((box[2] - box[0]) * (box[3] - box[1]) for box in (a, b))
    return width > 0.0 and depth > 0.0 and 2.0 * width * depth > smaller
