"""The exact programme for one axis: the cheapest cutting of a line into states of an automaton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..artifacts.grammar import Size
from ..compiled import compiled
from .expressions import Automaton

Costs = NDArray[np.float64]  # (states, length): cost of every position under every state

TIE = 1e-9  # nats; rounding must not cut a part in two


@dataclass(frozen=True, slots=True)
class Bounds:
    """Sizes of the states in positions, and what their deviations cost.

    least, most: (states,). prior: (states, 3), typical size, 1 / spread, weight.
    """

    least: NDArray[np.int64]
    most: NDArray[np.int64]
    prior: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Moves:
    """An automaton as arrays: allowed[i, j] (j may follow i), first, last."""

    allowed: NDArray[np.bool_]
    first: NDArray[np.bool_]
    last: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Cut:
    """A cutting: states[i] holds positions bounds[i] to bounds[i + 1]; what it costs."""

    states: tuple[int, ...]
    bounds: tuple[int, ...]
    cost: float


def moves(machine: Automaton) -> Moves:
    """Return an automaton as arrays."""
    count = len(machine.symbols)
    allowed = np.zeros((count, count), np.bool_)
    first, last = np.zeros((2, count), np.bool_)
    for before, afters in machine.follow.items():
        allowed[before, list(afters)] = True
    first[list(machine.first)] = True
    last[list(machine.last)] = True
    return Moves(allowed, first, last)


def chain(count: int) -> Moves:
    """Return the automaton of one fixed sequence of states."""
    at = np.arange(count)
    return Moves(at[:, None] + 1 == at, at == 0, at == count - 1)


def bounds(sizes: tuple[Size, ...], unit: float, length: int) -> Bounds:
    """Return bounds in positions; `unit` is how many positions a size of 1 has."""
    least = [max(1, round(size.min * unit)) for size in sizes]
    most = [
        max(low, min(length, round(size.max * unit)))
        for size, low in zip(sizes, least, strict=True)
    ]
    rows = []
    for size in sizes:
        if size.weight > 0 and size.typical is not None and size.spread:
            rows.append((size.typical * unit, 1 / (size.spread * unit), size.weight))
        else:
            rows.append((0.0, 0.0, 0.0))
    return Bounds(
        np.array(least, np.int64),
        np.array(most, np.int64),
        np.array(rows, np.float64).reshape(-1, 3),
    )


def prior_cost(limits: Bounds, cut: Cut) -> float:
    """Return Σ weight · ((length − typical) / spread)² / 2, the prior energy of all lengths."""
    typical, steep, weight = limits.prior[list(cut.states)].T
    return float(np.sum(weight * ((np.diff(cut.bounds) - typical) * steep) ** 2 / 2))


def best_cut(costs: Costs, machine: Moves, limits: Bounds) -> Cut | None:
    """Return the cheapest cutting of the line that the automaton and the bounds allow.

    Exact: a dynamic programme over (end, state), O(length · states²), and O(length · largest size)
    more for each state with a prior. None where no word fits.
    Of cuttings that cost the same (within 1e-9) the one with longer last parts wins.
    """
    prefix = np.zeros((costs.shape[0], costs.shape[1] + 1))
    np.cumsum(costs, axis=1, out=prefix[:, 1:])
    arrays = (machine.allowed, machine.first, limits.least, limits.most, limits.prior)
    end, begin, before = solve(prefix, *arrays)
    closing = np.where(machine.last, end[:, -1], np.inf)
    state = int(np.argmin(closing))
    if not np.isfinite(closing[state]):
        return None
    states, cuts, at = [], [costs.shape[1]], costs.shape[1]
    while at > 0:
        states.append(state)
        start = int(begin[state, at])
        state, at = int(before[state, start]), start
        cuts.append(at)
    return Cut(tuple(states[::-1]), tuple(cuts[::-1]), float(closing.min()))


@compiled
def _window(
    state: int,
    at: int,
    start: NDArray[np.float64],
    prefix: NDArray[np.float64],
    least: NDArray[np.int64],
    most: NDArray[np.int64],
    prior: NDArray[np.float64],
    end: NDArray[np.float64],
    begin: NDArray[np.int64],
) -> None:
    """Find the best origin of a state with a prior that ends at `at`."""
    for origin in range(max(0, at - most[state]), at - least[state] + 1):
        if start[state, origin] == np.inf:
            continue
        cost = start[state, origin] - prefix[state, origin]
        if prior[state, 2] > 0.0:
            off = (at - origin - prior[state, 0]) * prior[state, 1]
            cost += prior[state, 2] * off * off / 2
        if cost < end[state, at] - TIE:
            end[state, at] = cost
            begin[state, at] = origin


@compiled
def solve(
    prefix: NDArray[np.float64],
    allowed: NDArray[np.bool_],
    first: NDArray[np.bool_],
    least: NDArray[np.int64],
    most: NDArray[np.int64],
    prior: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Fill the tables: cost of ending a state at a position, where it began, what came before."""
    states, size = prefix.shape
    end = np.full((states, size), np.inf)
    begin = np.zeros((states, size), np.int64)
    start = np.full((states, size), np.inf)
    before = np.full((states, size), -1, np.int64)
    start[:, 0] = np.where(first, 0.0, np.inf)
    # a queue for each state without a prior: origins whose cost may still become the least, each
    # later and dearer than the one before. Calls here would take longer than what they do
    origins = np.empty((states, size), np.int64)
    costs = np.empty((states, size))
    head, tail = np.zeros((2, states), np.int64)
    for at in range(1, size):
        for state in range(states):
            if prior[state, 2] > 0.0:
                _window(state, at, start, prefix, least, most, prior, end, begin)
                end[state, at] += prefix[state, at]
                continue
            origin = at - least[state]
            if origin >= 0 and start[state, origin] < np.inf:
                cost = start[state, origin] - prefix[state, origin]
                while tail[state] > head[state] and costs[state, tail[state] - 1] > cost + TIE:
                    tail[state] -= 1
                origins[state, tail[state]] = origin
                costs[state, tail[state]] = cost
                tail[state] += 1
            while head[state] < tail[state] and origins[state, head[state]] < at - most[state]:
                head[state] += 1
            if head[state] < tail[state]:
                begin[state, at] = origins[state, head[state]]
                end[state, at] = costs[state, head[state]] + prefix[state, at]
        for state in range(states):
            for other in range(states):
                if allowed[other, state] and end[other, at] < start[state, at] - TIE:
                    start[state, at] = end[other, at]
                    before[state, at] = other
    return end, begin, before
