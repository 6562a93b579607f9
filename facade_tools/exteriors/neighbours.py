"""Which training buildings a sample resembles, a group of attributes at a time (FW16 Fig. 11)."""

from __future__ import annotations

from collections.abc import Iterator
from json import dumps

import numpy as np
from scipy.spatial import cKDTree

from ..artifacts.model import Model
from .coordinates import Floats, Readings
from .dataset import Ints
from .layout import GroupLayout, Layout
from .network import Network
from .row_bytes import text_column
from .transforms import forward

ATOM_DISTANCE = 3.0  # standard deviations between an atom, or an absent part, and anything else


class Neighbours:
    """Training rows of a model, searchable a group and as a whole."""

    def __init__(self, model: Model, network: Network) -> None:
        """Build a tree a group; a model without training rows finds nothing."""
        self.network = network
        self.ids = model.training.ids if model.training else ()
        self.names = text_column(dumps(name, ensure_ascii=False) for name in self.ids)
        rows = training_readings(model, network.layout) if self.ids else None
        self._points = [] if rows is None else self._embed(rows)
        self._trees = [_tree(points) for points in self._points]

    def _embed(self, readings: Readings) -> list[Floats]:
        groups = zip(self.network.layout.groups, self.network.scalings, strict=True)
        return [
            embed(values, group, scaling.center, scaling.scale)
            for values, (group, scaling) in zip(readings.values, groups, strict=True)
        ]

    def nearest(self, readings: Readings) -> Iterator[tuple[str, Ints, Floats]]:
        """Yield group name, index of the nearest training row (−1: none) and distance, (n,)."""
        for group, tree, points in zip(
            self.network.layout.groups, self._trees, self._embed(readings), strict=False
        ):
            if tree is None:
                yield group.name, np.full(len(points), -1), np.full(len(points), np.inf)
                continue
            rows, place = tree
            distance, index = rows.query(points)
            yield group.name, place[index], np.asarray(distance)

    def whole(self, readings: Readings) -> Floats:
        """Return embeddings (n, m) over all groups, for distances between samples."""
        return np.concatenate(self._embed(readings), axis=1)

    def training(self) -> Floats:
        """Return embeddings of the training rows, unobserved coordinates NaN."""
        if not self._points:
            return np.empty((0, 0))
        return np.concatenate(self._points, axis=1)


def _tree(points: Floats) -> tuple[cKDTree, Ints] | None:
    """Return a tree of the distinct points and where each stands first."""
    place = np.flatnonzero(np.isfinite(points).all(axis=1))
    if not len(place):
        return None
    distinct, first = np.unique(points[place], axis=0, return_index=True)
    return cKDTree(distinct), place[first]


def embed(values: Floats, group: GroupLayout, center: Floats, scale: Floats) -> Floats:
    """Return points whose distances compare rows of a group: NaN where unobserved.

    Standardised coordinates cut at ±3; an atom stands at its side of them, an absent part 3 apart.
    """
    out = np.full((len(values), 2 * values.shape[1]), np.nan)
    for i, coordinate in enumerate(group.coordinates):
        column = values[:, i]
        here, gone = np.isfinite(column), np.isinf(column)
        t, _ = forward(coordinate.transform, column[here])
        cut = np.clip((t - center[i]) / scale[i], -ATOM_DISTANCE, ATOM_DISTANCE)
        out[here, 2 * i], out[here, 2 * i + 1] = cut, 0.0
        out[gone, 2 * i], out[gone, 2 * i + 1] = 0.0, ATOM_DISTANCE
    return out


def training_readings(model: Model, layout: Layout) -> Readings:
    """Return the rows that a model carries; null in a group with an absent part is absent."""
    assert model.training is not None
    table = np.array(
        [[np.nan if x is None else x for x in row] for row in model.training.values],
        dtype=np.float64,
    )
    values, at = [], 0
    for group in layout.groups:
        values.append(table[:, at : at + len(group.coordinates)])
        at += len(group.coordinates)
    parts = tuple(
        np.full((len(table), sum(c.coordinate < 0 for c in g.channels)), -1, dtype=np.int8)
        for g in layout.groups
    )
    bits = np.nan_to_num(table[:, at:], nan=-1).astype(np.int8)
    return Readings(model.training.ids, tuple(values), parts, bits)
