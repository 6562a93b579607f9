"""The paper's alternative models (FW16 5.1, Fig. 12), all written as the same kind of network.

no-middle: groups hang on S itself. flat: no hidden variable, lateral edges only, bits as parents
too. gmm: one hidden variable over all coordinates, full covariance, its size by MDL.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from . import mixture
from .coordinates import Floats
from .dataset import Dataset, Scaling
from .em import Fit, Prior, Stop, fit_bits, run
from .lateral import Inputs, acyclic, admissible
from .layout import Layout
from .mixture import Local, Task, reshaped
from .network import Family, Network, Weights, empty_family
from .score import cheeseman_stutz
from .structure_search import Tried
from .styles import cut

WARM = Stop(relative=1e-5, iterations=40)
PATIENCE = 4  # cardinalities of S that may bring nothing before the sweep ends


@dataclass(frozen=True, slots=True)
class Rows:
    """What the variants are fitted to."""

    layout: Layout
    data: Dataset
    scalings: tuple[Scaling, ...]
    weights: Weights
    prior: Prior
    tied: bool = False

    def task(self, g: int) -> Task:
        """Return group g as a task of its own."""
        weight = self.weights.groups[g]
        return Task(self.data, g, self.layout.groups[g], self.scalings[g], weight, self.prior)


@dataclass(frozen=True, slots=True)
class Scored:
    """A fit with its score."""

    fit: Fit
    score: float

    def tried(self) -> Tried:
        """Return it as a configuration."""
        families = self.fit.network.families
        sizes = tuple(len(f.coef) for f in families)
        inputs = tuple(f.inputs for f in families)
        return Tried(len(self.fit.network.style), sizes, inputs, self.score)


def scored(rows: Rows, network: Network) -> Scored:
    """Return the network after EM, with its Cheeseman-Stutz score."""
    fit = run(network, rows.data, rows.prior, weights=rows.weights, stop=WARM)
    score = cheeseman_stutz(fit.network, rows.data, rows.weights, fit.posterior, rows.prior)
    return Scored(fit, score)


# --- no-middle and flat -------------------------------------------------------------------------


def direct_network(rows: Rows, posterior: Floats, families: tuple[Family, ...]) -> Network:
    """Return the network of groups on S after an M-step from a posterior of S (n, |S|)."""
    styles = posterior.shape[1]
    fitted = tuple(
        replace(
            mixture.refit(rows.task(g), family, posterior),
            hidden=np.eye(styles),
            direct=True,
        )
        for g, family in enumerate(families)
    )
    mass = rows.weights.style @ posterior
    bits = fit_bits(rows.data, rows.weights, posterior, rows.prior)
    return Network(rows.layout, rows.scalings, mass / mass.sum(), bits, fitted)


def direct_sweep(rows: Rows, inputs: tuple[Inputs, ...], largest: int) -> Iterator[Scored]:
    """Yield the fits for |S| = 1, 2, … `largest`, each warm from the one before."""
    blank = tuple(
        replace(reshaped(rows.task(g), empty_family(group, 1, 1), inputs[g]), tied=rows.tied)
        for g, group in enumerate(rows.layout.groups)
    )
    network = direct_network(rows, np.ones((len(rows.data), 1)), blank)
    best = scored(rows, network)
    yield best
    look = _look(rows)
    while len(best.fit.network.style) < largest:
        posterior = best.fit.posterior.style
        heavy = np.argsort(-(rows.weights.style @ posterior))[:2]
        halves = [cut(posterior, look, rows.weights.style, int(k)) for k in heavy]
        families = best.fit.network.families
        best = max(
            (scored(rows, direct_network(rows, half, families)) for half in halves),
            key=lambda one: one.score,
        )
        yield best


def _look(rows: Rows) -> Floats:
    parts = [mixture.appearance(rows.task(g)) for g in range(len(rows.layout.groups))]
    return np.concatenate([*parts, np.maximum(rows.data.bits, 0)], axis=1)


def no_middle(rows: Rows, largest: int, tried: list[Tried]) -> Fit:
    """Return the best network of groups on S, with lateral edges."""
    none: tuple[Inputs, ...] = tuple(() for _ in rows.layout.groups)
    best = _best(direct_sweep(rows, none, largest), tried)
    edges = complete_edges(rows, best.fit, bits=False)
    if edges == none:
        return best.fit
    again = _best(direct_sweep(rows, edges, largest), tried)
    return max(best, again, key=lambda one: one.score).fit


def _best(fits: Iterator[Scored], tried: list[Tried]) -> Scored:
    best: Scored | None = None
    for fit in fits:
        tried.append(fit.tried())
        best = fit if best is None or fit.score > best.score else best
    assert best is not None
    return best


def flat(rows: Rows, tried: list[Tried]) -> Fit:
    """Return the directed network without hidden variables."""
    none: tuple[Inputs, ...] = tuple(() for _ in rows.layout.groups)
    alone = _best(direct_sweep(rows, none, 1), tried)
    edges = complete_edges(rows, alone.fit, bits=True)
    return _best(direct_sweep(rows, edges, 1), tried).fit


# --- lateral edges under a fixed posterior -----------------------------------------------------


def complete_edges(rows: Rows, fit: Fit, *, bits: bool) -> tuple[Inputs, ...]:
    """Return lateral inputs by greedy ascent of the completed data's marginal likelihood."""
    options = admissible(rows.data, rows.weights, rows.layout)
    inputs: list[Inputs] = [() for _ in options]
    base = [complete_score(rows, fit, g, ()) for g in range(len(options))]
    pairs = {(g, p) for g, table in enumerate(options) for p in table if bits or p >= 0}
    gains: dict[tuple[int, int], float] = {}
    while pairs:
        for g, p in pairs - set(gains):
            wider = tuple(sorted({*inputs[g], *options[g][p]}))
            gains[(g, p)] = complete_score(rows, fit, g, wider) - base[g]
        best = max(sorted(gains), key=lambda pair: gains[pair])
        gain = gains.pop(best)
        pairs.discard(best)
        if gain <= 0:
            break
        g, p = best
        wider = tuple(sorted({*inputs[g], *options[g][p]}))
        if acyclic((*inputs[:g], wider, *inputs[g + 1 :]), rows.layout):
            inputs[g], base[g] = wider, base[g] + gain
            gains = {pair: value for pair, value in gains.items() if pair[0] != g}
    return tuple(inputs)


def complete_score(rows: Rows, fit: Fit, g: int, inputs: Inputs) -> float:
    """Return the log marginal likelihood of group g's expected moments with these inputs."""
    family, clusters = fit.network.families[g], fit.posterior.clusters[g]
    return mixture.completed(rows.task(g), family, clusters, inputs)


# --- the plain mixture --------------------------------------------------------------------------


def gmm(rows: Rows, largest: int, tried: list[Tried]) -> Fit:
    """Return the mixture over all coordinates (rows of the merged layout), its size by MDL."""
    task = rows.task(0)
    fit = mixture.single(task, tied=True)
    best, best_length, worse = fit, _length(rows, fit), 0
    while len(fit.family.coef) < largest and worse < 2:
        tried.append(Tried(1, (len(fit.family.coef),), ((),), -_length(rows, fit)))
        fit = mixture.grow(task, fit)
        length = _length(rows, fit)
        worse = 0 if length < best_length else worse + 1
        if length < best_length:
            best, best_length = fit, length
    blank = direct_network(rows, np.ones((len(rows.data), 1)), (best.family,))
    network = replace(blank, families=(best.family,))
    return run(network, rows.data, rows.prior, weights=rows.weights)


def _length(rows: Rows, fit: Local) -> float:
    """Return the description length: −log likelihood + parameters/2 · log n."""
    clusters, d = fit.family.coef.shape[:2]
    free = clusters * (d + d * (d + 1) / 2) + clusters - 1
    return float(-fit.total + free / 2 * np.log(len(rows.data)))
