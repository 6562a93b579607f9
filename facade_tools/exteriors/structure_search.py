"""Structure search (FW16 5.3): cardinalities of S and of the hidden variables, lateral edges.

The paper runs EM anew for every configuration. Here a group's family is fitted once for each
cardinality and set of parents (`mixture`) and reused under every cardinality of S; between two
configurations only S, the bits and the tables P(H | S) move (`styles`), warm from the
configuration before. The winner alone gets the full EM. docs/learn.md says what that skips.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from . import em, mixture, styles
from .coordinates import Floats
from .dataset import Dataset, Scaling
from .em import Prior, Stop, statistics
from .kernels_conjugate import dirichlet_part
from .lateral import Inputs, acyclic, admissible, crowded, parent_of
from .layout import Layout
from .mixture import Local, Task
from .network import Network, Weights
from .score import beta_part, family_part, table_part
from .styles import Evidence, Rows, Upper

log = logging.getLogger(__name__)

TOGETHER = Stop(relative=1e-5, iterations=30)


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds of the search: cardinalities from `least` to `largest`, lateral edges or not."""

    least: int = 2
    largest: int = 25
    lateral: bool = True


@dataclass(frozen=True, slots=True)
class Tried:
    """A configuration: |S|, size of each hidden variable, lateral inputs a group, score."""

    style: int
    hidden: tuple[int, ...]
    inputs: tuple[Inputs, ...]
    score: float


@dataclass(frozen=True, slots=True)
class State:
    """A configuration with everything that belongs to it."""

    upper: Upper
    sizes: tuple[int, ...]
    inputs: tuple[Inputs, ...]
    score: float


@dataclass
class Search:
    """The families fitted so far, and what has been tried.

    rng: of a restart, which begins at random styles; None begins at one style and cuts it.
    """

    layout: Layout
    data: Dataset
    scalings: tuple[Scaling, ...]
    weights: Weights
    prior: Prior
    limits: Limits
    tied: bool = False
    rng: np.random.Generator | None = None
    rows: Rows = field(init=False)
    families: dict[tuple[int, int, Inputs], tuple[Local, float]] = field(default_factory=dict)
    scaled: dict[tuple[int, int, Inputs], tuple[Floats, Floats]] = field(default_factory=dict)
    tried: list[Tried] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Gather what does not change."""
        self.rows = styles.rows_of(self.data, self.weights, self.prior)

    def task(self, g: int) -> Task:
        """Return group g as a task of its own."""
        weight = self.weights.groups[g]
        return Task(self.data, g, self.layout.groups[g], self.scalings[g], weight, self.prior)

    def family(self, g: int, size: int, inputs: Inputs) -> tuple[Local, float]:
        """Return the fit of a family and its part of the score; fitted at the first call."""
        key = (g, size, inputs)
        if key not in self.families:
            self.families[key] = self._fit(g, size, inputs)
        return self.families[key]

    def _fit(self, g: int, size: int, inputs: Inputs) -> tuple[Local, float]:
        task = self.task(g)
        if size == 1:
            fit = mixture.single(task, inputs, tied=self.tied)
        elif (g, size + 1, inputs) in self.families and (g, size - 1, inputs) not in self.families:
            fit = mixture.shrink(task, self.families[(g, size + 1, inputs)][0])
        else:
            fit = mixture.grow(task, self.family(g, size - 1, inputs)[0])
        return fit, self.part(g, fit)

    def part(self, g: int, fit: Local) -> float:
        """Return the family's part of the score."""
        weight = fit.clusters * self.weights.groups[g][:, None]
        counts = weight.sum(axis=0)[None]
        stats = statistics(fit.family, self.data.groups[g], self.data.features, weight, counts)
        return family_part(stats, fit.family, self.prior)

    def evidence(self, sizes: tuple[int, ...], inputs: tuple[Inputs, ...]) -> Evidence:
        """Return the evidence of all groups under a configuration."""
        return styles.evidence([self.shown(g, sizes[g], inputs[g]) for g in range(len(sizes))])

    def shown(self, g: int, size: int, inputs: Inputs) -> tuple[Floats, Floats]:
        """Return the scaled likelihoods of a family."""
        key = (g, size, inputs)
        if key not in self.scaled:
            self.scaled[key] = styles.scaled(self.family(g, size, inputs)[0].local)
        return self.scaled[key]

    def score(self, upper: Upper, sizes: tuple[int, ...], inputs: tuple[Inputs, ...]) -> float:
        """Return the Cheeseman-Stutz score of a configuration and remember it."""
        rows, prior = self.rows, self.prior
        total = float(rows.style_weight @ upper.log_density)
        total += table_part(rows.style_weight @ upper.posterior, upper.style, prior.style)
        one, zero = styles.bit_counts(rows, upper.posterior)
        total += beta_part(one, zero, upper.bits, rows.pseudo)
        starts = np.cumsum([0, *sizes])
        total += dirichlet_part(upper.counts, upper.hidden, starts, prior.hidden)
        total += sum(self.family(g, size, inputs[g])[1] for g, size in enumerate(sizes))
        self.tried.append(Tried(len(upper.style), sizes, inputs, total))
        return total

    def state(
        self,
        upper: Upper,
        shown: Evidence,
        sizes: tuple[int, ...],
        inputs: tuple[Inputs, ...],
        iterations: int,
    ) -> State:
        """Return the configuration after some EM of its upper half; shown: its evidence."""
        better = styles.improve(self.rows, shown, upper, iterations)
        return State(better, sizes, inputs, self.score(better, sizes, inputs))

    def network(self, state: State) -> Network:
        """Return the configuration as a network."""
        ends = np.cumsum(state.sizes)
        families = tuple(
            replace(
                self.family(g, size, inputs)[0].family,
                hidden=np.ascontiguousarray(state.upper.hidden[:, end - size : end]),
            )
            for g, (size, inputs, end) in enumerate(
                zip(state.sizes, state.inputs, ends, strict=True)
            )
        )
        return Network(self.layout, self.scalings, state.upper.style, state.upper.bits, families)


# --- cardinalities ------------------------------------------------------------------------------


def start(search: Search, inputs: tuple[Inputs, ...]) -> State:
    """Return the smallest configuration: every cardinality at its least."""
    sizes = tuple(search.limits.least for _ in search.layout.groups)
    shown = search.evidence(sizes, inputs)
    if search.rng is not None:
        least = max(search.limits.least, 2)
        guess = search.rng.dirichlet(np.ones(least), len(search.data))
        upper = styles.first(search.rows, shown, guess)
        return search.state(upper, shown, sizes, inputs, 30)
    upper = styles.first(search.rows, shown, np.ones((len(search.data), 1)))
    for _ in range(search.limits.least - 1):
        upper = styles.grow(search.rows, shown, upper)
    return search.state(upper, shown, sizes, inputs, 10)


def sweep(search: Search, state: State) -> Iterator[State]:
    """Yield the best configuration for each cardinality of S, from the state's own upwards."""
    while True:
        state = climb(search, state)
        yield state
        if len(state.upper.style) >= search.limits.largest:
            return
        shown = search.evidence(state.sizes, state.inputs)
        upper = styles.grow(search.rows, shown, state.upper)
        state = search.state(upper, shown, state.sizes, state.inputs, 10)


def climb(search: Search, state: State) -> State:
    """Raise, or lower, the size of each hidden variable in turn while the score rises."""
    for g in range(len(state.sizes)):
        for direction in (1, -1):
            after = _walk(search, state, g, direction)
            if after is not state:
                state = after
                break
    return state


def _walk(search: Search, state: State, g: int, direction: int) -> State:
    while search.limits.least <= state.sizes[g] + direction <= search.limits.largest:
        after = resized(search, state, g, state.sizes[g] + direction, state.inputs[g])
        if after.score <= state.score:
            return state
        state = after
    return state


def resized(search: Search, state: State, g: int, size: int, inputs: Inputs) -> State:
    """Return the configuration with another family for group g, S nearly where it was."""
    sizes = (*state.sizes[:g], size, *state.sizes[g + 1 :])
    all_inputs = (*state.inputs[:g], inputs, *state.inputs[g + 1 :])
    shown = search.evidence(sizes, all_inputs)
    clusters = search.family(g, size, inputs)[0].clusters
    weight = search.rows.group_weight[:, [g]]
    counts = (state.upper.posterior * weight).T @ clusters
    at = sum(state.sizes[:g])
    rest = state.upper.counts
    both = np.concatenate([rest[:, :at], counts, rest[:, at + state.sizes[g] :]], axis=1)
    upper = styles.maximise(search.rows, shown, state.upper.posterior, both)
    return search.state(upper, shown, sizes, all_inputs, 3)


# --- lateral edges ------------------------------------------------------------------------------


def greedy_edges(search: Search, state: State) -> State:
    """Add the lateral edge that raises the score most, until none does."""
    options = admissible(search.data, search.weights, search.layout)
    owners = parent_of(search.layout)
    gains: dict[tuple[int, int], float] = {
        (g, parent): np.inf for g, table in enumerate(options) for parent in table if parent >= 0
    }
    while gains:
        best = _best_edge(search, state, gains, options, owners)
        if best is None:
            return state
        state = best
    return state


def _best_edge(
    search: Search,
    state: State,
    gains: dict[tuple[int, int], float],
    options: list[dict[int, Inputs]],
    owners: list[int],
) -> State | None:
    """Return the configuration with the best edge more; gains are bounds from earlier rounds."""
    best: State | None = None
    best_key = (-1, -1)
    for g, parent in sorted(gains, key=lambda key: -gains[key]):
        if best is not None and gains[(g, parent)] <= best.score - state.score:
            break
        inputs = tuple(sorted({*state.inputs[g], *options[g][parent]}))
        proposed = (*state.inputs[:g], inputs, *state.inputs[g + 1 :])
        narrow = crowded(inputs, search.data.groups[g])
        if narrow or inputs == state.inputs[g] or not acyclic(proposed, search.layout):
            continue
        after = with_edge(search, state, g, inputs)
        gains[(g, parent)] = after.score - state.score
        if after.score > state.score and (best is None or after.score > best.score):
            best, best_key = after, (g, parent)
    for key in [key for key, gain in gains.items() if gain <= 0 or key == best_key]:
        del gains[key]
    return best


def pruned(search: Search, state: State) -> State:
    """Drop every lateral edge whose absence raises the score."""
    owners = parent_of(search.layout)
    pairs = [
        (g, p) for g, features in enumerate(state.inputs) for p in {owners[f] for f in features}
    ]
    for g, parent in sorted(pairs):
        rest = tuple(f for f in state.inputs[g] if owners[f] != parent)
        warm(search, g, state.sizes[g], state.inputs[g], rest, again=True)
        after = with_edge(search, state, g, rest)
        if after.score > state.score:
            state = after
    return state


def with_edge(search: Search, state: State, g: int, inputs: Inputs) -> State:
    """Return the configuration after group g takes `inputs`, with the best of nearby sizes."""
    size = state.sizes[g]
    warm(search, g, size, state.inputs[g], inputs)
    return resized(search, state, g, size, inputs)


def warm(
    search: Search, g: int, size: int, before: Inputs, after: Inputs, *, again: bool = False
) -> None:
    """Fit a family with other inputs, warm from the clusters that it had.

    again: even where such a family has been fitted before; the better one stays.
    """
    key = (g, size, after)
    known = search.families.get(key)
    if known is not None and not again:
        return
    task = search.task(g)
    old = search.family(g, size, before)[0]
    family = mixture.reshaped(task, old.family, after)
    first = mixture.evaluate(task, mixture.refit(task, family, old.clusters))
    fit = mixture.improve(task, first, 15)
    part = search.part(g, fit)
    if known is None or fit.total + part > known[0].total + known[1]:
        search.families[key] = (fit, part)
        search.scaled.pop(key, None)


# --- the search ---------------------------------------------------------------------------------


def refreshed(search: Search, state: State) -> State:
    """Return the configuration with families that EM has fitted together, not one by one."""
    fit = em.run(
        search.network(state), search.data, search.prior, weights=search.weights, stop=TOGETHER
    )
    network = fit.network
    for g, family in enumerate(network.families):
        alone = replace(family, hidden=(network.style @ family.hidden)[None])
        local = mixture.evaluate(search.task(g), alone)
        key = (g, state.sizes[g], state.inputs[g])
        for stale in [k for k in search.families if k[0] == g and k != key]:
            del search.families[stale]
            search.scaled.pop(stale, None)
        search.families[key] = (local, search.part(g, local))
        search.scaled.pop(key, None)
    hidden = np.concatenate([family.hidden for family in network.families], axis=1)
    shown = search.evidence(state.sizes, state.inputs)
    upper = styles.expect(search.rows, shown, network.style, network.bits, hidden)
    return search.state(upper, shown, state.sizes, state.inputs, 3)


def search_structure(search: Search) -> State:
    """Return the configuration of the highest score.

    S from least to largest without edges; lateral edges at the best; S again with these edges;
    edges once more; edges that have become needless are dropped. Then the same again from families
    that have been through EM together.
    """
    none: tuple[Inputs, ...] = tuple(() for _ in search.layout.groups)
    best = max(sweep(search, start(search, none)), key=lambda state: state.score)
    log.info("S %d, sizes %s, score %.1f", len(best.upper.style), best.sizes, best.score)
    if not search.limits.lateral:
        return best
    best = greedy_edges(search, best)
    again = max(sweep(search, start(search, best.inputs)), key=lambda state: state.score)
    best = max(best, again, key=lambda state: state.score)
    best = pruned(search, climb(search, greedy_edges(search, best)))
    fresh = refreshed(search, best)
    fresh = pruned(search, climb(search, greedy_edges(search, pruned(search, fresh))))
    best = max(best, fresh, key=lambda state: state.score)
    log.info("S %d, sizes %s, score %.1f", len(best.upper.style), best.sizes, best.score)
    return best
