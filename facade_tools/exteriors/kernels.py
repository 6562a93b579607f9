"""Compiled inner loops of EM: Gaussians given their parents, with unobserved coordinates.

Rows come sorted by pattern (which coordinates carry a density): `order` lists them, pattern p owns
`order[starts[p]:starts[p + 1]]` and `masks[p]`. The conditional mean of cluster k is
coef[k] @ (1, inputs). Scalar code, no fast-math: the same path on every machine.
"""

from __future__ import annotations

from math import log, pi

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Masks = NDArray[np.bool_]

LOG_2PI = log(2.0 * pi)
NEGLIGIBLE = 1e-9  # a responsibility below it adds nothing
LEAST_PROBABILITY = 1e-300
SMALL = 1e-140  # a product below it goes into the logarithm before it vanishes


@compiled
def cholesky(a: Floats, size: int) -> float:
    """Replace the lower triangle of a by its Cholesky factor; return log det a (nan: not p.d.)."""
    logdet = 0.0
    for i in range(size):
        for j in range(i + 1):
            total = a[i, j]
            for m in range(j):
                total -= a[i, m] * a[j, m]
            if i == j:
                if total <= 0.0:
                    return np.nan
                a[i, i] = np.sqrt(total)
                logdet += 2.0 * np.log(a[i, i])
            else:
                a[i, j] = total / a[j, j]
    return logdet


@compiled
def chosen(mask: Masks, out: Ints) -> int:
    """Write the indices of true entries to `out`; return how many."""
    count = 0
    for i in range(mask.shape[0]):
        if mask[i]:
            out[count] = i
            count += 1
    return count


@compiled
def residual(coef: Floats, z: Floats, x: Floats, index: Ints, size: int, out: Floats) -> None:
    """Write x − coef @ (1, z) of the chosen coordinates to `out`."""
    for a in range(size):
        i = index[a]
        mean = coef[i, 0]
        for q in range(z.shape[0]):
            mean += coef[i, q + 1] * z[q]
        out[a] = x[i] - mean


@compiled
def solve_lower(factor: Floats, size: int, v: Floats) -> None:
    """Replace v by L⁻¹ v."""
    for i in range(size):
        total = v[i]
        for j in range(i):
            total -= factor[i, j] * v[j]
        v[i] = total / factor[i, i]


@compiled
def solve_upper(factor: Floats, size: int, v: Floats) -> None:
    """Replace v by L⁻ᵀ v."""
    for i in range(size - 1, -1, -1):
        total = v[i]
        for j in range(i + 1, size):
            total -= factor[j, i] * v[j]
        v[i] = total / factor[i, i]


@compiled
def whiten(
    factor: Floats, coef: Floats, index: Ints, size: int, inverse: Floats, slopes: Floats
) -> None:
    """Write L⁻¹ (lower triangle) and L⁻¹ coef of the chosen coordinates."""
    for j in range(size):
        inverse[j, j] = 1.0 / factor[j, j]
        for i in range(j + 1, size):
            total = 0.0
            for m in range(j, i):
                total += factor[i, m] * inverse[m, j]
            inverse[i, j] = -total / factor[i, i]
    for a in range(size):
        for q in range(coef.shape[1]):
            slopes[a, q] = 0.0
            for b in range(a + 1):
                slopes[a, q] += inverse[a, b] * coef[index[b], q]


@compiled
def gaussian(
    x: Floats, z: Floats, order: Ints, starts: Ints, masks: Masks, coef: Floats, cov: Floats
) -> Floats:
    """Return log N(x observed | coef[k] (1, z), cov[k]): (n, K); rows without any give 0."""
    clusters, d, width = coef.shape
    out = np.zeros((x.shape[0], clusters))
    index = np.empty(d, np.int64)
    factor, inverse, slopes = np.empty((d, d)), np.empty((d, d)), np.empty((d, width))
    for p in range(masks.shape[0]):
        size = chosen(masks[p], index)
        if size == 0:
            continue
        for k in range(clusters):
            for a in range(size):
                for b in range(size):
                    factor[a, b] = cov[k, index[a], index[b]]
            constant = -0.5 * (cholesky(factor, size) + size * LOG_2PI)
            whiten(factor, coef[k], index, size, inverse, slopes)
            for r in range(starts[p], starts[p + 1]):
                n = order[r]
                total = 0.0
                for a in range(size):
                    v = -slopes[a, 0]
                    for q in range(1, width):
                        v -= slopes[a, q] * z[n, q - 1]
                    for b in range(a + 1):
                        v += inverse[a, b] * x[n, index[b]]
                    total += v * v
                out[n, k] = constant - 0.5 * total
    return out


@compiled
def fill_mean(
    cov: Floats, factor: Floats, mask: Masks, index: Ints, size: int, v: Floats, out: Floats
) -> None:
    """Write E[residual of every coordinate | residuals v of the observed ones] to `out`.

    v is overwritten by cov_oo⁻¹ v.
    """
    d = mask.shape[0]
    for a in range(size):
        out[index[a]] = v[a]
    solve_lower(factor, size, v)
    solve_upper(factor, size, v)
    for i in range(d):
        if not mask[i]:
            total = 0.0
            for a in range(size):
                total += cov[i, index[a]] * v[a]
            out[i] = total


@compiled
def spread(cov: Floats, factor: Floats, mask: Masks, index: Ints, size: int, out: Floats) -> None:
    """Write the covariance of the unobserved coordinates given the observed ones to `out`."""
    d = mask.shape[0]
    out[:] = 0.0
    half = np.empty((d, size))
    for i in range(d):
        if not mask[i]:
            for a in range(size):
                half[i, a] = cov[i, index[a]]
            solve_lower(factor, size, half[i])
    for i in range(d):
        for j in range(d):
            if not mask[i] and not mask[j]:
                total = cov[i, j]
                for a in range(size):
                    total -= half[i, a] * half[j, a]
                out[i, j] = total


@compiled
def mirror(a: Floats) -> None:
    """Copy the lower triangle to the upper one."""
    for i in range(len(a)):
        for j in range(i):
            a[j, i] = a[i, j]


@compiled
def moments(  # noqa: C901 - one pass over the rows, compiled
    x: Floats,
    z: Floats,
    order: Ints,
    starts: Ints,
    masks: Masks,
    coef: Floats,
    cov: Floats,
    weight: Floats,
) -> tuple[Floats, Floats, Floats]:
    """Return expected moments a cluster, weighted by weight (n, K).

    Σ w u uᵀ (K, 1+q, 1+q) with u = (1, z); Σ w E[x] uᵀ (K, d, 1+q); Σ w E[x xᵀ] (K, d, d).
    Rows that observe no coordinate are left out: they say nothing.
    """
    clusters, d, width = coef.shape
    uu = np.zeros((clusters, width, width))
    xu = np.zeros((clusters, d, width))
    xx = np.zeros((clusters, d, d))
    index = np.empty(d, np.int64)
    factor = np.empty((d, d))
    extra = np.empty((d, d))
    v = np.empty(d)
    full = np.empty(d)
    u = np.ones(width)
    for p in range(masks.shape[0]):
        size = chosen(masks[p], index)
        if size == 0:
            continue
        for k in range(clusters):
            for a in range(size):
                for b in range(size):
                    factor[a, b] = cov[k, index[a], index[b]]
            if size < d:
                cholesky(factor, size)
                spread(cov[k], factor, masks[p], index, size, extra)
            mass = 0.0
            for r in range(starts[p], starts[p + 1]):
                n = order[r]
                w = weight[n, k]
                if w < NEGLIGIBLE:
                    continue
                mass += w
                for q in range(1, width):
                    u[q] = z[n, q - 1]
                if size == d:
                    for i in range(d):
                        full[i] = x[n, i]
                else:
                    residual(coef[k], z[n], x[n], index, size, v)
                    fill_mean(cov[k], factor, masks[p], index, size, v, full)
                    for i in range(d):
                        for q in range(width):
                            full[i] += coef[k, i, q] * u[q]
                for q in range(width):
                    part = w * u[q]
                    for m in range(q + 1):
                        uu[k, q, m] += part * u[m]
                for i in range(d):
                    part = w * full[i]
                    for q in range(width):
                        xu[k, i, q] += part * u[q]
                    for j in range(i + 1):
                        xx[k, i, j] += part * full[j]
            if size < d:
                xx[k] += mass * extra
    for k in range(clusters):
        mirror(uu[k])
        mirror(xx[k])
    return uu, xu, xx


# --- between S and the hidden variables --------------------------------------------------------


@compiled
def message(local: Floats, hidden: Floats, logs: Floats, product: Floats) -> tuple[Floats, Floats]:
    """Sum the hidden variable out of local log densities (n, K) under P(H | S) (|S|, K).

    Returned: likelihood (n, K), scaled to 1 at the top; its mass (n, |S|) under each style. The
    group's density given S joins logs + ln(product), (n, |S|) each: one logarithm for many groups.
    """
    rows, clusters = local.shape
    likelihood = np.empty((rows, clusters))
    mass = np.zeros((rows, hidden.shape[0]))
    wide = hidden.T.copy()
    for n in range(rows):
        top = local[n].max()
        for k in range(clusters):
            likely, table = np.exp(local[n, k] - top), wide[k]
            likelihood[n, k] = likely
            for s in range(hidden.shape[0]):
                mass[n, s] += table[s] * likely
        for s in range(hidden.shape[0]):
            mass[n, s] = max(mass[n, s], LEAST_PROBABILITY)
            logs[n, s] += top
            if mass[n, s] < SMALL:
                logs[n, s] += np.log(mass[n, s])
            else:
                product[n, s] *= mass[n, s]
                if product[n, s] < SMALL:
                    logs[n, s] += np.log(product[n, s])
                    product[n, s] = 1.0
    return likelihood, mass


@compiled
def downward(
    likelihood: Floats, mass: Floats, hidden: Floats, style: Floats, weight: Floats
) -> tuple[Floats, Floats]:
    """Return P(H | row) (n, K) and Σ weight · P(S, H | row) (|S|, K) from P(S | row) (n, |S|)."""
    rows, clusters = likelihood.shape
    out, joint = np.empty((rows, clusters)), np.zeros(hidden.shape)
    share = np.empty(clusters)
    for n in range(rows):
        share[:] = 0.0
        for s in range(hidden.shape[0]):
            part = style[n, s] / mass[n, s]
            for k in range(clusters):
                share[k] += part * hidden[s, k]
                joint[s, k] += part * weight[n] * likelihood[n, k]
        for k in range(clusters):
            out[n, k] = likelihood[n, k] * share[k]
    return out, joint * hidden
