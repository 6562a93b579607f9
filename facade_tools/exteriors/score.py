"""The Cheeseman-Stutz score (FW16 eq. 2) and its parts.

log P(O*|G) + log P(O|G, Θ) − log P(O*|G, Θ), O* the expected complete data. Every part of the
network adds its own `marginal − complete`; only log P(O|G, Θ) needs them all.
"""

from __future__ import annotations

import numpy as np
from scipy.special import betaln

from .coordinates import Floats
from .dataset import Dataset
from .em import (
    Prior,
    Statistics,
    bit_pseudo_counts,
    posterior_moments,
    prior_precision,
    statistics,
    weighed_bits,
    whole,
    wishart_scale,
)
from .kernels_conjugate import dirichlet_part, log_completes, log_marginals
from .network import Family, Network, Pooled, Posterior, Weights, log_


def table_part(counts: Floats, p: Floats, strength: float) -> float:
    """Return log marginal minus log likelihood of expected counts (rows of tables).

    The marginal is under Dirichlet(1 + strength/m), whose mode `em.fit_table` takes.
    """
    m = counts.shape[-1]
    rows = np.ascontiguousarray(counts).reshape(-1, m)
    return dirichlet_part(rows, np.ascontiguousarray(p).reshape(-1, m), whole(m), strength)


def gaussian_part(stats: Statistics, family: Family, prior: Prior) -> float:
    """Return log marginal minus log likelihood of expected moments, all clusters."""
    if family.coef.shape[1] == 0:
        return 0.0
    marginal = log_marginal(stats, prior, family.pooled)
    return float((marginal - log_complete(stats, family)).sum()) - pooled_cost(stats, family.pooled)


def pooled_cost(stats: Statistics, pooled: Pooled | None) -> float:
    """Return what the pooled slopes cost, fitted to the same rows: log(rows)/2 each (BIC)."""
    if pooled is None:
        return 0.0
    rows = float(stats.uu[:, 0, 0].sum())
    return 0.5 * float(np.count_nonzero(pooled.coef[:, 1:])) * float(np.log(max(rows, 1.0)))


def log_marginal(stats: Statistics, prior: Prior, pooled: Pooled | None = None) -> Floats:
    """Return the log marginal likelihood (K,) under the matrix-normal inverse-Wishart prior."""
    d, width = stats.xu.shape[1:]
    after, _, scatter = posterior_moments(stats, prior, pooled)
    precision, scale = prior_precision(width, prior), wishart_scale(d, prior, pooled)
    rows = np.ascontiguousarray(stats.uu[:, 0, 0])
    return log_marginals(rows, after, scatter, precision, scale, d + prior.freedom)


def log_complete(stats: Statistics, family: Family) -> Floats:
    """Return the expected complete log likelihood (K,) of the moments."""
    return log_completes(stats.uu, stats.xu, stats.xx, family.coef, family.cov)


def family_part(stats: Statistics, family: Family, prior: Prior) -> float:
    """Return marginal minus complete of a family's Gaussians and atom tables."""
    total = gaussian_part(stats, family, prior)
    for counts, table in zip(stats.tables, family.tables, strict=True):
        if family.tied:
            total += table_part(counts.sum(axis=0), table[0], prior.table)
        else:
            total += table_part(counts, table, prior.table)
    return total


def bits_part(data: Dataset, weights: Weights, style: Floats, p: Floats, prior: Prior) -> float:
    """Return marginal minus complete of the bits given S."""
    one, zero = weighed_bits(data, weights)
    return beta_part(style.T @ one, style.T @ zero, p, bit_pseudo_counts(one, zero, prior))


def beta_part(one: Floats, zero: Floats, p: Floats, pseudo: Floats) -> float:
    """Return log marginal minus log likelihood of expected counts of bits (|S|, b).

    The marginal is under Beta(1 + pseudo), whose mode `em.beta_mode` takes.
    """
    a, b = 1 + pseudo
    marginal = betaln(a + one, b + zero) - betaln(a, b)
    return float((marginal - one * log_(p) - zero * log_(1 - p)).sum())


def cheeseman_stutz(
    network: Network, data: Dataset, weights: Weights, posterior: Posterior, prior: Prior
) -> float:
    """Return the score of a network at its parameters, from its own E-step, in nats."""
    total = float(weights.style @ posterior.log_density)
    total += table_part(weights.style @ posterior.style, network.style, prior.style)
    total += bits_part(data, weights, posterior.style, network.bits, prior)
    for g, family in enumerate(network.families):
        weight = posterior.clusters[g] * weights.groups[g][:, None]
        stats = statistics(family, data.groups[g], data.features, weight, posterior.joint[g])
        total += family_part(stats, family, prior)
        if not family.direct:
            total += table_part(posterior.joint[g], family.hidden, prior.hidden)
    return total
