"""Compiled closed forms of the conjugate priors: normal-Wishart on Gaussians, Dirichlet on tables.

K clusters, d coordinates, u = (1, inputs) of width 1 + q. The prior precision of the coefficients
and the prior scale of the covariances are diagonal and come as vectors. Scalar code, no fast-math.
"""

from __future__ import annotations

from math import lgamma, log, pi

import numpy as np

from ..compiled import compiled
from .coordinates import Bits
from .kernels import (
    LEAST_PROBABILITY,
    LOG_2PI,
    Floats,
    Ints,
    cholesky,
    chosen,
    solve_lower,
    solve_upper,
)

LOG_PI = log(pi)


# --- Gaussians ----------------------------------------------------------------------------------


@compiled
def regressed(
    uu: Floats, xu: Floats, xx: Floats, mean: Floats, precision: Floats, scale: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return log det of the posterior precision of u (K,), coef (K, d, 1+q), scatter (K, d, d)."""
    clusters, d, width = xu.shape
    logdet = np.empty(clusters)
    coef = np.empty((clusters, d, width))
    scatter = np.empty((clusters, d, d))
    factor = np.empty((width, width))
    for k in range(clusters):
        factor[:] = uu[k]
        for q in range(width):
            factor[q, q] += precision[q]
        logdet[k] = cholesky(factor, width)
        for i in range(d):
            for q in range(width):
                coef[k, i, q] = xu[k, i, q] + mean[i, q] * precision[q]
            solve_lower(factor, width, coef[k, i])
        for i in range(d):
            for j in range(i + 1):
                total = (xx[k, i, j] + xx[k, j, i]) / 2
                for q in range(width):
                    total += mean[i, q] * precision[q] * mean[j, q]
                    total -= coef[k, i, q] * coef[k, j, q]
                scatter[k, i, j] = scatter[k, j, i] = total
            scatter[k, i, i] += scale[i]
        for i in range(d):
            solve_upper(factor, width, coef[k, i])
    return logdet, coef, scatter


@compiled
def clipped(scatter: Floats, total: Floats, floor: Floats) -> Floats:
    """Return scatter / total (K,), no direction with a deviation below the floor (K, d)."""
    clusters, d = floor.shape
    cov = np.empty((clusters, d, d))
    scaled, factor = np.empty((d, d)), np.empty((d, d))
    for k in range(clusters):
        for i in range(d):
            for j in range(d):
                scaled[i, j] = scatter[k, i, j] / total[k] / floor[k, i] / floor[k, j]
                factor[i, j] = scaled[i, j]
            factor[i, i] -= 1.0
        if not np.isfinite(cholesky(factor, d)):  # an eigenvalue of `scaled` is 1 or less
            values, vectors = np.linalg.eigh(scaled)
            for i in range(d):
                for j in range(d):
                    scaled[i, j] = 0.0
                    for m in range(d):
                        scaled[i, j] += vectors[i, m] * max(values[m], 1.0) * vectors[j, m]
        for i in range(d):
            for j in range(d):
                cov[k, i, j] = scaled[i, j] * floor[k, i] * floor[k, j]
    return cov


@compiled
def logdet_trace(cov: Floats, scatter: Floats) -> tuple[float, float]:
    """Return log det cov and the trace of cov⁻¹ scatter, (d, d) each."""
    d = len(cov)
    factor, v = cov.copy(), np.empty(d)
    logdet, trace = cholesky(factor, d), 0.0
    for j in range(d):
        for i in range(d):
            v[i] = scatter[i, j]
        solve_lower(factor, d, v)
        solve_upper(factor, d, v)
        trace += v[j]
    return logdet, trace


@compiled
def log_completes(uu: Floats, xu: Floats, xx: Floats, coef: Floats, cov: Floats) -> Floats:
    """Return the expected complete log likelihood of moments under coef and cov, (K,)."""
    clusters, d, width = xu.shape
    out, scatter = np.empty(clusters), np.empty((d, d))
    for k in range(clusters):
        for i in range(d):
            for j in range(d):
                total = xx[k, i, j]
                for q in range(width):
                    total -= coef[k, i, q] * xu[k, j, q] + xu[k, i, q] * coef[k, j, q]
                    for m in range(width):
                        total += coef[k, i, q] * uu[k, q, m] * coef[k, j, m]
                scatter[i, j] = total
        logdet, trace = logdet_trace(cov[k], scatter)
        out[k] = -0.5 * (uu[k, 0, 0] * (d * LOG_2PI + logdet) + trace)
    return out


@compiled
def log_normal_wishart(
    coef: Floats, cov: Floats, mean: Floats, precision: Floats, scale: Floats, power: float
) -> float:
    """Return the log prior density of all clusters, up to a constant of the structure."""
    clusters, d, width = coef.shape
    scatter, total = np.empty((d, d)), 0.0
    for k in range(clusters):
        for i in range(d):
            for j in range(d):
                scatter[i, j] = scale[i] if i == j else 0.0
                for q in range(width):
                    off = coef[k, i, q] - mean[i, q]
                    scatter[i, j] += off * precision[q] * (coef[k, j, q] - mean[j, q])
        logdet, trace = logdet_trace(cov[k], scatter)
        total -= 0.5 * (power * logdet + trace)
    return total


@compiled
def log_multigamma(a: float, d: int) -> float:
    """Return the logarithm of the multivariate gamma function."""
    total = d * (d - 1) / 4 * LOG_PI
    for j in range(d):
        total += lgamma(a - j / 2)
    return total


@compiled
def log_marginals(
    rows: Floats,
    after: Floats,
    scatter: Floats,
    precision: Floats,
    scale: Floats,
    freedom: float,
) -> Floats:
    """Return the log marginal likelihood (K,) under the matrix-normal inverse-Wishart prior.

    rows (K,): weight of each cluster; after, scatter: log det and scatter of `regressed`.
    """
    d = len(scale)
    before = np.log(precision).sum()
    prior = 0.5 * freedom * np.log(scale).sum() - log_multigamma(freedom / 2, d)
    out = np.empty(len(rows))
    for k in range(len(rows)):
        factor = scatter[k].copy()
        power = freedom + rows[k]
        out[k] = prior - 0.5 * rows[k] * d * LOG_PI + 0.5 * d * (before - after[k])
        out[k] += log_multigamma(power / 2, d) - 0.5 * power * cholesky(factor, d)
    return out


@compiled
def least_squares(
    u: Floats, x: Floats, weight: Floats, index: Ints, size: int, coef: Floats, t: Floats
) -> float:
    """Write coefficients of the chosen columns of u, and their t values; return the variance left.

    One row of no effect joins the data (ridge).
    """
    a, b, v = np.zeros((size, size)), np.zeros(size), np.empty(size)
    mass = 1.0
    for n in range(len(x)):
        w = weight[n]
        if w != 0.0:
            mass += w
            for i in range(size):
                wu = w * u[n, index[i]]
                b[i] += wu * x[n]
                for j in range(i + 1):
                    a[i, j] += wu * u[n, index[j]]
    for i in range(size):
        a[i, i] += 1.0
    cholesky(a, size)
    solve_lower(a, size, b)
    solve_upper(a, size, b)
    left = 1.0
    for n in range(len(x)):
        if weight[n] != 0.0:
            rest = x[n]
            for i in range(size):
                rest -= u[n, index[i]] * b[i]
            left += weight[n] * rest * rest
    left /= mass
    for i in range(size):
        v[:] = 0.0
        v[i] = 1.0
        solve_lower(a, size, v)
        coef[index[i]] = b[i]
        t[index[i]] = b[i] / np.sqrt(left * (v * v).sum())
    return left


@compiled
def clear_regression(x: Floats, u: Floats, weight: Floats, clear: float) -> tuple[Floats, Floats]:
    """Return coef (d, 1+q) and variance left (d,) of x on u; weight (n, d).

    Slopes whose |t| is below `clear` are 0.
    """
    d, width = x.shape[1], u.shape[1]
    coef, spread = np.zeros((d, width)), np.empty(d)
    index, keep, t = np.empty(width, np.int64), np.empty(width, np.bool_), np.empty(width)
    for i in range(d):
        keep[:] = True
        size = chosen(keep, index)
        least_squares(u, x[:, i], weight[:, i], index, size, coef[i], t)
        for q in range(1, width):
            keep[q] = abs(t[q]) >= clear
        coef[i] = 0.0
        size = chosen(keep, index)
        spread[i] = least_squares(u, x[:, i], weight[:, i], index, size, coef[i], t)
    return coef, spread


# --- tables -------------------------------------------------------------------------------------


@compiled
def state_counts(states: Bits, c: int, weight: Floats, number: int) -> Floats:
    """Return the weight of each state of channel c in each cluster, (K, number).

    states (n, channels), −1 unobserved; weight (n, K).
    """
    out = np.zeros((weight.shape[1], number))
    for n in range(len(states)):
        if states[n, c] >= 0:
            for k in range(weight.shape[1]):
                out[k, states[n, c]] += weight[n, k]
    return out


@compiled
def add_states(out: Floats, states: Bits, c: int, table: Floats) -> None:
    """Add log P(state of channel c | H), table (K, states), to out (n, K) where observed."""
    logs = np.log(np.maximum(table, LEAST_PROBABILITY))
    for n in range(len(states)):
        if states[n, c] >= 0:
            for k in range(len(table)):
                out[n, k] += logs[k, states[n, c]]


@compiled
def fitted_tables(counts: Floats, starts: Ints, strength: float) -> Floats:
    """Return MAP probabilities of tables side by side (rows, Σ states): each one's row sums to 1.

    Table g owns columns starts[g]:starts[g + 1]; `strength` pseudo-counts a row of each.
    """
    out = np.empty(counts.shape)
    for r in range(counts.shape[0]):
        for g in range(len(starts) - 1):
            each = strength / (starts[g + 1] - starts[g])
            total = 0.0
            for c in range(starts[g], starts[g + 1]):
                total += counts[r, c] + each
            for c in range(starts[g], starts[g + 1]):
                out[r, c] = (counts[r, c] + each) / total
    return out


@compiled
def log_total(p: Floats) -> float:
    """Return Σ log p of a table (rows, states)."""
    total = 0.0
    for r in range(p.shape[0]):
        for c in range(p.shape[1]):
            total += np.log(max(p[r, c], LEAST_PROBABILITY))
    return total


@compiled
def dirichlet_part(counts: Floats, p: Floats, starts: Ints, strength: float) -> float:
    """Return log marginal minus log likelihood of expected counts, tables side by side.

    The marginal is under Dirichlet(1 + strength/m), whose mode `fitted_tables` takes.
    """
    total = 0.0
    for g in range(len(starts) - 1):
        m = starts[g + 1] - starts[g]
        alpha = 1.0 + strength / m
        constant = lgamma(m * alpha) - m * lgamma(alpha)
        for r in range(counts.shape[0]):
            mass = 0.0
            for c in range(starts[g], starts[g + 1]):
                mass += counts[r, c]
                total += lgamma(alpha + counts[r, c])
                total -= counts[r, c] * np.log(max(p[r, c], LEAST_PROBABILITY))
            total += constant - lgamma(m * alpha + mass)
    return total
