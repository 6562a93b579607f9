"""The last steps of the search: edges and sizes judged after EM of the whole network.

Families fitted one by one (`structure_search`) rank configurations quickly, but an edge that makes
up for a family's poor fit looks needed. Here every proposal goes through EM together and is judged
by its own Cheeseman-Stutz score.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from . import mixture
from .em import NOTHING, Fit, Stop, fit_bits, fit_table, run
from .lateral import Inputs, acyclic, admissible, crowded, parent_of
from .network import Network, inputs_of
from .score import cheeseman_stutz
from .structure_search import Search, Tried
from .styles import cut as cut_style

TOGETHER = Stop(relative=1e-5, iterations=40)
TRIAL = Stop(relative=1e-5, iterations=8)
HOPE = 15.0  # nats by which a proposal may be worse after its trial
PROPOSALS = 3  # of a group that are tried before it is left alone
CLEAR = 3.0  # standard errors from which a correlation counts
DOUBT = 50.0  # nats by which a proposal may look worse before EM has adapted to it


@dataclass(frozen=True, slots=True)
class Joint:
    """A network after EM together, and its score."""

    fit: Fit
    score: float


def joint(search: Search, network: Network, stop: Stop = TOGETHER) -> Joint:
    """Return a network after EM together; the configuration counts as tried."""
    fit = run(network, search.data, search.prior, weights=search.weights, stop=stop)
    score = cheeseman_stutz(fit.network, search.data, search.weights, fit.posterior, search.prior)
    families = fit.network.families
    sizes = tuple(len(family.coef) for family in families)
    inputs = tuple(family.inputs for family in families)
    search.tried.append(Tried(len(fit.network.style), sizes, inputs, score))
    return Joint(fit, score)


def trial(search: Search, network: Network, best: Joint) -> Joint:
    """Return a network after a few iterations together; after all where there is hope."""
    after = joint(search, network, TRIAL)
    if after.score < best.score - HOPE:
        return after
    return joint(search, after.fit.network)


def settled_together(search: Search, network: Network) -> Joint:
    """Change edges (where allowed), sizes and styles while the score after EM together rises."""
    best = joint(search, network)
    failed: set[tuple[int, Inputs]] = set()
    while True:
        if search.limits.lateral:
            best = settled_edges(search, best, failed)
        grown = settled_styles(search, settled_sizes(search, best))
        if grown is best:
            return best
        pairs = zip(grown.fit.network.families, best.fit.network.families, strict=True)
        resized = {g for g, (a, b) in enumerate(pairs) if len(a.coef) != len(b.coef)}
        failed = {(g, inputs) for g, inputs in failed if g not in resized}
        best = grown


def settled_edges(search: Search, best: Joint, failed: set[tuple[int, Inputs]]) -> Joint:
    """Add and drop single lateral edges while the score rises; `failed` takes what did not help.

    A group with too few clusters borrows an edge that tells them apart: one that cannot be dropped
    may be with a cluster more.
    """
    options = admissible(search.data, search.weights, search.layout)
    while True:
        for g, inputs in promising(search, best.fit, options, failed):
            after = trial(search, proposed(search, best.fit, g, inputs), best)
            if len(inputs) < len(best.fit.network.families[g].inputs) and after.score < best.score:
                after = grown(search, after, g)
            if after.score > best.score:
                best = after
                break
            failed.add((g, inputs))
        else:
            return best


def settled_sizes(search: Search, best: Joint) -> Joint:
    """Cut a cluster of each group in turn where that raises the score."""
    for g in range(len(search.layout.groups)):
        best = grown(search, best, g)
    return best


def settled_styles(search: Search, best: Joint) -> Joint:
    """Cut a style in two, the one that gains most, while that raises the score."""
    while len(best.fit.network.style) < search.limits.largest:
        cuts = [restyled(search, best.fit, s) for s in range(len(best.fit.network.style))]
        after = max((trial(search, one, best) for one in cuts), key=lambda one: one.score)
        if after.score <= best.score:
            return best
        best = after
    return best


def restyled(search: Search, fit: Fit, s: int) -> Network:
    """Return the network with style s cut across the direction in which its rows differ most."""
    weights, prior, data = search.weights, search.prior, search.data
    look = np.concatenate([*fit.posterior.clusters, np.maximum(data.bits, 0)], axis=1)
    style = cut_style(fit.posterior.style, look, weights.style, s)
    families = tuple(
        replace(family, hidden=fit_table((style * w[:, None]).T @ clusters, prior.hidden))
        for family, w, clusters in zip(
            fit.network.families, weights.groups, fit.posterior.clusters, strict=True
        )
    )
    share = fit_table(weights.style @ style, prior.style)
    bits = fit_bits(data, weights, style, prior)
    return replace(fit.network, style=share, bits=bits, families=families)


def grown(search: Search, best: Joint, g: int) -> Joint:
    """Return the network with a cluster more in group g if its score is higher."""
    if len(best.fit.network.families[g].coef) >= search.limits.largest:
        return best
    after = trial(search, cut(search, best.fit, g), best)
    return after if after.score > best.score else best


def cut(search: Search, fit: Fit, g: int) -> Network:
    """Return the network with the cluster of group g that foresees its rows worst cut in two."""
    task, family, clusters = search.task(g), fit.network.families[g], fit.posterior.clusters[g]
    local = mixture.evaluate(
        task, replace(family, hidden=(fit.network.style @ family.hidden)[None])
    )
    cost = -(task.weight[:, None] * clusters * local.local).sum(axis=0)
    worst = int(np.argmax(cost))
    halves = mixture.split(task, family, clusters, worst)
    fresh = mixture.refit(task, family, halves)
    shares = task.weight @ halves[:, -2:]
    last = family.hidden[:, [worst]] * (shares / shares.sum())
    hidden = np.concatenate([np.delete(family.hidden, worst, axis=1), last], axis=1)
    families = list(fit.network.families)
    families[g] = replace(fresh, hidden=hidden)
    return replace(fit.network, families=tuple(families))


def promising(
    search: Search, fit: Fit, options: list[dict[int, Inputs]], failed: set[tuple[int, Inputs]]
) -> Iterator[tuple[int, Inputs]]:
    """Yield the best `PROPOSALS` changes of each group that have not failed, best first."""
    tried = [0] * len(options)
    for g, inputs in ranked(search, fit, options):
        if (g, inputs) not in failed and tried[g] < PROPOSALS:
            tried[g] += 1
            yield g, inputs


def ranked(search: Search, fit: Fit, options: list[dict[int, Inputs]]) -> list[tuple[int, Inputs]]:
    """Return child and new inputs of promising changes, best first.

    Judged by the completed data's marginal likelihood under the posterior as it stands.
    """
    gains = []
    for g, table in enumerate(options):
        changes = list(changed(search, fit, g, table))
        if changes:
            task, family = search.task(g), fit.network.families[g]
            now, *after = (
                mixture.completed(task, family, fit.posterior.clusters[g], inputs)
                for inputs in (family.inputs, *changes)
            )
            gains += [
                (value - now, g, inputs) for value, inputs in zip(after, changes, strict=True)
            ]
    return [(g, inputs) for gain, g, inputs in sorted(gains, reverse=True) if gain > -DOUBT]


def changed(search: Search, fit: Fit, g: int, table: dict[int, Inputs]) -> Iterator[Inputs]:
    """Yield inputs of group g with a parent or a feature less, or a parent more.

    A parent shows all that it can, only the features that tell something, or the one of them that
    tells most.
    """
    owners = parent_of(search.layout)
    all_inputs = [family.inputs for family in fit.network.families]
    now = all_inputs[g]
    smaller = {tuple(f for f in now if owners[f] != parent) for parent in {owners[f] for f in now}}
    yield from sorted(smaller | {tuple(f for f in now if f != one) for one in now})
    z = telling(search, fit, g) if table else {}
    for parent, features in sorted(table.items()):
        clear = [f for f in features if f in z and f not in now]
        most = sorted(clear, key=lambda f: -z[f])[:1]
        shown = {tuple(sorted({*now, *some})) for some in (features, clear, most)}
        for wider in sorted(shown - {now}) if parent >= 0 else ():
            after = (*all_inputs[:g], wider, *all_inputs[g + 1 :])
            if acyclic(after, search.layout) and not crowded(wider, search.data.groups[g]):
                yield wider


def telling(search: Search, fit: Fit, g: int) -> dict[int, float]:
    """Return the features that go with what group g's clusters leave over, and |r| √n > `CLEAR`."""
    family, data, features = fit.network.families[g], search.data.groups[g], search.data.features
    u = np.column_stack([np.ones(len(features)), inputs_of(family, features)])
    mean = np.einsum("nk,kdq,nq->nd", fit.posterior.clusters[g], family.coef, u, optimize=True)
    rest = np.where(data.dense, data.x - mean, 0.0)
    most = np.zeros(features.shape[1])
    for i in range(rest.shape[1]):
        rows = data.dense[:, i] & (search.weights.groups[g] > 0)
        if rows.sum() > 2:
            shown = features[rows] - features[rows].mean(axis=0)
            size = np.sqrt((shown**2).sum(axis=0) * (rest[rows, i] ** 2).sum()) + NOTHING
            most = np.maximum(most, np.abs(rest[rows, i] @ shown) / size * np.sqrt(rows.sum()))
    return {int(f): float(most[f]) for f in np.flatnonzero(most > CLEAR)}


def proposed(search: Search, fit: Fit, g: int, inputs: Inputs) -> Network:
    """Return the network after an M-step of group g with these inputs."""
    task, family = search.task(g), fit.network.families[g]
    fresh = mixture.refit(task, mixture.reshaped(task, family, inputs), fit.posterior.clusters[g])
    families = list(fit.network.families)
    families[g] = replace(fresh, hidden=family.hidden)
    return replace(fit.network, families=tuple(families))
