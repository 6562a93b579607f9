"""Exact alternation: given the columns the best rows are a dynamic programme, and the reverse.

TSKP10 searches the derivations of a factorised grammar by a random walk. Here each half-step is
exact, so that the energy never rises; it ends where neither half can improve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible
from ..grammar.plan import Plan
from ..grammar.segments import Bounds, Cut, Moves, best_cut, chain, moves, prior_cost
from .energy import (
    Field,
    Layout,
    coarsened,
    column_costs,
    column_limits,
    energy,
    row_limits,
    state_costs,
)
from .refining import enlarged, refined

STARTS = (0.1, 0.6)
MAX_ROUNDS = 30
COARSE = (288, 600)  # rows and columns of a field that is solved as it is
REACH = 3  # coarse pixels that a border may move on the fine field
GAIN = 1e-6  # nats: less is no improvement


@dataclass(frozen=True, slots=True)
class Solution:
    """The best layout found, its energy, the energies on the way, and a bound from below."""

    layout: Layout
    energy: float
    trace: tuple[float, ...]
    bound: float

    @property
    def optimal(self) -> bool:
        """Whether the bound proves that nothing is better."""
        return self.energy <= self.bound + GAIN


def solve(field: Field, plan: Plan) -> Solution:
    """Return the best of several alternations. Raises Infeasible where no facade fits.

    A field of many rows is solved on squares of pixels first; then every border finds its pixel.
    """
    factor = max(-(-side // most) for side, most in zip(field.shape, COARSE, strict=True))
    if factor == 1:
        return _solve(_task(field, plan))
    coarse = _solve(_task(coarsened(field, factor), plan))
    layout = enlarged(coarse.layout, factor, field.shape)
    layout = refined(field, plan, layout, REACH * factor)
    reached = energy(field, plan, layout)
    return Solution(layout, reached, (*coarse.trace, reached), relaxed_bound(field, plan))


@dataclass(frozen=True, slots=True)
class _Task:
    """A field under a plan, with what all half-steps ask for.

    rows, columns: what may follow what, and sizes in pixels; of rows, of each group's columns.
    """

    field: Field
    plan: Plan
    rows: tuple[Moves, Bounds]
    columns: tuple[tuple[Moves, Bounds], ...]


def _task(field: Field, plan: Plan) -> _Task:
    rows = moves(plan.rows), row_limits(plan, field, range(len(plan.states)))
    columns = [
        (moves(group.automaton), column_limits(plan, field, number))
        for number, group in enumerate(plan.groups)
    ]
    return _Task(field, plan, rows, tuple(columns))


def _solve(task: _Task) -> Solution:
    """Alternate from several starts on the field as it is.

    A grammar whose floors derive each for itself goes on from every start and from its best
    common columns.
    """
    free = _free_rows(task.field, task.plan)
    bound = _solve_rows(task, free).cost
    best: Layout | None = None
    reached = np.inf
    trace: list[float] = []
    seen: set[tuple[int, ...]] = set()
    for rows in _starts(task, free):
        layout, path = _alternate(task, rows)
        found = [(layout, path[-1])]
        if task.plan.per_floor:
            # the best common columns may hide floors that the picture shows
            fresh = [cut for cut in (rows, layout.rows) if _key(cut) not in seen]
            seen.update(_key(cut) for cut in fresh)
            found = [_unfactored(task, cut) for cut in fresh]
        for layout, cost in found:
            trace.append(cost)
            if cost < reached - GAIN:
                best, reached = layout, cost
    assert best is not None
    return Solution(best, energy(task.field, task.plan, best), tuple(trace), bound)


def _starts(task: _Task, free: NDArray[np.float64]) -> list[Cut]:
    """Return different rows to start from: columns forgotten, more and less freely."""
    cuts: dict[tuple[int, ...], Cut] = {}
    mean = _mean_rows(task.field, task.plan)
    for mix in STARTS:
        rows = _solve_rows(task, (1 - mix) * free + mix * mean)
        cuts.setdefault(_key(rows), rows)
    return list(cuts.values())


def _key(cut: Cut) -> tuple[int, ...]:
    return (*cut.states, *cut.bounds)


def relaxed_bound(field: Field, plan: Plan) -> float:
    """Return what no layout of the grammar can cost less than, common columns or not."""
    return _solve_rows(_task(field, plan), _free_rows(field, plan)).cost


def _free_rows(field: Field, plan: Plan) -> NDArray[np.float64]:
    """Return (states, height): cost of rows whose pixels choose their kind freely.

    It bounds every layout from below: the columns are forgotten.
    """
    known = {planes: _cheapest(field, planes) for planes in dict.fromkeys(_planes(field, plan))}
    return np.array([known[planes] for planes in _planes(field, plan)])


def _cheapest(field: Field, planes: tuple[int, ...]) -> NDArray[np.float64]:
    least = field.cost[planes[0]].copy()
    for plane in planes[1:]:
        np.minimum(least, field.cost[plane], out=least)
    total: NDArray[np.float64] = least.sum(axis=1)
    return total


def _mean_rows(field: Field, plan: Plan) -> NDArray[np.float64]:
    """Return (states, height): mean cost of rows over the kinds of their columns."""
    whole = field.across[:, :, -1]
    return np.array([whole[list(planes)].mean(axis=0) for planes in _planes(field, plan)])


def _planes(field: Field, plan: Plan) -> list[tuple[int, ...]]:
    """Return the planes that each state of a row may show."""
    return [tuple(sorted({field.label[label] for label in s.labels})) for s in plan.states]


def _solve_rows(task: _Task, costs: NDArray[np.float64]) -> Cut:
    cut = best_cut(costs, *task.rows)
    if cut is None:
        raise Infeasible("no facade of the grammar is as small as the picture")
    return cut


def _solve_columns(task: _Task, rows: list[tuple[int, int, int]]) -> Cut:
    group = task.plan.states[rows[0][0]].group
    assert group is not None
    cut = best_cut(column_costs(task.field, task.plan, rows), *task.columns[group])
    if cut is None:
        raise Infeasible("no row of the grammar is as narrow as the picture")
    return cut


def _segments(rows: Cut) -> list[tuple[int, int, int]]:
    return list(zip(rows.states, rows.bounds, rows.bounds[1:], strict=False))


def _alternate(task: _Task, rows: Cut) -> tuple[Layout, list[float]]:
    """Improve rows and common columns in turn."""
    field, plan = task.field, task.plan
    columns: dict[int, Cut] = {}
    path: list[float] = []
    for _ in range(MAX_ROUNDS):
        for number in range(len(plan.groups)):
            own = [row for row in _segments(rows) if plan.states[row[0]].group == number]
            every = [
                (s, 0, field.shape[0])
                for s, state in enumerate(plan.states)
                if state.group == number
            ]
            if own or number not in columns:
                columns[number] = _solve_columns(task, own or every)
        groups = [state.group for state in plan.states]
        sets = [None if group is None else columns[group] for group in groups]
        rows = _solve_rows(task, state_costs(field, plan, range(len(groups)), sets))
        owner = tuple(-1 if (group := groups[s]) is None else group for s in rows.states)
        layout = Layout(rows, tuple(columns[g] for g in range(len(plan.groups))), owner)
        path.append(rows.cost + _priors(task, layout))
        if len(path) > 1 and path[-1] > path[-2] - GAIN:
            break
    return layout, path


def _priors(task: _Task, layout: Layout) -> float:
    """Return the priors of the columns that rows use."""
    groups = {
        own: group
        for number, own in zip(layout.rows.states, layout.owner, strict=True)
        if (group := task.plan.states[number].group) is not None
    }
    return sum(prior_cost(task.columns[groups[own]][1], layout.columns[own]) for own in groups)


def owners(plan: Plan, rows: Cut) -> tuple[int, ...]:
    """Return the set of columns of each row: one a group, or an instance where `each` says so."""
    out: list[int] = []
    known: dict[int, int] = {}
    count = 0
    previous = -1
    for number in rows.states:
        group = plan.states[number].group
        if group is None:
            out.append(-1)
        elif plan.groups[group].each:
            same = previous >= 0 and _same_instance(plan, previous, number)
            count += not same
            out.append(count - 1)
        else:
            if group not in known:
                known[group] = count
                count += 1
            out.append(known[group])
        previous = number
    return tuple(out)


def _same_instance(plan: Plan, before: int, after: int) -> bool:
    shared = plan.rows.follow[before].get(after, -1)
    own = plan.states[after].path
    return plan.states[before].path == own and shared == len(own)


def _unfactored(task: _Task, rows: Cut) -> tuple[Layout, float]:
    """Give floors their own columns and alternate with the sequence of rows kept."""
    field, plan = task.field, task.plan
    owner = owners(plan, rows)
    path: list[float] = []
    limits = row_limits(plan, field, rows.states)
    for _ in range(MAX_ROUNDS):
        segments = _segments(rows)
        columns = tuple(
            _solve_columns(task, [s for s, o in zip(segments, owner, strict=True) if o == own])
            for own in range(max(owner) + 1)
        )
        sets = [None if own < 0 else columns[own] for own in owner]
        costs = state_costs(field, plan, rows.states, sets)
        cut = best_cut(costs, chain(len(rows.states)), limits)
        assert cut is not None  # the old bounds are a solution
        rows = Cut(rows.states, cut.bounds, cut.cost)
        layout = Layout(rows, columns, owner)
        path.append(cut.cost + _priors(task, layout))
        if len(path) > 1 and path[-1] > path[-2] - GAIN:
            break
    return layout, path[-1]
