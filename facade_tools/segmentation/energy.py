"""Costs of a probability map under a plan, and the exact sums that the solvers need.

Rows are counted from the bottom here, as grammars are written; `costs` turns the picture over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..errors import InvalidInput
from ..grammar.plan import Plan
from ..grammar.segments import Bounds, Cut, bounds, prior_cost

LEAST_PROBABILITY = 1e-4


@dataclass(frozen=True, slots=True)
class Field:
    """Pixel costs, −ln max(p, 1e-4), and their running sums in both directions.

    cost: (labels, height, width), row 0 is the bottom. across, up: running sums along x and y,
    one longer. label: index of each label's plane.
    """

    cost: NDArray[np.float64]
    across: NDArray[np.float64]
    up: NDArray[np.float64]
    label: dict[str, int]

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width."""
        return self.cost.shape[1], self.cost.shape[2]


@dataclass(frozen=True, slots=True)
class Layout:
    """A derivation as cuttings: rows from the bottom, columns of each set, set of each row.

    owner[i] is the set of columns of row segment i, −1 for a terminal's row.
    """

    rows: Cut
    columns: tuple[Cut, ...]
    owner: tuple[int, ...]


def field_of(probabilities: NDArray[np.float32], classes: Sequence[str], plan: Plan) -> Field:
    """Return the costs of class probabilities (classes, height, width), top row first.

    Raises InvalidInput where the grammar uses a label that the classifier does not know.
    """
    check_labels(classes, plan)
    planes = probabilities[[classes.index(label) for label in plan.labels], ::-1]
    cost = -np.log(np.maximum(planes, np.float32(LEAST_PROBABILITY)).astype(np.float64))
    return _field(cost, {label: i for i, label in enumerate(plan.labels)})


def check_labels(classes: Sequence[str], plan: Plan) -> None:
    """Raise InvalidInput where a grammar uses labels that a classifier does not know."""
    missing = ", ".join(label for label in plan.labels if label not in classes)
    if missing:
        message = f"the classifier knows {', '.join(classes)}"
        raise InvalidInput(f"{message}; grammar {plan.grammar.id!r} needs {missing} too")


def _field(cost: NDArray[np.float64], label: dict[str, int]) -> Field:
    across = np.zeros((*cost.shape[:2], cost.shape[2] + 1))
    np.cumsum(cost, axis=2, out=across[:, :, 1:])
    up = np.zeros((cost.shape[0], cost.shape[1] + 1, cost.shape[2]))
    np.cumsum(cost, axis=1, out=up[:, 1:])
    return Field(cost, across, up, label)


def coarsened(field: Field, factor: int) -> Field:
    """Return a field whose pixels are sums over squares of `factor` pixels, cut off at the ends."""
    return _field(_shrunk(_shrunk(field.cost, 1, factor), 2, factor), field.label)


def _shrunk(cost: NDArray[np.float64], axis: int, factor: int) -> NDArray[np.float64]:
    """Sum every `factor` neighbours along an axis; a few long additions, reduceat makes many."""
    every = (slice(None),) * axis
    out = cost[(*every, slice(0, None, factor))].copy()
    for k in range(1, factor):
        more = cost[(*every, slice(k, None, factor))]
        out[(*every, slice(more.shape[axis]))] += more
    return out


def state_costs(
    field: Field, plan: Plan, states: Sequence[int], columns: Sequence[Cut | None]
) -> NDArray[np.float64]:
    """Return (states, height): cost of each row under each state; columns[i] are state i's."""
    height = field.shape[0]
    whole = [(0, height)] * len(states)
    return span_costs(field, plan, states, columns, whole)


def span_costs(
    field: Field,
    plan: Plan,
    states: Sequence[int],
    columns: Sequence[Cut | None],
    spans: Sequence[tuple[int, int]],
) -> NDArray[np.float64]:
    """Return (states, height): cost of rows under each state within its span, 0 elsewhere."""
    height, width = field.shape
    plane: list[int] = []
    border: list[tuple[int, int]] = []
    first = [0]
    for number, cut in zip(states, columns, strict=True):
        labels = [field.label[label] for label in plan.states[number].labels]
        if cut is None:
            plane.append(labels[0])
            border.append((0, width))
        else:
            plane += [labels[kind] for kind in cut.states]
            border += zip(cut.bounds, cut.bounds[1:], strict=False)
        first.append(len(plane))
    out = np.zeros((len(states), height))
    parts = (np.array(plane, np.int64), np.array(border, np.int64), np.array(first, np.int64))
    _sum_rows(field.across, *parts, np.array(spans, np.int64), out)
    return out


@compiled
def _sum_rows(
    across: NDArray[np.float64],
    plane: NDArray[np.int64],
    border: NDArray[np.int64],
    first: NDArray[np.int64],
    spans: NDArray[np.int64],
    out: NDArray[np.float64],
) -> None:
    for i in range(out.shape[0]):
        for y in range(spans[i, 0], spans[i, 1]):
            for k in range(first[i], first[i + 1]):
                row = across[plane[k], y]
                out[i, y] += row[border[k, 1]] - row[border[k, 0]]


def column_costs(
    field: Field, plan: Plan, rows: Sequence[tuple[int, int, int]]
) -> NDArray[np.float64]:
    """Return (kinds, width): cost of each column under each kind; rows are (state, from, to)."""
    kinds = len(plan.states[rows[0][0]].labels)
    out = np.zeros((kinds, field.shape[1]))
    for number, low, high in rows:
        planes = [field.label[label] for label in plan.states[number].labels]
        used = sorted(set(planes))
        band = dict(zip(used, field.up[used, high] - field.up[used, low], strict=True))
        for kind, plane in enumerate(planes):
            out[kind] += band[plane]
    return out


def row_limits(plan: Plan, field: Field, states: Sequence[int]) -> Bounds:
    """Return the bounds of rows of the given states, in pixels."""
    height = field.shape[0]
    return bounds(tuple(plan.states[s].size for s in states), height, height)


def column_limits(plan: Plan, field: Field, group: int) -> Bounds:
    """Return the bounds of a group's columns, in pixels."""
    height, width = field.shape
    return bounds(plan.groups[group].sizes, height, width)


def energy(field: Field, plan: Plan, layout: Layout) -> float:
    """Return −Σ ln p over the layout's pixels plus the priors of sizes, summed directly."""
    used: set[int] = set()
    total = prior_cost(row_limits(plan, field, range(len(plan.states))), layout.rows)
    for i, number in enumerate(layout.rows.states):
        low, high = layout.rows.bounds[i], layout.rows.bounds[i + 1]
        labels = plan.states[number].labels
        if layout.owner[i] < 0:
            total += float(field.cost[field.label[labels[0]], low:high].sum())
            continue
        cut = layout.columns[layout.owner[i]]
        for kind, left, right in zip(cut.states, cut.bounds, cut.bounds[1:], strict=False):
            total += float(field.cost[field.label[labels[kind]], low:high, left:right].sum())
        if layout.owner[i] not in used:
            used.add(layout.owner[i])
            group = plan.states[number].group
            assert group is not None  # a row with columns has their group
            total += prior_cost(column_limits(plan, field, group), cut)
    return total
