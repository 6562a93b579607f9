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
from ..grammar.segments import Cut, best_cut, chain, moves
from .energy import (
    Field,
    Layout,
    coarsened,
    column_costs,
    column_limits,
    column_prior,
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
        return _solve(field, plan)
    coarse = _solve(coarsened(field, factor), plan)
    layout = enlarged(coarse.layout, factor, field.shape)
    layout = refined(field, plan, layout, REACH * factor)
    reached = energy(field, plan, layout)
    return Solution(layout, reached, (*coarse.trace, reached), relaxed_bound(field, plan))


def _solve(field: Field, plan: Plan) -> Solution:
    """Alternate from several starts on the field as it is.

    A grammar whose floors derive each for itself goes on from every start and from its best
    common columns.
    """
    relaxed = _relaxed(field, plan)
    bound = _solve_rows(field, plan, relaxed[0]).cost
    best: Layout | None = None
    reached = np.inf
    trace: list[float] = []
    seen: set[tuple[int, ...]] = set()
    for rows in _starts(field, plan, relaxed):
        layout, path = _alternate(field, plan, rows)
        found = [(layout, path[-1])]
        if plan.per_floor:
            # the best common columns may hide floors that the picture shows
            fresh = [cut for cut in (rows, layout.rows) if _key(cut) not in seen]
            seen.update(_key(cut) for cut in fresh)
            found = [_unfactored(field, plan, cut) for cut in fresh]
        for layout, cost in found:
            trace.append(cost)
            if cost < reached - GAIN:
                best, reached = layout, cost
    assert best is not None
    return Solution(best, energy(field, plan, best), tuple(trace), bound)


def _starts(
    field: Field, plan: Plan, relaxed: tuple[NDArray[np.float64], NDArray[np.float64]]
) -> list[Cut]:
    """Return different rows to start from: columns forgotten, more and less freely."""
    cuts: dict[tuple[int, ...], Cut] = {}
    for mix in STARTS:
        rows = _solve_rows(field, plan, (1 - mix) * relaxed[0] + mix * relaxed[1])
        cuts.setdefault(_key(rows), rows)
    return list(cuts.values())


def _key(cut: Cut) -> tuple[int, ...]:
    return (*cut.states, *cut.bounds)


def relaxed_bound(field: Field, plan: Plan) -> float:
    """Return what no layout of the grammar can cost less than, common columns or not."""
    return _solve_rows(field, plan, _relaxed(field, plan)[0]).cost


def _relaxed(field: Field, plan: Plan) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (states, height) costs of rows whose pixels choose their kind freely, and of the mean.

    The first bounds every layout from below: the columns are forgotten.
    """
    known: dict[tuple[int, ...], tuple[NDArray[np.float64], NDArray[np.float64]]] = {}
    pairs = []
    for state in plan.states:
        planes = tuple(sorted({field.label[label] for label in state.labels}))
        if planes not in known:
            table = field.cost[list(planes)]
            known[planes] = (table.min(axis=0).sum(axis=1), table.mean(axis=0).sum(axis=1))
        pairs.append(known[planes])
    return np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])


def _solve_rows(field: Field, plan: Plan, costs: NDArray[np.float64]) -> Cut:
    every = range(len(plan.states))
    cut = best_cut(costs, moves(plan.rows), row_limits(plan, field, every))
    if cut is None:
        raise Infeasible("no facade of the grammar is as small as the picture")
    return cut


def _solve_columns(field: Field, plan: Plan, rows: list[tuple[int, int, int]]) -> Cut:
    group = plan.states[rows[0][0]].group
    assert group is not None
    machine = moves(plan.groups[group].automaton)
    cut = best_cut(column_costs(field, plan, rows), machine, column_limits(plan, field, group))
    if cut is None:
        raise Infeasible("no row of the grammar is as narrow as the picture")
    return cut


def _segments(rows: Cut) -> list[tuple[int, int, int]]:
    return list(zip(rows.states, rows.bounds, rows.bounds[1:], strict=False))


def _alternate(field: Field, plan: Plan, rows: Cut) -> tuple[Layout, list[float]]:
    """Improve rows and common columns in turn."""
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
                columns[number] = _solve_columns(field, plan, own or every)
        groups = [state.group for state in plan.states]
        sets = [None if group is None else columns[group] for group in groups]
        rows = _solve_rows(field, plan, state_costs(field, plan, range(len(groups)), sets))
        owner = tuple(-1 if (group := groups[s]) is None else group for s in rows.states)
        layout = Layout(rows, tuple(columns[g] for g in range(len(plan.groups))), owner)
        path.append(rows.cost + _priors(field, plan, layout))
        if len(path) > 1 and path[-1] > path[-2] - GAIN:
            break
    return layout, path


def _priors(field: Field, plan: Plan, layout: Layout) -> float:
    """Return the priors of the columns that rows use."""
    groups = {
        o: plan.states[s].group for s, o in zip(layout.rows.states, layout.owner, strict=True)
    }
    used = [o for o in groups if o >= 0]
    return sum(column_prior(plan, field, groups[o], layout.columns[o]) for o in used)


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


def _unfactored(field: Field, plan: Plan, rows: Cut) -> tuple[Layout, float]:
    """Give floors their own columns and alternate with the sequence of rows kept."""
    owner = owners(plan, rows)
    path: list[float] = []
    limits = row_limits(plan, field, rows.states)
    for _ in range(MAX_ROUNDS):
        segments = _segments(rows)
        columns = tuple(
            _solve_columns(
                field, plan, [s for s, o in zip(segments, owner, strict=True) if o == own]
            )
            for own in range(max(owner) + 1)
        )
        sets = [None if own < 0 else columns[own] for own in owner]
        costs = state_costs(field, plan, rows.states, sets)
        cut = best_cut(costs, chain(len(rows.states)), limits)
        assert cut is not None  # the old bounds are a solution
        rows = Cut(rows.states, cut.bounds, cut.cost)
        layout = Layout(rows, columns, owner)
        path.append(cut.cost + _priors(field, plan, layout))
        if len(path) > 1 and path[-1] > path[-2] - GAIN:
            break
    return layout, path[-1]
