"""The upper half of the network by itself: S, its bits and P(H | S), the families held fixed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ..compiled import compiled
from .coordinates import Bits, Floats
from .dataset import Dataset
from .em import NOTHING, Prior, beta_mode, bit_pseudo_counts, fit_table, weighed_bits
from .kernels_conjugate import fitted_tables
from .network import Weights

Ints = NDArray[np.int64]

SMALL = 1e-200  # a product below it goes into the logarithm before it vanishes
TRIALS = 2  # styles that are tried for a cut
TRIAL = 5  # iterations of each


@compiled
def upper_pass(  # noqa: C901 - one pass over the rows, compiled: calls would cost what it saves
    likelihood: Floats,
    starts: Ints,
    hidden: Floats,
    style: Floats,
    bits: Bits,
    one: Floats,
    weight: Floats,
    density: Floats,
    posterior: Floats,
    counts: Floats,
) -> None:
    """E-step of the upper half.

    likelihood (n, ΣK): group g owns columns starts[g]:starts[g + 1]; hidden (|S|, ΣK); bits (n, b),
    one (|S|, b) their probabilities; weight (n, groups). Written: log density (n,), posterior
    (n, |S|), counts (|S|, ΣK): Σ weight · P(S, H | row).
    """
    n_styles, groups = style.shape[0], starts.shape[0] - 1
    sums = np.empty((groups, n_styles))
    logs, product = np.empty(n_styles), np.empty(n_styles)
    wide, ones, zeros = hidden.T.copy(), one.T.copy(), 1.0 - one.T  # styles side by side: SIMD
    total = np.zeros(wide.shape)
    for n in range(likelihood.shape[0]):
        product[:] = style
        logs[:] = 0.0
        for b in range(bits.shape[1]):
            if bits[n, b] >= 0:
                table = ones[b] if bits[n, b] == 1 else zeros[b]
                for s in range(n_styles):
                    product[s] *= table[s]
        for g in range(groups):
            mass = sums[g]
            mass[:] = 1e-290
            for k in range(starts[g], starts[g + 1]):
                likely, table = likelihood[n, k], wide[k]
                for s in range(n_styles):
                    mass[s] += table[s] * likely
            for s in range(n_styles):
                if product[s] < SMALL:
                    logs[s] += np.log(product[s])
                    product[s] = 1.0
                product[s] *= mass[s]
        top = -np.inf
        for s in range(n_styles):
            logs[s] += np.log(product[s])
            top = max(top, logs[s])
        norm = 0.0
        for s in range(n_styles):
            posterior[n, s] = np.exp(logs[s] - top)
            norm += posterior[n, s]
        density[n] = top + np.log(norm)
        for s in range(n_styles):
            posterior[n, s] /= norm
        for g in range(groups):
            mass, w = sums[g], weight[n, g]
            for s in range(n_styles):
                product[s] = w * posterior[n, s] / mass[s]
            for k in range(starts[g], starts[g + 1]):
                likely, table = likelihood[n, k], total[k]
                for s in range(n_styles):
                    table[s] += product[s] * likely
    counts[:] = (total * wide).T


@dataclass(frozen=True, slots=True)
class Evidence:
    """exp(log P(group | H) − top) (n, ΣK), groups side by side; top (n,) summed over groups."""

    likelihood: Floats
    starts: Ints
    top: Floats


@dataclass(frozen=True, slots=True)
class Upper:
    """P(S), P(bit | S), P(H | S) side by side (|S|, ΣK), and what the E-step says of the rows."""

    style: Floats
    bits: Floats
    hidden: Floats
    posterior: Floats
    log_density: Floats
    counts: Floats


@dataclass(frozen=True, slots=True)
class Rows:
    """What does not change while the upper half is fitted: bits, weights and priors.

    one, zero (n, b): weights of the rows in which a bit is 1, or 0; pseudo (2, b): its prior.
    """

    bits: Bits
    one: Floats
    zero: Floats
    pseudo: Floats
    style_weight: Floats
    group_weight: Floats
    prior: Prior


def rows_of(data: Dataset, weights: Weights, prior: Prior) -> Rows:
    """Return the fixed part of the rows."""
    one, zero = weighed_bits(data, weights)
    return Rows(
        data.bits,
        one,
        zero,
        bit_pseudo_counts(one, zero, prior),
        weights.style,
        np.ascontiguousarray(np.stack(weights.groups, axis=1)),
        prior,
    )


def evidence(locals_: list[tuple[Floats, Floats]]) -> Evidence:
    """Return the evidence of scaled likelihoods (n, K) and their logarithmic tops (n,)."""
    starts = np.cumsum([0, *(table.shape[1] for table, _ in locals_)]).astype(np.int64)
    likelihood = np.ascontiguousarray(np.concatenate([table for table, _ in locals_], axis=1))
    return Evidence(likelihood, starts, np.sum([top for _, top in locals_], axis=0))


def scaled(local: Floats) -> tuple[Floats, Floats]:
    """Return exp(local − top) and top, the largest of each row."""
    top = local.max(axis=1)
    return np.exp(local - top[:, None]), top


def expect(rows: Rows, shown: Evidence, style: Floats, bits: Floats, hidden: Floats) -> Upper:
    """Return the upper half after an E-step."""
    n, styles = len(rows.bits), len(style)
    density, posterior = np.empty(n), np.empty((n, styles))
    counts = np.empty(hidden.shape)
    upper_pass(
        shown.likelihood, shown.starts, hidden, style, rows.bits, bits, rows.group_weight,
        density, posterior, counts,
    )  # fmt: skip
    return Upper(style, bits, hidden, posterior, density + shown.top, counts)


def normalised(counts: Floats, starts: Ints, strength: float) -> Floats:
    """Return MAP tables of side-by-side counts: each group's columns sum to 1."""
    return fitted_tables(counts, starts, strength)


def bit_counts(rows: Rows, posterior: Floats) -> tuple[Floats, Floats]:
    """Return expected counts of ones and zeros, (|S|, b) each."""
    return posterior.T @ rows.one, posterior.T @ rows.zero


def maximise(rows: Rows, shown: Evidence, posterior: Floats, counts: Floats) -> Upper:
    """Return the upper half after an M-step, and the E-step that follows it."""
    one, zero = bit_counts(rows, posterior)
    bits = beta_mode(one, zero, rows.pseudo)
    style = fit_table(rows.style_weight @ posterior, rows.prior.style)
    hidden = normalised(counts, shown.starts, rows.prior.hidden)
    return expect(rows, shown, style, bits, hidden)


def first(rows: Rows, shown: Evidence, posterior: Floats) -> Upper:
    """Return the upper half from a posterior of S alone."""
    share = profile(shown)
    starts = shown.starts
    parts = [
        (posterior * rows.group_weight[:, [g]]).T @ share[:, starts[g] : starts[g + 1]]
        for g in range(len(starts) - 1)
    ]
    return maximise(rows, shown, posterior, np.concatenate(parts, axis=1))


def profile(shown: Evidence) -> Floats:
    """Return P(H | group) under even shares, (n, ΣK)."""
    sums = np.add.reduceat(shown.likelihood, shown.starts[:-1], axis=1)
    wide = np.repeat(np.maximum(sums, NOTHING), np.diff(shown.starts), axis=1)
    return np.asarray(shown.likelihood / wide)


def improve(
    rows: Rows, shown: Evidence, upper: Upper, iterations: int = 30, tolerance: float = 1e-5
) -> Upper:
    """Run EM on the upper half until the log likelihood changes little, relatively."""
    for _ in range(iterations):
        after = maximise(rows, shown, upper.posterior, upper.counts)
        change = rows.style_weight @ (after.log_density - upper.log_density)
        upper = after
        if abs(change) <= tolerance * abs(rows.style_weight @ upper.log_density):
            break
    return upper


def grow(rows: Rows, shown: Evidence, upper: Upper) -> Upper:
    """Return the upper half with one style more: a heavy style is cut in two."""
    look = np.concatenate([profile(shown), np.maximum(rows.bits, 0)], axis=1)
    heavy = np.argsort(-(rows.style_weight @ upper.posterior))[:TRIALS]
    trials = []
    for k in heavy:
        start = first(rows, shown, cut(upper.posterior, look, rows.style_weight, int(k)))
        trials.append(improve(rows, shown, start, TRIAL))
    return max(trials, key=lambda trial: float(rows.style_weight @ trial.log_density))


def cut(posterior: Floats, look: Floats, weight: Floats, k: int) -> Floats:
    """Return the posterior with style k cut across the direction in which its rows differ most."""
    w = posterior[:, k] * weight
    centred = look - w @ look / max(float(w.sum()), NOTHING)
    side = centred @ longest(centred, w) > 0
    halves = [posterior[:, k] * (0.8 * side + 0.1), posterior[:, k] * (0.8 * ~side + 0.1)]
    return np.concatenate([np.delete(posterior, k, axis=1), np.stack(halves, axis=1)], axis=1)


def longest(centred: Floats, weight: Floats) -> Floats:
    """Return the direction (m,) in which centred rows (n, m) differ most.

    Its greatest entry is positive: which of ± comes out of LAPACK differs between machines.
    """
    last = centred.shape[1] - 1
    _, vectors = eigh((centred * weight[:, None]).T @ centred, subset_by_index=[last, last])
    direction = vectors[:, 0]
    return np.asarray(direction * np.sign(direction[np.argmax(np.abs(direction))]))
