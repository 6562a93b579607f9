"""Can a classifier tell held-out real houses from samples? AUC, 0.5 is perfect.

    python benchmarks/bench_two_sample.py [real-attributes.jsonl] [--train 2845]
        [--models full,gmm,StepMix,copulas,ctgan]

Rows are compared on the free coordinates, parts and bits that the density is over; samples are
masked with the real rows' nulls first. Surveyors measure in feet, so that real heights repeat to
the last digit. No density may be finer than 5 cm or 0.01 (the contract): `sample` takes up shared
values again (`--smooth` does not), and the second AUC blurs both sides by just that floor.

Which attributes nobody measured depends on the house: the upper floors of high houses, the other
roof bits of gables. A sample under some other house's nulls gives itself away by that alone. The
third AUC is of the same samples and the same nulls, paired so that each sample takes those of the
real house that it is most like (the assignment of least total distance).
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from peers_density import (
    Columns,
    columns,
    draw_products,
    fit_products,
    fit_stepmix,
    has_stepmix,
)
from scipy.optimize import linear_sum_assignment
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import StratifiedKFold, cross_val_predict

from facade_tools.artifacts.store import read
from facade_tools.exteriors.coordinates import Readings, read_attributes
from facade_tools.exteriors.layout import Layout, building_layout
from facade_tools.exteriors.learning import LearnOptions, learn_model
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.samples import SampleOptions, sample_attributes

PEERS = {"products": lambda c: fit_products(c, np.random.default_rng(0)), "StepMix": fit_stepmix}


def table(readings: Readings) -> np.ndarray:
    """Return free coordinates (absent: −9; atoms exact), parts and bits; NaN where unobserved."""
    values = [np.where(np.isinf(v), -9.0, np.round(v, 5)) for v in readings.values]
    marks = [np.where(p < 0, np.nan, p) for p in (*readings.parts, readings.bits)]
    return np.concatenate([*values, *marks], axis=1)


def blurred(rows: np.ndarray, layout: Layout, rng: np.random.Generator) -> np.ndarray:
    """Return the table with noise of the least standard deviation on all that is at no atom."""
    out = rows.copy()
    coordinates = [c for g in layout.groups for c in g.coordinates]
    for j, c in enumerate(coordinates):
        dense = np.isfinite(out[:, j]) & (out[:, j] != -9.0) & ~np.isin(out[:, j], c.atoms)
        out[dense, j] += c.floor * rng.normal(size=int(dense.sum()))
    return out


def pairing(real: np.ndarray, fake: np.ndarray) -> np.ndarray:
    """Return which sample (n,) suits each real row's nulls: the assignment of least distance."""
    known = np.isfinite(real)
    scale = np.maximum(np.nanstd(real, axis=0), 1e-2)
    a, b = np.where(known, real, 0.0) / scale, np.nan_to_num(fake) / scale
    cost = (a**2).sum(axis=1)[:, None] - 2 * a @ b.T + known.astype(np.float64) @ (b**2).T
    return linear_sum_assignment(np.minimum(cost / known.sum(axis=1)[:, None], 9.0))[1]


def auc(real: np.ndarray, fake: np.ndarray) -> float:
    """Return the cross-validated AUC of a gradient-boosted classifier."""
    x, y = np.concatenate([real, fake]), np.repeat([1, 0], len(real))
    judge = HistGradientBoostingClassifier(max_iter=60, random_state=0)
    folds = StratifiedKFold(5, shuffle=True, random_state=0)  # pairs must not share their folds
    chance = cross_val_predict(judge, x, y, cv=folds, method="predict_proba")[:, 1]
    return float(roc_auc_score(y, chance))


def table_of(drawn: Columns, layout: Layout) -> np.ndarray:
    """Return what `table` returns, of rows drawn from a mixture of products."""
    values, marks, at, wide = [], [], 0, 0
    for group in layout.groups:
        x = drawn.x[:, wide : wide + len(group.coordinates)].copy()
        states = drawn.states[at : at + len(group.channels)]
        for c, channel in enumerate(group.channels):
            for s, atom in enumerate(channel.atoms, start=1):
                x[states[c] == s, channel.coordinate] = atom
            if channel.coordinate < 0:
                marks.append(states[c])
        for i, part in enumerate(group.part):
            if part >= 0:
                x[states[part] == 0, i] = -9.0
        values.append(np.round(x, 5))
        wide, at = wide + len(group.coordinates), at + len(group.channels)
    bits = drawn.states[at:]
    return np.concatenate([*values, np.stack([*marks, *bits], axis=1)], axis=1)


def copula(train: np.ndarray, count: int) -> np.ndarray:
    """Return rows of a Gaussian copula (pip install copulas) fitted to medians where unobserved."""
    import pandas as pd
    from copulas.multivariate import GaussianMultivariate

    used = np.isfinite(train).any(axis=0)
    frame = pd.DataFrame(train[:, used])
    model = GaussianMultivariate()
    model.fit(frame.fillna(frame.median()))
    out = np.full((count, train.shape[1]), np.nan)
    out[:, used] = np.round(model.sample(count).to_numpy(), 5)
    return out


def ctgan(train: np.ndarray, count: int) -> np.ndarray:
    """Return rows of a CTGAN (pip install ctgan), 100 epochs, medians where unobserved."""
    import pandas as pd
    from ctgan import CTGAN

    used = np.isfinite(train).any(axis=0)
    frame = pd.DataFrame(train[:, used], columns=[f"c{i}" for i in np.flatnonzero(used)])
    few = [name for name in frame.columns if frame[name].nunique() <= 3]
    model = CTGAN(epochs=100)
    model.fit(frame.fillna(frame.median()), few)
    out = np.full((count, train.shape[1]), np.nan)
    out[:, used] = np.round(model.sample(count).to_numpy().astype(np.float64), 5)
    return out


def fakes(name: str, train: list, count: int, layout: Layout) -> Iterator[tuple[str, np.ndarray]]:
    """Yield what is compared: samples of a variant, also without shared values, or of a peer."""
    rng = np.random.default_rng(1)
    if name in ("copulas", "ctgan"):
        make = copula if name == "copulas" else ctgan
        yield name, make(table(read_attributes(train, layout)), count)
    elif name in PEERS:
        rows = columns(read_attributes(train, layout), layout)
        yield name, table_of(draw_products(PEERS[name](rows), rows, count, rng), layout)
    else:
        model = learn_model(train, rng=rng, options=LearnOptions(variant=name))
        for seed, smooth in ((1, False), (2, False), (3, False), (1, True)):
            plain = SampleOptions(neighbours=False, smooth=smooth)
            rng = np.random.default_rng(seed)
            drawn = list(sample_attributes(model, count, rng=rng, options=plain))
            tag = f"{name} --smooth" if smooth else f"{name} ({seed})"
            yield tag, table(read_attributes(drawn, layout))


def main() -> None:
    """Print one line a model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("attributes", type=Path, nargs="?", help="default: the sample houses")
    parser.add_argument("--train", type=int, help="default: three of four")
    parser.add_argument("--models", default="full,no-lateral,no-middle,flat,gmm,products,StepMix")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    given = options.attributes
    houses = shipped_prior() if given is None else list(read([str(given)], "attributes"))
    houses = [houses[i] for i in np.random.default_rng(0).permutation(len(houses))]
    cut = options.train or round(0.75 * len(houses))
    train, test = houses[:cut], houses[cut:]
    layout = building_layout()
    real = table(read_attributes(test, layout))
    # A garage's measures are never observed in these data: where a real house has none, a
    # sample's would give it away beside the bit that already says so.
    shown = (np.isfinite(real) & (real != -9.0)).mean(axis=0) > 0.01
    names = [n for n in options.models.split(",") if n != "StepMix" or has_stepmix()]
    for name in names:
        for tag, fake in fakes(name, train, len(test), layout):
            masked = np.where(np.isnan(real), np.nan, fake)
            rng = np.random.default_rng(1)
            soft = [blurred(rows, layout, rng)[:, shown] for rows in (real, masked)]
            sharp = auc(real[:, shown], masked[:, shown])
            order = pairing(real[:, shown], fake[:, shown])
            suited = np.where(np.isnan(real), np.nan, fake[order])
            print(
                f"{tag:<20} AUC {sharp:.3f}, blurred {auc(*soft):.3f}, nulls that suit "
                f"{auc(real[:, shown], suited[:, shown]):.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
