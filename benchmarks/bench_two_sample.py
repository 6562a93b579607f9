"""Can a classifier tell held-out real houses from samples? AUC, 0.5 is perfect.

    python benchmarks/bench_two_sample.py real-attributes.jsonl [--train 2845] [--models full,gmm]

Rows are compared on the free coordinates, parts and bits that the density is over; samples are
masked with the real rows' nulls first. Surveyors measure in feet, so that real heights repeat to
the last digit; no model may be finer than 5 cm or 0.01 (the contract), so the second AUC blurs
both sides by just that.
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import cross_val_predict

from facade_tools.artifacts.store import read
from facade_tools.exteriors.coordinates import Readings, read_attributes
from facade_tools.exteriors.drawing import SampleOptions, sample_attributes
from facade_tools.exteriors.layout import Layout, building_layout
from facade_tools.exteriors.learning import LearnOptions, learn_model


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


def main() -> None:
    """Print one line a model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("attributes", type=Path)
    parser.add_argument("--train", type=int, default=2845)
    parser.add_argument("--models", default="full,no-lateral,flat,gmm")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    houses = list(read([str(options.attributes)], "attributes"))
    houses = [houses[i] for i in np.random.default_rng(0).permutation(len(houses))]
    train, test = houses[: options.train], houses[options.train :]
    layout = building_layout()
    real = table(read_attributes(test, layout))
    for variant in options.models.split(","):
        rng = np.random.default_rng(1)
        model = learn_model(train, rng=rng, options=LearnOptions(variant=variant))
        plain = SampleOptions(neighbours=False)
        drawn = list(sample_attributes(model, len(test), rng=rng, options=plain))
        fake = table(read_attributes(drawn, layout))
        # A garage's measures are never observed in these data: where a real house has none, a
        # sample's would give it away beside the bit that already says so.
        shown = (np.isfinite(real) & (real != -9.0)).mean(axis=0) > 0.01
        masked = np.where(np.isnan(real), np.nan, fake)
        soft = [blurred(rows, layout, rng)[:, shown] for rows in (real, masked)]
        sharp = auc(real[:, shown], masked[:, shown])
        print(f"{variant:<12} AUC {sharp:.3f}, blurred {auc(*soft):.3f}", flush=True)
        for name, j in zip(names(layout), range(real.shape[1]), strict=True):
            a, b = real[:, j], masked[:, j]
            a, b = a[np.isfinite(a)], b[np.isfinite(b)]
            if shown[j] and len(a) > 20:
                alone = roc_auc_score(np.r_[np.ones(len(a)), np.zeros(len(b))], np.r_[a, b])
                if abs(alone - 0.5) > 0.03:
                    print(f"    {name} alone: {alone:.3f}")


def names(layout: Layout) -> list[str]:
    values = [c.name for g in layout.groups for c in g.coordinates]
    parts = [c.name for g in layout.groups for c in g.channels if c.coordinate < 0]
    return [*values, *parts, *layout.bits]


if __name__ == "__main__":
    main()
