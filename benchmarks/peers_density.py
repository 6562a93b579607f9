"""Peers that have a density, fitted on the same coordinates and judged by the same measure.

The mixture of products is what StepMix fits (independent coordinates within a class, EM, BIC),
with the atoms of the contract as categories; `stepmix_nll` runs StepMix itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facade_tools.exteriors.coordinates import Readings, states_of
from facade_tools.exteriors.layout import Layout

LOG_2PI = np.log(2 * np.pi)


@dataclass(frozen=True)
class Columns:
    """Rows in own units: x (n, d), NaN where there is no density; floors (d,); categories."""

    x: np.ndarray
    floor: np.ndarray
    states: list[np.ndarray]
    sizes: list[int]


def columns(readings: Readings, layout: Layout) -> Columns:
    xs, floors, states, sizes = [], [], [], []
    for values, parts, group in zip(readings.values, readings.parts, layout.groups, strict=True):
        found, dense = states_of(values, parts, group)
        xs.append(np.where(dense, values, np.nan))
        floors += [c.floor for c in group.coordinates]
        states += list(found.T)
        sizes += [len(c.states) for c in group.channels]
    states += list(readings.bits.T)
    sizes += [2] * readings.bits.shape[1]
    return Columns(np.concatenate(xs, axis=1), np.array(floors), states, sizes)


@dataclass(frozen=True)
class Products:
    """A mixture of products."""

    weights: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    tables: list[np.ndarray]

    def joint(self, c: Columns) -> np.ndarray:
        """Return log P(class, row)."""
        total = np.tile(np.log(self.weights), (len(c.x), 1))
        seen = ~np.isnan(c.x)
        x = np.where(seen, c.x, 0.0)
        for k in range(len(self.weights)):
            z = (x - self.mean[k]) / self.sd[k]
            total[:, k] += (seen * (-0.5 * (z * z + LOG_2PI) - np.log(self.sd[k]))).sum(axis=1)
        for state, table in zip(c.states, self.tables, strict=True):
            padded = np.concatenate([np.log(table), np.zeros((len(table), 1))], axis=1)
            total += padded.T[state]
        return total

    def nll(self, c: Columns) -> np.ndarray:
        """Return −log P(row)."""
        joint = self.joint(c)
        top = joint.max(axis=1)
        return -(np.log(np.exp(joint - top[:, None]).sum(axis=1)) + top)


def m_step(c: Columns, r: np.ndarray) -> Products:
    seen = ~np.isnan(c.x)
    x = np.where(seen, c.x, 0.0)
    rows = r.T @ seen
    pooled = np.nanmean(np.where(seen, c.x, np.nan), axis=0) if len(x) else 0
    pooled = np.nan_to_num(pooled)
    mean = (r.T @ x + pooled * 0.1) / (rows + 0.1)
    spread = np.nan_to_num(np.nanvar(np.where(seen, c.x, np.nan), axis=0))
    var = np.stack([(r[:, [k]] * seen * (x - m) ** 2).sum(axis=0) for k, m in enumerate(mean)])
    sd = np.maximum(np.sqrt((var + 0.1 * spread) / (rows + 0.1)), c.floor)
    tables = [
        np.stack([r[s == v].sum(axis=0) + 0.5 for v in range(m)], axis=1)
        for s, m in zip(c.states, c.sizes, strict=True)
    ]
    tables = [t / t.sum(axis=1, keepdims=True) for t in tables]
    return Products(r.mean(axis=0) + 1e-12, mean, sd, tables)


def fit_products(
    c: Columns, rng: np.random.Generator, largest: int = 16, starts: int = 3
) -> Products:
    """EM from several random starts a size; the size by BIC."""
    best, best_bic, worse = None, np.inf, 0
    d, cats = c.x.shape[1], sum(m - 1 for m in c.sizes)
    for k in range(1, largest + 1):
        bic_k, fit_k = np.inf, None
        for _ in range(1 if k == 1 else starts):
            fit, nll = _em(c, k, rng)
            bic = 2 * nll + (k * (2 * d + cats) + k - 1) * np.log(len(c.x))
            if bic < bic_k:
                bic_k, fit_k = bic, fit
        worse = 0 if bic_k < best_bic else worse + 1
        if bic_k < best_bic:
            best, best_bic = fit_k, bic_k
        if worse >= 3:
            break
    return best


def _em(c: Columns, k: int, rng: np.random.Generator) -> tuple[Products, float]:
    seeds = rng.choice(len(c.x), k, replace=False)
    scale = np.maximum(np.nan_to_num(np.nanstd(c.x, axis=0)), c.floor)
    x = np.nan_to_num((c.x - np.nan_to_num(np.nanmean(c.x, axis=0))) / scale)
    look = np.concatenate([x, np.stack(c.states, axis=1)], axis=1)
    near = ((look[:, None] - look[seeds]) ** 2).sum(axis=2).argmin(axis=1)
    r = np.full((len(x), k), 0.05 / k)
    r[np.arange(len(x)), near] += 0.95
    last = np.inf
    for _ in range(200):
        fit = m_step(c, r / r.sum(axis=1, keepdims=True))
        joint = fit.joint(c)
        top = joint.max(axis=1, keepdims=True)
        r = np.exp(joint - top)
        nll = -(np.log(r.sum(axis=1)) + top[:, 0]).sum()
        if abs(last - nll) < 1e-6 * abs(nll):
            break
        last = nll
    return fit, nll
