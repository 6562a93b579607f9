"""Can a classifier tell held-out real houses from samples? AUC, 0.5 is perfect.

    python benchmarks/bench_two_sample.py real-attributes.jsonl [--train 2845]
        [--models full,gmm,StepMix,copulas]

Rows are compared on the free coordinates, parts and bits that the density is over; samples are
masked with the real rows' nulls first. Surveyors measure in feet, so that real heights repeat to
the last digit. No density may be finer than 5 cm or 0.01 (the contract): `sample` takes up shared
values again (`--smooth` does not), and the second AUC blurs both sides by just that floor.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from peers_density import Columns, columns, draw_products, fit_products, fit_stepmix
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import cross_val_predict

from facade_tools.artifacts.store import read
from facade_tools.exteriors.coordinates import Readings, read_attributes
from facade_tools.exteriors.drawing import SampleOptions, sample_attributes
from facade_tools.exteriors.layout import Layout, building_layout
from facade_tools.exteriors.learning import LearnOptions, learn_model

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


def auc(real: np.ndarray, fake: np.ndarray) -> float:
    """Return the cross-validated AUC of a gradient-boosted classifier."""
    x, y = np.concatenate([real, fake]), np.repeat([1, 0], len(real))
    judge = HistGradientBoostingClassifier(max_iter=60, random_state=0)
    chance = cross_val_predict(judge, x, y, cv=5, method="predict_proba")[:, 1]
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


def fakes(name: str, train: list, count: int, layout: Layout) -> Iterator[tuple[str, np.ndarray]]:
    """Yield what is compared: samples of a variant, also without shared values, or of a peer."""
    rng = np.random.default_rng(1)
    if name == "copulas":
        yield name, copula(table(read_attributes(train, layout)), count)
    elif name in PEERS:
        rows = columns(read_attributes(train, layout), layout)
        yield name, table_of(draw_products(PEERS[name](rows), rows, count, rng), layout)
    else:
        model = learn_model(train, rng=rng, options=LearnOptions(variant=name))
        for smooth in (False, True):
            plain = SampleOptions(neighbours=False, smooth=smooth)
            drawn = list(sample_attributes(model, count, rng=rng, options=plain))
            yield f"{name} --smooth" if smooth else name, table(read_attributes(drawn, layout))


def main() -> None:
    """Print one line a model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("attributes", type=Path)
    parser.add_argument("--train", type=int, default=2845)
    parser.add_argument("--models", default="full,no-lateral,no-middle,flat,gmm,products,StepMix")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    houses = list(read([str(options.attributes)], "attributes"))
    houses = [houses[i] for i in np.random.default_rng(0).permutation(len(houses))]
    train, test = houses[: options.train], houses[options.train :]
    layout = building_layout()
    real = table(read_attributes(test, layout))
    # A garage's measures are never observed in these data: where a real house has none, a
    # sample's would give it away beside the bit that already says so.
    shown = (np.isfinite(real) & (real != -9.0)).mean(axis=0) > 0.01
    for name in options.models.split(","):
        for tag, fake in fakes(name, train, len(test), layout):
            masked = np.where(np.isnan(real), np.nan, fake)
            rng = np.random.default_rng(1)
            soft = [blurred(rows, layout, rng)[:, shown] for rows in (real, masked)]
            sharp = auc(real[:, shown], masked[:, shown])
            print(f"{tag:<20} AUC {sharp:.3f}, blurred {auc(*soft):.3f}", flush=True)


if __name__ == "__main__":
    main()
