"""MAP-EM for the network (FW16 5.3): Dirichlet and normal-Wishart priors, unobserved handled.

One M-step maximises exactly the expected log posterior under the constraint that no direction has
less than the least standard deviation, so that the objective never falls.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .coordinates import Floats
from .dataset import Dataset, GroupData, floors
from .kernels import Ints, moments
from .kernels_conjugate import (
    clipped,
    fitted_tables,
    log_normal_wishart,
    log_total,
    regressed,
    state_counts,
)
from .network import Family, Network, Pooled, Posterior, Weights, infer, inputs_of, log_

NOTHING = 1e-9


@dataclass(frozen=True, slots=True)
class Prior:
    """Strength of the priors, in rows of data.

    style, hidden, table: Dirichlet pseudo-counts, spread evenly over the states (hidden: over the
    group's own cluster shares). bit: Beta pseudo-counts, spread as the bit is over all rows: where
    few rows know it, its styles would otherwise all move towards one half. mean: of cluster means
    around the overall mean. slope: of lateral coefficients around 0. spread, freedom: Wishart on
    the precision with d + freedom degrees; the covariance is expected near (d + freedom) · `spread`
    of the overall variance. With lateral parents, overall means what the regression of all rows on
    them says (`Pooled`).
    """

    style: float = 1.0
    hidden: float = 1.0
    table: float = 1.0
    bit: float = 1.0
    mean: float = 0.05
    slope: float = 1.0
    spread: float = 0.06
    freedom: float = 2.0


def unit_weights(data: Dataset) -> Weights:
    """Return weights of one."""
    one = np.ones(len(data))
    return Weights(one, tuple(one for _ in data.groups), np.ones(data.bits.shape))


@dataclass(frozen=True, slots=True)
class Statistics:
    """Expected moments of one family (`kernels.moments`), its tables and hidden counts."""

    uu: Floats
    xu: Floats
    xx: Floats
    tables: tuple[Floats, ...]
    hidden: Floats


# --- M-step -------------------------------------------------------------------------------------


def prior_precision(width: int, prior: Prior) -> Floats:
    """Return the diagonal of the prior precision of (intercept, slopes)."""
    precision = np.full(width, prior.slope)
    precision[0] = prior.mean
    return precision


def fit_gaussian(
    stats: Statistics, floor: Floats, prior: Prior, pooled: Pooled | None = None
) -> tuple[Floats, Floats]:
    """Return the MAP coef (K, d, 1+q) and cov (K, d, d) from expected moments.

    floor (K, d): no direction gets a smaller standard deviation, measured against it.
    """
    _, coef, scatter = posterior_moments(stats, prior, pooled)
    return coef, clipped(scatter, stats.uu[:, 0, 0] + _power(stats.uu.shape[1], prior), floor)


def posterior_moments(
    stats: Statistics, prior: Prior, pooled: Pooled | None
) -> tuple[Floats, Floats, Floats]:
    """Return log det of u's posterior precision (K,), coef (K, d, 1+q) and scatter (K, d, d)."""
    d, width = stats.xu.shape[1:]
    precision, mean = prior_precision(width, prior), prior_mean(d, width, pooled)
    scale = wishart_scale(d, prior, pooled)
    return regressed(stats.uu, stats.xu, stats.xx, mean, precision, scale)


def prior_mean(d: int, width: int, pooled: Pooled | None) -> Floats:
    """Return the prior mean (d, 1+q) of (intercept, slopes)."""
    return np.zeros((d, width)) if pooled is None else pooled.coef


def _power(width: int, prior: Prior) -> float:
    """Return the power of |precision|^(1/2) in the prior: the mode is that of the precision."""
    return prior.freedom - 1 + width


def wishart_scale(d: int, prior: Prior, pooled: Pooled | None = None) -> Floats:
    """Return the diagonal of the scale of the inverse Wishart prior, (d,)."""
    spread = np.ones(d) if pooled is None else pooled.spread
    return np.asarray(spread * prior.spread * (d + prior.freedom))


def fit_table(counts: Floats, strength: float) -> Floats:
    """Return MAP probabilities (rows) under a Dirichlet of `strength` pseudo-counts a row."""
    rows = np.ascontiguousarray(counts).reshape(-1, counts.shape[-1])
    return fitted_tables(rows, whole(counts.shape[-1]), strength).reshape(counts.shape)


def whole(width: int) -> Ints:
    """Return where the tables of `kernels_conjugate` start when there is one of this width."""
    return np.array([0, width])


def statistics(
    family: Family, data: GroupData, features: Floats, weight: Floats, hidden: Floats
) -> Statistics:
    """Return expected moments under cluster weights (n, K)."""
    z = inputs_of(family, features)
    weight = np.ascontiguousarray(weight)
    uu, xu, xx = moments(
        data.x, z, data.order, data.starts, data.masks, family.coef, family.cov, weight
    )
    tables = tuple(
        state_counts(data.states, c, weight, t.shape[1]) for c, t in enumerate(family.tables)
    )
    return Statistics(uu, xu, xx, tables, hidden)


def maximise(family: Family, stats: Statistics, floor: Floats, prior: Prior) -> Family:
    """Return the family at the maximum of its part of the expected log posterior."""
    coef, cov = fit_gaussian(stats, floor, prior, family.pooled)
    tables = tuple(_atoms(t, family.tied, prior) for t in stats.tables)
    hidden = family.hidden if family.direct else fit_table(stats.hidden, prior.hidden)
    return replace(family, hidden=hidden, tables=tables, coef=coef, cov=cov)


def _atoms(counts: Floats, tied: bool, prior: Prior) -> Floats:
    if not tied:
        return fit_table(counts, prior.table)
    return np.tile(fit_table(counts.sum(axis=0), prior.table), (len(counts), 1))


# --- prior density ------------------------------------------------------------------------------


def log_prior(network: Network, prior: Prior, pseudo: Floats) -> float:
    """Return the log prior density of all parameters, up to a constant of the structure.

    pseudo (2, b): as `bit_pseudo_counts` gives them.
    """
    total = _log_dirichlet(network.style[None], prior.style)
    total += float((pseudo[0] * log_(network.bits) + pseudo[1] * log_(1 - network.bits)).sum())
    for family in network.families:
        if not family.direct:
            total += _log_dirichlet(family.hidden, prior.hidden)
        shown = [t[:1] if family.tied else t for t in family.tables]
        total += sum(_log_dirichlet(t, prior.table) for t in shown)
        total += _log_normal_wishart(family, prior)
    return float(total)


def _log_dirichlet(p: Floats, strength: float) -> float:
    """Pseudo-counts c a state are the density Π p^c (the Dirichlet with parameters 1 + c)."""
    return float(strength / p.shape[-1] * log_total(p.reshape(-1, p.shape[-1])))


def _log_normal_wishart(family: Family, prior: Prior) -> float:
    d, width = family.coef.shape[1:]
    if d == 0:
        return 0.0
    precision, mean = prior_precision(width, prior), prior_mean(d, width, family.pooled)
    scale, power = wishart_scale(d, prior, family.pooled), _power(width, prior)
    return log_normal_wishart(family.coef, family.cov, mean, precision, scale, power)


# --- the loop -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Stop:
    """When EM ends: relative change of the objective, or (parameters) their largest change."""

    relative: float = 1e-5
    parameters: float | None = None
    iterations: int = 200


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted network, its objective after every iteration, and the last E-step."""

    network: Network
    trace: tuple[float, ...]
    posterior: Posterior


def cluster_floors(
    network: Network, data: Dataset, weights: Weights, posterior: Posterior
) -> tuple[Floats, ...]:
    """Return the least standard deviations (K, d) around each cluster's mean row."""
    out = []
    for g, family in enumerate(network.families):
        share = posterior.clusters[g] * weights.groups[g][:, None]
        share = share * data.groups[g].dense.any(axis=1, keepdims=True)
        center = share.T @ inputs_of(family, data.features)
        center /= np.maximum(share.sum(axis=0), NOTHING)[:, None]
        mean = family.coef[:, :, 0] + np.einsum("kdq,kq->kd", family.coef[:, :, 1:], center)
        out.append(floors(mean, network.layout.groups[g], network.scalings[g]))
    return tuple(out)


def step(
    network: Network,
    data: Dataset,
    weights: Weights,
    floor: tuple[Floats, ...],
    prior: Prior,
    posterior: Posterior,
) -> Network:
    """Return the network after one M-step from `posterior`, its own E-step."""
    families = []
    for g, family in enumerate(network.families):
        weight = posterior.clusters[g] * weights.groups[g][:, None]
        stats = statistics(family, data.groups[g], data.features, weight, posterior.joint[g])
        families.append(maximise(family, stats, floor[g], prior))
    style = fit_table(weights.style @ posterior.style, prior.style)
    bits = fit_bits(data, weights, posterior.style, prior)
    return replace(network, style=style, bits=bits, families=tuple(families))


def fit_bits(data: Dataset, weights: Weights, style: Floats, prior: Prior) -> Floats:
    """Return the MAP probability of each bit given S, (|S|, b)."""
    one, zero = weighed_bits(data, weights)
    pseudo = bit_pseudo_counts(one, zero, prior)
    return beta_mode(style.T @ one, style.T @ zero, pseudo)


def weighed_bits(data: Dataset, weights: Weights) -> tuple[Floats, Floats]:
    """Return the weights (n, b) of the rows in which a bit is 1, and of those in which it is 0."""
    return weights.bits * (data.bits == 1), weights.bits * (data.bits == 0)


def bit_pseudo_counts(one: Floats, zero: Floats, prior: Prior) -> Floats:
    """Return the pseudo-counts (2, b) of ones and zeros, one row's weight spread as all rows are.

    one, zero (n, b): weights of the rows in which a bit is 1, or 0. A bit has no share of 0 or 1:
    half a one and half a zero are added.
    """
    ones = one.sum(axis=0)
    share = (ones + 0.5) / (ones + zero.sum(axis=0) + 1.0)
    return prior.bit * np.stack([share, 1 - share])


def beta_mode(one: Floats, zero: Floats, pseudo: Floats) -> Floats:
    """Return the MAP probabilities (|S|, b) of counts (|S|, b)."""
    return np.asarray((one + pseudo[0]) / (one + zero + pseudo.sum(axis=0)))


def objective(
    network: Network, posterior: Posterior, weights: Weights, prior: Prior, pseudo: Floats
) -> float:
    """Return weighted log likelihood plus log prior."""
    return float(weights.style @ posterior.log_density) + log_prior(network, prior, pseudo)


def run(
    network: Network,
    data: Dataset,
    prior: Prior,
    *,
    weights: Weights | None = None,
    stop: Stop = Stop(),
    floor: tuple[Floats, ...] | None = None,
) -> Fit:
    """Run EM from `network`; the trace never falls under fixed floors and unit weights."""
    weights = weights or unit_weights(data)
    posterior = infer(network, data, weights)
    floor = floor or cluster_floors(network, data, weights, posterior)
    pseudo = bit_pseudo_counts(*weighed_bits(data, weights), prior)
    trace = [objective(network, posterior, weights, prior, pseudo)]
    for _ in range(stop.iterations):
        before = network
        network = step(network, data, weights, floor, prior, posterior)
        posterior = infer(network, data, weights)
        trace.append(objective(network, posterior, weights, prior, pseudo))
        if _settled(trace, before, network, stop):
            break
    return Fit(network, tuple(trace), posterior)


def _settled(trace: list[float], before: Network, after: Network, stop: Stop) -> bool:
    if stop.parameters is not None:
        return largest_change(before, after) < stop.parameters
    return abs(trace[-1] - trace[-2]) <= stop.relative * abs(trace[-1])


def largest_change(before: Network, after: Network) -> float:
    """Return the largest absolute change of any parameter."""
    return max(
        float(np.max(np.abs(a - b), initial=0.0))
        for a, b in zip(parameters(before), parameters(after), strict=True)
    )


def parameters(network: Network) -> list[Floats]:
    """Return all parameter arrays."""
    out = [network.style, network.bits]
    for family in network.families:
        out += [family.hidden, family.coef, family.cov, *family.tables]
    return out
