"""Compiled closed forms of the conjugate priors and of EM, against NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import gammaln, multigammaln

from facade_tools.exteriors import kernels, kernels_conjugate
from facade_tools.exteriors.kernels import downward, message, moments
from facade_tools.exteriors.kernels_conjugate import (
    add_states,
    clear_regression,
    clipped,
    dirichlet_part,
    fitted_tables,
    log_completes,
    log_marginals,
    log_normal_wishart,
    regressed,
    state_counts,
)

shapes = st.tuples(
    st.integers(1, 4), st.integers(1, 4), st.integers(1, 4), st.integers(0, 2**32 - 1)
)


def covariances(rng, clusters, d):
    a = rng.normal(size=(clusters, d, d + 2))
    return a @ a.swapaxes(1, 2) / d + 0.01 * np.eye(d)


def drawn_moments(rng, clusters, d, width):
    """Moments of 12 rows a cluster, and a prior."""
    u = rng.normal(size=(clusters, 12, width))
    u[:, :, 0] = 1.0
    x = rng.normal(size=(clusters, 12, d))
    found = u.swapaxes(1, 2) @ u, x.swapaxes(1, 2) @ u, x.swapaxes(1, 2) @ x
    return found, (rng.normal(size=(d, width)), rng.uniform(0.1, 2, width), rng.uniform(0.1, 2, d))


@settings(max_examples=30, deadline=None)
@given(shapes)
def test_regressed_and_its_densities_equal_numpy(case):
    clusters, d, width, seed = case
    rng = np.random.default_rng(seed)
    (uu, xu, xx), (mean, precision, scale) = drawn_moments(rng, clusters, d, width)
    p = np.diag(precision)
    a, right = uu + p, xu + mean @ p
    coef = np.linalg.solve(a, right.swapaxes(1, 2)).swapaxes(1, 2)
    scatter = np.diag(scale) + xx + mean @ p @ mean.T - coef @ a @ coef.swapaxes(1, 2)
    after, found, left = regressed(uu, xu, xx, mean, precision, scale)
    assert after == pytest.approx(np.linalg.slogdet(a)[1])
    np.testing.assert_allclose(found, coef, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(left, scatter, rtol=1e-8, atol=1e-9)

    freedom, rows = d + 1.5, uu[:, 0, 0].copy()
    power = freedom + rows
    expected = (
        -0.5 * rows * d * np.log(np.pi)
        + 0.5 * d * (np.log(precision).sum() - after)
        + 0.5 * freedom * np.log(scale).sum()
        - 0.5 * power * np.linalg.slogdet(scatter)[1]
        + multigammaln(power / 2, d)
        - multigammaln(freedom / 2, d)
    )
    given_prior = (precision, scale, freedom)
    assert log_marginals(rows, after, left, *given_prior) == pytest.approx(expected, rel=1e-8)

    cov = covariances(rng, clusters, d)
    cross = coef @ xu.swapaxes(1, 2)
    spread = xx - cross - cross.swapaxes(1, 2) + coef @ uu @ coef.swapaxes(1, 2)
    logdet = np.linalg.slogdet(cov)[1]
    trace = np.trace(np.linalg.solve(cov, spread), axis1=1, axis2=2)
    complete = -0.5 * (rows * (d * np.log(2 * np.pi) + logdet) + trace)
    assert log_completes(uu, xu, xx, coef, cov) == pytest.approx(complete, rel=1e-8)

    off = coef - mean
    spread = np.diag(scale) + off @ p @ off.swapaxes(1, 2)
    trace = np.trace(np.linalg.solve(cov, spread), axis1=1, axis2=2)
    wishart = -0.5 * (1.7 * logdet + trace).sum()
    assert log_normal_wishart(coef, cov, mean, precision, scale, 1.7) == pytest.approx(wishart)


@settings(max_examples=30, deadline=None)
@given(shapes)
def test_no_direction_is_narrower_than_the_floor(case):
    clusters, d, _, seed = case
    rng = np.random.default_rng(seed)
    scatter, total = covariances(rng, clusters, d), rng.uniform(0.5, 3, clusters)
    floor = rng.choice([1e-4, 0.3, 2.0], (clusters, d))
    scaled = scatter / total[:, None, None] / floor[:, :, None] / floor[:, None, :]
    values, vectors = np.linalg.eigh(scaled)
    cut = (vectors * np.maximum(values, 1.0)[:, None, :]) @ vectors.swapaxes(1, 2)
    expected = cut * floor[:, :, None] * floor[:, None, :]
    np.testing.assert_allclose(clipped(scatter, total, floor), expected, rtol=1e-7, atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(shapes)
def test_regression_keeps_the_clear_slopes(case):
    _, d, q, seed = case
    rng = np.random.default_rng(seed)
    u = np.column_stack([np.ones(30), rng.normal(size=(30, q))])
    x = u @ rng.normal(size=(1 + q, d)) * 0.3 + rng.normal(size=(30, d))
    weight = rng.choice([0.0, 0.5, 1.0], (30, d))
    coef, spread = clear_regression(x, u, weight, 2.0)
    for i in range(d):
        columns = np.arange(1 + q)
        for _ in range(2):
            v = u[:, columns]
            a = (v * weight[:, [i]]).T @ v + np.eye(len(columns))
            b = np.linalg.solve(a, v.T @ (weight[:, i] * x[:, i]))
            left = (weight[:, i] @ (x[:, i] - v @ b) ** 2 + 1) / (weight[:, i].sum() + 1)
            t, used = b / np.sqrt(left * np.diag(np.linalg.inv(a))), columns
            columns = columns[(np.abs(t) >= 2.0) | (columns == 0)]
        expected = np.zeros(1 + q)
        expected[used] = b
        np.testing.assert_allclose(coef[i], expected, rtol=1e-8, atol=1e-10)
        assert spread[i] == pytest.approx(left)


@settings(max_examples=30, deadline=None)
@given(shapes)
def test_tables_equal_numpy(case):
    clusters, first, second, seed = case
    rng = np.random.default_rng(seed)
    starts = np.array([0, first, first + second])
    counts = rng.uniform(0, 5, (clusters, first + second))
    p = fitted_tables(counts, starts, 1.3)
    expected = 0.0
    for a, b in ((0, first), (first, first + second)):
        full = counts[:, a:b] + 1.3 / (b - a)
        np.testing.assert_allclose(p[:, a:b], full / full.sum(axis=1, keepdims=True))
        alpha, total = 1 + 1.3 / (b - a), counts[:, a:b].sum(axis=1)
        expected += (gammaln((b - a) * alpha) - gammaln((b - a) * alpha + total)).sum()
        expected += (gammaln(alpha + counts[:, a:b]) - gammaln(alpha)).sum()
        expected -= (counts[:, a:b] * np.log(p[:, a:b])).sum()
    assert dirichlet_part(counts, p, starts, 1.3) == pytest.approx(expected)

    states = rng.integers(-1, first, (9, 2)).astype(np.int8)
    weight = rng.random((9, clusters))
    table = rng.dirichlet(np.ones(first), clusters)
    found = state_counts(states, 1, weight, first)
    out = np.zeros((9, clusters))
    add_states(out, states, 1, table)
    for s in range(first):
        assert found[:, s] == pytest.approx(weight[states[:, 1] == s].sum(axis=0))
    for n, s in enumerate(states[:, 1]):
        assert out[n] == pytest.approx(np.log(table[:, s]) if s >= 0 else np.zeros(clusters))


@settings(max_examples=30, deadline=None)
@given(shapes)
def test_messages_are_bayes_rule(case):
    clusters, styles, _, seed = case
    rng = np.random.default_rng(seed)
    local = rng.normal(0, 20, (8, clusters))
    hidden = rng.dirichlet(np.ones(clusters), styles)
    prior, weight = rng.dirichlet(np.ones(styles), 8), rng.random(8)
    logs, product = np.ones((8, styles)), rng.choice([1.0, 1e-130], (8, styles))
    before = logs + np.log(product)
    likelihood, mass = message(local, hidden, logs, product)
    both = hidden[None] * np.exp(local)[:, None, :]  # (n, |S|, K)
    found = logs + np.log(product) - before
    np.testing.assert_allclose(found, np.log(both.sum(axis=2)), rtol=1e-9, atol=1e-9)
    joint = both / both.sum(axis=2, keepdims=True) * prior[:, :, None]
    found, counts = downward(likelihood, mass, hidden, prior, weight)
    np.testing.assert_allclose(found, joint.sum(axis=1), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(counts, (joint * weight[:, None, None]).sum(axis=0), atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(shapes)
def test_moments_fill_in_what_is_unobserved(case):
    clusters, d, width, seed = case
    rng = np.random.default_rng(seed)
    masks = np.array([rng.random(d) < 0.6, np.ones(d, dtype=bool), np.zeros(d, dtype=bool)])
    order, starts = rng.permutation(9), np.array([0, 3, 6, 9])
    x, z = rng.normal(size=(9, d)), rng.normal(size=(9, width - 1))
    coef, cov = rng.normal(size=(clusters, d, width)), covariances(rng, clusters, d)
    weight = rng.random((9, clusters))
    uu, xu, xx = (np.zeros((clusters, *s)) for s in ((width, width), (d, width), (d, d)))
    for p, mask in enumerate(masks):
        if not mask.any():
            continue
        for n, k in ((n, k) for n in order[starts[p] : starts[p + 1]] for k in range(clusters)):
            u = np.array([1.0, *z[n]])
            mean = coef[k] @ u
            gain = cov[k][:, mask] @ np.linalg.inv(cov[k][np.ix_(mask, mask)])
            full = mean + gain @ (x[n] - mean)[mask]
            left = cov[k] - gain @ cov[k][mask]
            uu[k] += weight[n, k] * np.outer(u, u)
            xu[k] += weight[n, k] * np.outer(full, u)
            xx[k] += weight[n, k] * (np.outer(full, full) + left)
    found = moments(x, z, order, starts, masks, coef, cov, weight)
    for a, b in zip(found, (uu, xu, xx), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-8)


def test_compiled_equals_plain():
    """One example through the plain versions, all the way down."""
    rng = np.random.default_rng(1)
    (uu, xu, xx), prior = drawn_moments(rng, 2, 3, 2)
    compiled_found = regressed(uu, xu, xx, *prior)
    names = ("cholesky", "solve_lower", "solve_upper")
    with pytest.MonkeyPatch.context() as plain:
        for name in names:
            plain.setattr(kernels_conjugate, name, getattr(kernels, name).py_func)
        for a, b in zip(regressed.py_func(uu, xu, xx, *prior), compiled_found, strict=True):
            np.testing.assert_array_equal(a, b)
