"""One group's family fitted by itself: a mixture of conditional Gaussians with atoms.

The structure search fits every (group, cardinality, lateral parents) once, each warm from the one
with a cluster less, and reuses it under every cardinality of S (docs/learn.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .coordinates import Floats
from .dataset import Dataset, Scaling, floors
from .em import NOTHING, Prior, maximise, statistics
from .kernels_conjugate import clear_regression
from .layout import GroupLayout
from .network import Family, Pooled, empty_family, inputs_of, local_log_density, log_, log_sum
from .score import log_marginal, pooled_cost
from .styles import longest

CANDIDATES = 3  # clusters that are tried for a split
TRIAL = 4  # iterations of each trial
ROUNDS = 60  # at most, with one cluster more or less
CLEAR = 3.0  # standard errors from which a pooled slope counts
LEAST_ROWS = 2.0  # a cluster lighter than this is not split


@dataclass(frozen=True, slots=True)
class Task:
    """One group of a dataset, its row weights and priors."""

    data: Dataset
    group: int
    layout: GroupLayout
    scaling: Scaling
    weight: Floats
    prior: Prior


@dataclass(frozen=True, slots=True)
class Local:
    """A fitted family with |S| = 1; local: log P(group | H) (n, K); score: mean objective."""

    family: Family
    local: Floats
    log_density: Floats
    total: float

    @property
    def clusters(self) -> Floats:
        """Return P(H | group) (n, K)."""
        joint = self.local + log_(self.family.hidden[0])
        return np.asarray(np.exp(joint - self.log_density[:, None]))


def evaluate(task: Task, family: Family) -> Local:
    """Return densities of a family's rows."""
    local = local_log_density(family, task.data.groups[task.group], task.data.features)
    density = log_sum(local + log_(family.hidden[0]))
    return Local(family, local, density, float(task.weight @ density))


def refit(task: Task, family: Family, clusters: Floats) -> Family:
    """Return the family after an M-step from cluster probabilities (n, K).

    The family's own coef and cov fill in unobserved coordinates; a family of another size is
    replaced by one that knows nothing.
    """
    if len(family.coef) != clusters.shape[1]:
        fresh = empty_family(task.layout, 1, clusters.shape[1])
        family = replace(reshaped(task, fresh, family.inputs), tied=family.tied)
    weight = clusters * task.weight[:, None]
    data = task.data.groups[task.group]
    hidden = weight.sum(axis=0)[None]
    stats = statistics(family, data, task.data.features, weight, hidden)
    dense = np.maximum(stats.uu[:, 0, 0], NOTHING)
    mean = stats.xu[:, :, 0] / dense[:, None]
    return maximise(family, stats, floors(mean, task.layout, task.scaling), task.prior)


def improve(task: Task, start: Local, iterations: int, tolerance: float = 1e-5) -> Local:
    """Run EM from a fit until the log likelihood changes little, relatively."""
    fit = start
    for _ in range(iterations):
        after = evaluate(task, refit(task, fit.family, fit.clusters))
        done = abs(after.total - fit.total) <= tolerance * abs(after.total)
        fit = after
        if done:
            break
    return fit


def reshaped(task: Task, family: Family, inputs: tuple[int, ...]) -> Family:
    """Return the family with other lateral inputs, their slopes 0."""
    clusters, d = family.coef.shape[:2]
    coef = np.zeros((clusters, d, 1 + len(inputs)))
    coef[:, :, 0] = family.coef[:, :, 0]
    return replace(family, inputs=inputs, coef=coef, pooled=regression(task, inputs))


def regression(task: Task, inputs: tuple[int, ...]) -> Pooled | None:
    """Return the regression of every coordinate on the inputs, over the rows that observe it.

    Slopes that are not clear (|t| below `CLEAR`) are 0.
    """
    if not inputs:
        return None
    data = task.data.groups[task.group]
    u = np.ascontiguousarray(np.column_stack([np.ones(len(data.x)), task.data.features[:, inputs]]))
    weight = np.ascontiguousarray(task.weight[:, None] * data.dense)
    return Pooled(*clear_regression(data.x, u, weight, CLEAR))


def completed(task: Task, family: Family, clusters: Floats, inputs: tuple[int, ...]) -> float:
    """Return the log marginal likelihood of the group's expected moments with lateral inputs."""
    other = reshaped(task, family, inputs)
    weight = clusters * task.weight[:, None]
    data, features = task.data.groups[task.group], task.data.features
    stats = statistics(other, data, features, weight, weight.sum(axis=0)[None])
    return float(log_marginal(stats, task.prior, other.pooled).sum()) - pooled_cost(
        stats, other.pooled
    )


def single(task: Task, inputs: tuple[int, ...] = (), *, tied: bool = False) -> Local:
    """Return the fit with one cluster."""
    family = reshaped(task, empty_family(task.layout, 1, 1), inputs)
    family = replace(family, tied=tied)
    return improve(task, evaluate(task, family), 20)


def grow(task: Task, fit: Local, iterations: int = ROUNDS) -> Local:
    """Return the fit with one cluster more: the best split of a heavy cluster, then EM."""
    clusters = fit.clusters
    mass = task.weight @ clusters
    cost = -(task.weight[:, None] * clusters * fit.local).sum(axis=0)
    heavy = [k for k in np.argsort(-cost - mass) if mass[k] > LEAST_ROWS][:CANDIDATES]
    if not heavy:
        heavy = [int(np.argmax(mass))]
    trials = [_trial(task, fit, split(task, fit.family, clusters, int(k))) for k in heavy]
    best = max(trials, key=lambda trial: trial.total)
    return improve(task, best, iterations)


def shrink(task: Task, fit: Local) -> Local:
    """Return the fit with one cluster less: the lightest gives its rows to the others."""
    clusters = fit.clusters
    lightest = int(np.argmin(task.weight @ clusters))
    rest = np.delete(clusters, lightest, axis=1) + NOTHING
    rest = rest / rest.sum(axis=1, keepdims=True)
    return improve(task, evaluate(task, refit(task, fit.family, rest)), ROUNDS)


def _trial(task: Task, fit: Local, clusters: Floats) -> Local:
    family = refit(task, fit.family, clusters)
    return improve(task, evaluate(task, family), TRIAL)


def split(task: Task, family: Family, clusters: Floats, k: int) -> Floats:
    """Return cluster probabilities with cluster k cut across its longest direction.

    What its lateral parents explain does not count: two clusters differ in what they leave over.
    """
    shown = appearance(task)
    d = family.coef.shape[1]
    explained = inputs_of(family, task.data.features) @ family.coef[k, :, 1:].T
    shown[:, :d] -= np.where(task.data.groups[task.group].dense, explained, 0.0)
    w = clusters[:, k] * task.weight
    mean = w @ shown / max(float(w.sum()), NOTHING)
    centred = shown - mean
    side = centred @ longest(centred, w) > 0
    first, second = clusters[:, k] * side, clusters[:, k] * ~side
    blend = 0.1 * clusters[:, k]  # both halves keep a little of everything
    out = np.delete(clusters, k, axis=1)
    halves = np.stack([0.8 * first + blend, 0.8 * second + blend], axis=1)
    return np.concatenate([out, halves], axis=1)


def appearance(task: Task) -> Floats:
    """Return what can tell rows of the group apart: coordinates and states (n, m)."""
    data = task.data.groups[task.group]
    states = [
        (data.states[:, c] == s).astype(np.float64)
        for c, channel in enumerate(task.layout.channels)
        for s in range(1, len(channel.states))
    ]
    columns = [*data.x.T, *(2.0 * s for s in states)]
    return np.stack(columns, axis=1) if columns else np.zeros((len(data.x), 1))
