"""The upper half of the network by itself: S and the tables P(H | S), families held fixed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .coordinates import Floats
from .em import NOTHING, Prior, fit_bits, fit_table
from .network import Weights, bit_log_density, log_, log_sum
from .dataset import Dataset


@dataclass(frozen=True, slots=True)
class Upper:
    """P(S), P(bit | S), P(H | S) a group, and the posterior of S (n, |S|) with its density."""

    style: Floats
    bits: Floats
    hidden: tuple[Floats, ...]
    posterior: Floats
    log_density: Floats


@dataclass(frozen=True, slots=True)
class Evidence:
    """exp(log P(group | H) − top) (n, K) and top (n,) of every group."""

    likelihood: tuple[Floats, ...]
    top: tuple[Floats, ...]


def evidence(locals_: list[Floats]) -> Evidence:
    """Return the evidence of log P(group | H) tables."""
    tops = tuple(table.max(axis=1) for table in locals_)
    scaled = tuple(np.exp(t - top[:, None]) for t, top in zip(locals_, tops, strict=True))
    return Evidence(scaled, tops)


def first(
    shown: Evidence, data: Dataset, weights: Weights, prior: Prior, posterior: Floats
) -> Upper:
    """Return the upper half after an M-step from a posterior of S alone."""
    hidden = []
    for likelihood, weight in zip(shown.likelihood, weights.groups, strict=True):
        share = likelihood / np.maximum(likelihood.sum(axis=1, keepdims=True), NOTHING)
        hidden.append(fit_table((posterior * weight[:, None]).T @ share, prior.hidden))
    style = fit_table(weights.style @ posterior, prior.style)
    bits = fit_bits(data, weights, posterior, prior)
    return _expect(style, bits, tuple(hidden), shown, data)


def _expect(
    style: Floats, bits: Floats, hidden: tuple[Floats, ...], shown: Evidence, data: Dataset
) -> Upper:
    joint = bit_log_density(bits, data.bits) + log_(style)
    for table, likelihood, top in zip(hidden, shown.likelihood, shown.top, strict=True):
        joint += log_(likelihood @ table.T) + top[:, None]
    density = log_sum(joint)
    return Upper(style, bits, hidden, np.exp(joint - density[:, None]), density)


def iterate(upper: Upper, shown: Evidence, data: Dataset, weights: Weights, prior: Prior) -> Upper:
    """Return the upper half after one EM iteration."""
    hidden = tuple(
        fit_table(hidden_counts(table, likelihood, upper.posterior, weight), prior.hidden)
        for table, likelihood, weight in zip(
            upper.hidden, shown.likelihood, weights.groups, strict=True
        )
    )
    style = fit_table(weights.style @ upper.posterior, prior.style)
    bits = fit_bits(data, weights, upper.posterior, prior)
    return _expect(style, bits, hidden, shown, data)


def hidden_counts(table: Floats, likelihood: Floats, posterior: Floats, weight: Floats) -> Floats:
    """Return Σ weight · P(S, H | row), (|S|, K)."""
    share = posterior * weight[:, None] / np.maximum(likelihood @ table.T, 1e-290)
    return np.asarray(table * (share.T @ likelihood))


def improve(
    upper: Upper, shown: Evidence, data: Dataset, weights: Weights, prior: Prior,
    iterations: int = 30, tolerance: float = 1e-5,
) -> Upper:  # fmt: skip
    """Run EM on the upper half until the log likelihood changes little, relatively."""
    for _ in range(iterations):
        after = iterate(upper, shown, data, weights, prior)
        change = weights.style @ (after.log_density - upper.log_density)
        upper = after
        if abs(change) <= tolerance * abs(weights.style @ upper.log_density):
            break
    return upper


def grow(upper: Upper, shown: Evidence, data: Dataset, weights: Weights, prior: Prior) -> Upper:
    """Return the upper half with one style more: the heaviest style is cut in two."""
    profile = [
        likelihood / np.maximum(likelihood.sum(axis=1, keepdims=True), NOTHING)
        for likelihood in shown.likelihood
    ]
    look = np.concatenate([*profile, np.maximum(data.bits, 0)], axis=1)
    trials = []
    for k in np.argsort(-(weights.style @ upper.posterior))[:2]:
        cut = _cut(upper.posterior, look, weights.style, int(k))
        start = first(shown, data, weights, prior, cut)
        trials.append(improve(start, shown, data, weights, prior, iterations=6))
    return max(trials, key=lambda trial: float(weights.style @ trial.log_density))


def _cut(posterior: Floats, look: Floats, weight: Floats, k: int) -> Floats:
    w = posterior[:, k] * weight
    centred = look - w @ look / max(float(w.sum()), NOTHING)
    _, vectors = np.linalg.eigh((centred * w[:, None]).T @ centred)
    side = centred @ vectors[:, -1] > 0
    halves = [posterior[:, k] * (0.8 * side + 0.1), posterior[:, k] * (0.8 * ~side + 0.1)]
    return np.concatenate([np.delete(posterior, k, axis=1), np.stack(halves, axis=1)], axis=1)
