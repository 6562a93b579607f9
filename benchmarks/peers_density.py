"""Peers that have a density, fitted on the same coordinates and judged by the same measure.

The mixture of products is what StepMix fits (independent coordinates within a class, EM, BIC),
with the atoms of the contract as categories; `fit_stepmix` runs StepMix itself, where it is
installed (pip install stepmix; no dependency of the project). Whatever fits, the standard
deviations are held at the contract's floors.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

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


# --- StepMix itself -----------------------------------------------------------------------------


def has_stepmix() -> bool:
    return find_spec("stepmix") is not None


def fit_stepmix(c: Columns, largest: int = 16, starts: int = 3) -> Products:
    """Run StepMix (mixed measurement with missing values), the number of classes by its BIC.

    Columns that nobody observes are left out and put back as they came. A category that a class
    never shows gets half a row, since −inf would end the comparison.
    """
    from stepmix.stepmix import StepMix

    cats = np.stack(c.states, axis=1).astype(float)
    cats[cats < 0] = np.nan
    wide = np.flatnonzero((~np.isnan(c.x)).any(axis=0))
    flags = np.flatnonzero((~np.isnan(cats)).any(axis=0))
    rows = np.concatenate([c.x[:, wide], cats[:, flags]], axis=1)
    kinds = {
        "cont": {"model": "gaussian_diag_nan", "n_columns": len(wide)},
        "cat": {"model": "categorical_nan", "n_columns": len(flags)},
    }
    best, best_bic, worse = None, np.inf, 0
    for k in range(1, largest + 1):
        model = StepMix(
            k, measurement=kinds, n_init=starts, random_state=0, progress_bar=0, max_iter=200,
            abs_tol=1e-4,
        ).fit(rows)  # fmt: skip
        bic = model.bic(rows)
        worse = 0 if bic < best_bic else worse + 1
        if bic < best_bic:
            best, best_bic = model, bic
        if worse >= 3:
            break
    return _from_stepmix(c, best.get_parameters(), wide, flags)


def _from_stepmix(c: Columns, found: dict, wide: np.ndarray, flags: np.ndarray) -> Products:
    weights = np.asarray(found["weights"])
    k, d = len(weights), c.x.shape[1]
    mean, sd = np.zeros((k, d)), np.tile(c.floor, (k, 1))
    mean[:, wide] = np.nan_to_num(found["measurement"]["cont"]["means"])
    spread = np.sqrt(np.nan_to_num(found["measurement"]["cont"]["covariances"]))
    sd[:, wide] = np.maximum(spread, c.floor[wide])
    tables = [np.full((k, m), 1 / m) for m in c.sizes]
    most = found["measurement"]["cat"]["max_n_outcomes"]
    pis = np.nan_to_num(np.asarray(found["measurement"]["cat"]["pis"])).reshape(k, -1, most)
    for at, j in enumerate(flags):
        table = pis[:, at, : c.sizes[j]]
        table = np.pad(table, ((0, 0), (0, c.sizes[j] - table.shape[1]))) + 0.5 / len(c.x)
        tables[j] = table / table.sum(axis=1, keepdims=True)
    return Products(weights, mean, sd, tables)


# --- the others ---------------------------------------------------------------------------------


def fit_independent(c: Columns) -> Products:
    """Independent columns."""
    return m_step(c, np.ones((len(c.x), 1)))


def gaussian_mixture_nll(
    train: Columns, test: Columns, kind: str, largest: int = 10
) -> tuple[np.ndarray, int]:
    """Return −log P (n,) of scikit-learn's mixture (BIC) of complete continuous columns.

    Categories are independent of it and of each other.
    """
    from sklearn.mixture import GaussianMixture

    fits = [
        GaussianMixture(k, covariance_type=kind, n_init=3, random_state=0, reg_covar=1e-3).fit(
            train.x
        )
        for k in range(1, largest + 1)
    ]
    best = min(fits, key=lambda fit: fit.bic(train.x))
    alone = fit_independent(train)
    blank = Columns(np.full_like(test.x, np.nan), test.floor, test.states, test.sizes)
    return alone.nll(blank) - best.score_samples(test.x), best.n_components


def draw_products(fit: Products, c: Columns, n: int, rng: np.random.Generator) -> Columns:
    """Return n rows drawn from a mixture of products."""
    k = rng.choice(len(fit.weights), n, p=fit.weights / fit.weights.sum())
    x = fit.mean[k] + fit.sd[k] * rng.standard_normal((n, c.x.shape[1]))
    states = [
        (rng.random((n, 1)) > np.cumsum(t[k], axis=1)).sum(axis=1).clip(0, t.shape[1] - 1)
        for t in fit.tables
    ]
    return Columns(x, c.floor, states, c.sizes)
