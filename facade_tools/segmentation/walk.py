"""The paper's optimiser: a hill-climbing random walk with shrinking steps (TSKP10 4.2, 4.3).

Every iteration perturbs all rules of the best policy so far and keeps the best of the perturbed
policies. Their energies come from integral images. Where floors derive each for itself, a second
walk goes on from the best with common columns, every floor with a set of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..compiled import compiled
from ..errors import Infeasible
from ..grammar.expressions import Automaton
from ..grammar.plan import Plan
from ..grammar.sampling import random_word
from ..grammar.segments import Bounds, Cut, moves
from .dp import Solution, owners, relaxed_bound
from .energy import Field, Layout, column_limits, energy, row_limits
from .walk_kernel import Flags, Ints, Reals, cut_of, energy_of, perturb, prior_of

ITERATIONS = 1000
PERTURBED = 100  # policies an iteration
SEEDS = 400  # random policies of which the walk starts from the best
STEP = 0.04  # first standard deviation, shares of the picture's height
LAST_STEP = 0.002
CHANGE = 0.3  # probability that an axis changes its word
MAX_PARTS = 400


@dataclass(frozen=True, slots=True)
class Axes:
    """The automata of all words padded to one shape; row 0 is the rows', the rest sets of columns.

    least, most, typical: pixels. length: pixels of each axis. states: number of states.
    """

    allowed: Flags
    first: Flags
    last: Flags
    least: Ints
    most: Ints
    prior: Reals
    typical: Reals
    length: Ints
    states: Ints


@dataclass(frozen=True, slots=True)
class Policy:
    """Words and sizes of all axes, and which set of columns each row uses (−2: its group's)."""

    words: Ints
    sizes: Reals
    counts: Ints
    owner: Ints


@dataclass(frozen=True, slots=True)
class Images:
    """What energies are summed from: integral images, labels by state and kind, groups."""

    table: Reals
    label: Ints
    group: Ints


def solve(field: Field, plan: Plan, *, rng: np.random.Generator) -> Solution:
    """Return where the walk ends. Raises Infeasible where no seed fits the picture."""
    images = _images(field, plan)
    axes = _axes(field, plan, list(range(len(plan.groups))))
    policy = _seeded(field, plan, axes, images, rng)
    steps = _steps(field)
    trace = _walk(policy, axes, images, steps, CHANGE, rng)
    layout = _layout(plan, policy, axes, range(len(plan.groups)))
    if plan.per_floor:
        owner = owners(plan, layout.rows)
        policy, groups = _split(plan, layout, owner)
        axes = _axes(field, plan, groups)
        again = _walk(policy, axes, images, steps, CHANGE, rng)
        trace = np.concatenate([trace, again])
        layout = _layout(plan, policy, axes, range(len(groups)))
        layout = replace(layout, owner=owner)
    reached = energy(field, plan, layout)
    return Solution(layout, reached, tuple(trace.tolist()), relaxed_bound(field, plan))


def _steps(field: Field) -> Reals:
    shrink = np.geomspace(STEP, LAST_STEP, ITERATIONS)
    return shrink * field.shape[0]


def _images(field: Field, plan: Plan) -> Images:
    planes, height, width = field.cost.shape
    table = np.zeros((planes, height + 1, width + 1))
    table[:, 1:, 1:] = field.cost.cumsum(axis=1).cumsum(axis=2)
    most = max(len(state.labels) for state in plan.states)
    label = np.zeros((len(plan.states), most), np.int64)
    for i, state in enumerate(plan.states):
        label[i, : len(state.labels)] = [field.label[name] for name in state.labels]
    group = [-1 if state.group is None else state.group for state in plan.states]
    return Images(table, label, np.array(group, np.int64))


def _axes(field: Field, plan: Plan, groups: list[int]) -> Axes:
    """Return the axes of the rows and of sets of columns of the given groups."""
    machines = [plan.rows, *(plan.groups[group].automaton for group in groups)]
    limits = [row_limits(plan, field, range(len(plan.states)))]
    limits += [column_limits(plan, field, group) for group in groups]
    most = max(len(machine.symbols) for machine in machines)
    count = len(machines)
    axes = Axes(
        np.zeros((count, most, most), np.bool_), np.zeros((count, most), np.bool_),
        np.zeros((count, most), np.bool_), np.ones((count, most), np.int64),
        np.ones((count, most), np.int64), np.zeros((count, most, 3)), np.ones((count, most)),
        np.array([field.shape[0]] + [field.shape[1]] * len(groups), np.int64),
        np.array([len(machine.symbols) for machine in machines], np.int64),
    )  # fmt: skip
    for i, (machine, limit) in enumerate(zip(machines, limits, strict=True)):
        _fill(axes, i, machine, limit, field.shape[0])
    return axes


def _fill(axes: Axes, i: int, machine: Automaton, limit: Bounds, height: int) -> None:
    arrays, n = moves(machine), len(machine.symbols)
    axes.allowed[i, :n, :n] = arrays.allowed
    axes.first[i, :n], axes.last[i, :n] = arrays.first, arrays.last
    axes.least[i, :n], axes.most[i, :n] = limit.least, limit.most
    axes.prior[i, :n] = limit.prior
    axes.typical[i, :n] = np.maximum(limit.least, 0.03 * height)


def _empty(count: int) -> Policy:
    return Policy(
        np.zeros((count, MAX_PARTS), np.int64),
        np.zeros((count, MAX_PARTS)),
        np.zeros(count, np.int64),
        np.full(MAX_PARTS, -2, np.int64),
    )


def _seeded(
    field: Field, plan: Plan, axes: Axes, images: Images, rng: np.random.Generator
) -> Policy:
    """Return the best of many random policies with typical sizes."""
    best, least = None, np.inf
    machines = [plan.rows, *(group.automaton for group in plan.groups)]
    sizes = [[state.size for state in plan.states], *(list(g.sizes) for g in plan.groups)]
    lengths = axes.length / field.shape[0]
    for _ in range(SEEDS):
        policy = _empty(len(machines))
        try:
            for i, machine in enumerate(machines):
                word = random_word(machine, sizes[i], float(lengths[i]), rng=rng, tries=2)
                count = min(len(word.states), MAX_PARTS)
                policy.words[i, :count] = word.states[:count]
                policy.sizes[i, :count] = np.array(word.sizes[:count]) * axes.length[i]
                policy.counts[i] = count
        except Infeasible:
            continue
        reached = evaluate(*_arrays(policy, axes, images))
        if reached < least:
            best, least = policy, reached
    if best is None:
        raise Infeasible("no random facade of the grammar fits the picture")
    return best


Arrays = tuple[Ints, Reals, Ints, Ints, Ints, Ints, Ints, Reals, Reals, Ints, Ints]


def _arrays(policy: Policy, axes: Axes, images: Images) -> Arrays:
    return (
        policy.words, policy.sizes, policy.counts, policy.owner, axes.length, axes.least,
        axes.most, axes.prior, images.table, images.label, images.group,
    )  # fmt: skip


@compiled
def evaluate(
    words: Ints, sizes: Reals, counts: Ints, owner: Ints, length: Ints, least: Ints, most: Ints,
    prior: Reals, table: Reals, label: Ints, group: Ints,
) -> float:  # fmt: skip
    """Return the energy of a policy; infinite where adapted sizes break their bounds."""
    cuts = np.zeros((words.shape[0], words.shape[1] + 1), np.int64)
    total = 0.0
    for axis in range(words.shape[0]):
        fits = cut_of(
            words[axis], sizes[axis], counts[axis], length[axis], least[axis], most[axis],
            cuts[axis],
        )  # fmt: skip
        if not fits:
            return np.inf
        total += prior_of(prior[axis], words[axis], cuts[axis], counts[axis])
    return total + energy_of(table, label, group, owner, words, cuts, counts)


def _walk(
    policy: Policy, axes: Axes, images: Images, steps: Reals, change: float,
    rng: np.random.Generator,
) -> Reals:  # fmt: skip
    """Walk from `policy`, which becomes the best found; returns the best energy by iteration."""
    fixed = bool((policy.owner >= -1).any())
    machines = (axes.allowed, axes.first, axes.last, axes.typical, axes.states)
    trace: Reals = run_walk(
        *_arrays(policy, axes, images), *machines, steps, change, fixed, PERTURBED, rng
    )
    return trace


@compiled
def run_walk(
    words: Ints, sizes: Reals, counts: Ints, owner: Ints, length: Ints, least: Ints, most: Ints,
    prior: Reals, table: Reals, label: Ints, group: Ints, allowed: Flags, first: Flags,
    last: Flags, typical: Reals, states: Ints, steps: Reals, change: float, fixed: bool,
    perturbed: int, rng: np.random.Generator,
) -> Reals:  # fmt: skip
    """Walk in place. `fixed`: the rows keep their word, only their sizes move."""
    best = evaluate(words, sizes, counts, owner, length, least, most, prior, table, label, group)
    trace = np.empty(len(steps))
    for step in range(len(steps)):
        kept_words, kept_sizes, kept_counts = words.copy(), sizes.copy(), counts.copy()
        for _ in range(perturbed):
            new_words, new_sizes, new_counts = words.copy(), sizes.copy(), counts.copy()
            for axis in range(len(counts)):
                if rng.random() < 0.5:
                    continue
                n = states[axis]
                new_counts[axis] = perturb(
                    new_words[axis], new_sizes[axis], new_counts[axis], allowed[axis, :n, :n],
                    first[axis, :n], last[axis, :n], typical[axis], steps[step],
                    0.0 if fixed and axis == 0 else change, rng,
                )  # fmt: skip
            reached = evaluate(
                new_words, new_sizes, new_counts, owner, length, least, most, prior, table, label,
                group,
            )  # fmt: skip
            if reached < best:
                best = reached
                kept_words, kept_sizes, kept_counts = new_words, new_sizes, new_counts
        words[:], sizes[:], counts[:] = kept_words, kept_sizes, kept_counts
        trace[step] = best
    return trace


def _layout(plan: Plan, policy: Policy, axes: Axes, sets: range) -> Layout:
    cuts = []
    for i in range(len(policy.counts)):
        count = int(policy.counts[i])
        out = np.zeros(count + 1, np.int64)
        arrays = (policy.words[i], policy.sizes[i], count, int(axes.length[i]))
        if not cut_of(*arrays, axes.least[i], axes.most[i], out):
            raise Infeasible("the random walk found no facade that fits the picture")
        cuts.append(Cut(tuple(policy.words[i, :count].tolist()), tuple(out.tolist()), 0.0))
    groups = [plan.states[state].group for state in cuts[0].states]
    owner = tuple(-1 if group is None else group for group in groups)
    return Layout(cuts[0], tuple(cuts[1 : 1 + len(sets)]), owner)


def _split(plan: Plan, layout: Layout, owner: tuple[int, ...]) -> tuple[Policy, list[int]]:
    """Give every instance that derives for itself its own copy of the columns."""
    sets: dict[int, int] = {}
    for i, own in enumerate(owner):
        if own >= 0:
            sets.setdefault(own, i)
    policy = _empty(1 + len(sets))
    groups = []
    _store(policy, 0, layout.rows)
    for own, i in sorted(sets.items()):
        group = plan.states[layout.rows.states[i]].group
        assert group is not None
        groups.append(group)
        _store(policy, 1 + own, layout.columns[layout.owner[i]])
    policy.owner[:] = -1
    policy.owner[: len(owner)] = owner
    return policy, groups


def _store(policy: Policy, axis: int, cut: Cut) -> None:
    policy.words[axis, : len(cut.states)] = cut.states
    policy.sizes[axis, : len(cut.states)] = np.diff(cut.bounds)
    policy.counts[axis] = len(cut.states)
