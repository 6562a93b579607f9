"""What learning finds of a known truth: lateral edges, and nats a row below the true model.

    python benchmarks/bench_recovery.py

First: networks of our own family, 2,000 rows. Then: 200 rows of a mixed 49-column table (25
continuous in 5 groups, 24 bits, 3 clusters, direct dependencies between columns), beside its peers
(StepMix where it is installed).
"""

from __future__ import annotations

import argparse
import time
import warnings

import numpy as np
from peers_density import (
    columns,
    fit_independent,
    fit_products,
    fit_stepmix,
    gaussian_mixture_nll,
    has_stepmix,
)

from facade_tools.exteriors.coordinates import Readings, join
from facade_tools.exteriors.density import log_density
from facade_tools.exteriors.groups import BitGroup, Coordinate
from facade_tools.exteriors.layout import GroupLayout, Layout, merged
from facade_tools.exteriors.learning import LearnOptions, learn_readings
from facade_tools.exteriors.serialisation import network_of


def layout_of(groups: int, width: int, bits: int) -> Layout:
    rows = tuple(
        GroupLayout(
            f"g{g}",
            "table",
            tuple(Coordinate(f"g{g}.{i}", "identity", 0.01, (), -1e9, 1e9) for i in range(width)),
            (),
            (-1,) * width,
        )
        for g in range(groups)
    )
    return Layout(rows, (BitGroup("bits", tuple(f"b{i}" for i in range(bits))),))


def readings_of(values: list[np.ndarray], bits: np.ndarray) -> Readings:
    empty = np.empty((len(bits), 0), dtype=np.int8)
    ids = tuple(map(str, range(len(bits))))
    return Readings(ids, tuple(values), tuple(empty for _ in values), bits.astype(np.int8))


class Hierarchy:
    """A network of our family: 5 groups of 2 coordinates, 3 styles, 3 clusters, 3 lateral edges."""

    edges = ((0, 1), (1, 3), (2, 4))

    def __init__(self, rng: np.random.Generator) -> None:
        """Draw the parameters."""
        self.rng = rng
        self.centers = rng.normal(size=(5, 3, 2)) * 3.0
        self.hidden = rng.dirichlet(np.full(3, 0.4), (5, 3))
        self.slopes = {edge: rng.normal(size=(2, 2)) * 1.2 for edge in self.edges}
        self.bits = rng.uniform(0.05, 0.95, (3, 6))

    def draw(self, n: int) -> tuple[list[np.ndarray], np.ndarray]:
        """Return group values and bits."""
        s = self.rng.integers(3, size=n)
        values: list[np.ndarray] = []
        for g in range(5):
            share = np.cumsum(self.hidden[g][s], axis=1)
            k = (self.rng.random((n, 1)) > share).sum(axis=1).clip(0, 2)
            noise = self.rng.normal(size=(n, 2))
            values.append(self.centers[g][k] + noise + self.shift(values, g, n))
        return values, self.rng.random((n, 6)) < self.bits[s]

    def shift(self, values: list[np.ndarray], g: int, n: int) -> np.ndarray:
        """Return what the lateral parents of group g add to it."""
        total = np.zeros((n, 2))
        for (a, b), slope in self.slopes.items():
            if b == g:
                total += values[a] @ slope.T
        return total

    def log_density(self, values: list[np.ndarray], bits: np.ndarray) -> np.ndarray:
        """Return the true log density."""
        total = np.tile(np.log(np.full(3, 1 / 3)), (len(bits), 1))
        total += bits @ np.log(self.bits).T + ~bits @ np.log(1 - self.bits).T
        for g in range(5):
            rest = values[g] - self.shift(values, g, len(bits))
            e = rest[:, None] - self.centers[g][None]
            local = np.exp(-0.5 * (e**2).sum(axis=2)) / (2 * np.pi)
            total += np.log(local @ self.hidden[g].T)
        return np.logaddexp.reduce(total, axis=1)


class Mixed:
    """3 clusters over 25 continuous and 24 binary columns, chained within and between groups."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Draw the parameters: every column leans on one before it, in or out of its group."""
        self.rng = rng
        self.mean = rng.normal(size=(3, 25)) * 1.5
        self.parent = [int(rng.integers(max(0, j - 6), j)) if j else 0 for j in range(25)]
        self.slope = np.where(rng.random(25) < 0.6, rng.normal(size=25), 0.0)
        self.slope[0] = 0.0
        self.spread = rng.uniform(0.4, 1.0, 25)
        self.odds = rng.normal(size=(3, 24)) * 1.5

    def means(self, x: np.ndarray, s: int, j: int) -> np.ndarray:
        """Return the mean of column j in cluster s given the columns before it."""
        return self.mean[s, j] + self.slope[j] * x[:, self.parent[j]]

    def draw(self, n: int) -> tuple[list[np.ndarray], np.ndarray]:
        """Return five groups of five columns, and bits."""
        s = self.rng.integers(3, size=n)
        x = np.zeros((n, 25))
        for j in range(25):
            mean = np.choose(s, [self.means(x, k, j) for k in range(3)])
            x[:, j] = mean + self.spread[j] * self.rng.normal(size=n)
        bits = self.rng.random((n, 24)) < 1 / (1 + np.exp(-self.odds[s]))
        return [x[:, 5 * g : 5 * g + 5] for g in range(5)], bits

    def log_density(self, values: list[np.ndarray], bits: np.ndarray) -> np.ndarray:
        """Return the true log density."""
        x = np.concatenate(values, axis=1)
        chance = 1 / (1 + np.exp(-self.odds))
        total = bits @ np.log(chance).T + ~bits @ np.log(1 - chance).T - np.log(3)
        for s in range(3):
            for j in range(25):
                z = (x[:, j] - self.means(x, s, j)) / self.spread[j]
                total[:, s] -= 0.5 * (z**2 + np.log(2 * np.pi)) + np.log(self.spread[j])
        return np.logaddexp.reduce(total, axis=1)


VARIANTS = ("full", "no-lateral", "no-middle", "flat", "gmm")


def learned(truth, layout: Layout, data, held, variants) -> tuple[dict[str, float], tuple, float]:
    """Return nats below the truth of each variant; the full model's edges and CPU seconds."""
    best = truth.log_density(*held)
    gaps, edges, seconds = {}, (), 0.0
    for variant in variants:
        plain = variant == "gmm"
        shown, given, seen = (
            (merged(layout), join(readings_of(*data)), join(readings_of(*held)))
            if plain
            else (layout, readings_of(*data), readings_of(*held))
        )
        start = time.process_time()
        model = learn_readings(
            given, shown, rng=np.random.default_rng(0), options=LearnOptions(variant=variant)
        )
        seconds = time.process_time() - start if variant == "full" else seconds
        gaps[variant] = float((best - log_density(network_of(model), seen)).mean())
        edges = model.edges if variant == "full" else edges
    return gaps, edges, seconds


def peers(truth, layout: Layout, data, held) -> dict[str, float]:
    """Return nats below the truth of what a user could pick instead."""
    best = truth.log_density(*held)
    train, test = (columns(readings_of(*rows), layout) for rows in (data, held))
    out = {"products": fit_products(train, np.random.default_rng(0)).nll(test)}
    if has_stepmix():
        out["StepMix"] = fit_stepmix(train).nll(test)
    out["independent"] = fit_independent(train).nll(test)
    for kind in ("diag", "tied", "full"):
        out[f"sklearn {kind}"], _ = gaussian_mixture_nll(train, test, kind)
    return {name: float((best + nll).mean()) for name, nll in out.items()}


def line(gaps: dict[str, float]) -> str:
    return "  ".join(f"{name} {gap:.2f}" for name, gap in gaps.items())


def recovery(seeds: int) -> None:
    print("own family, 2,000 rows: F1 of undirected edges, nats below the truth", flush=True)
    wanted = {frozenset((f"g{a}", f"g{b}")) for a, b in Hierarchy.edges}
    scores = []
    for seed in range(seeds):
        truth = Hierarchy(np.random.default_rng(seed))
        data, held = truth.draw(2000), truth.draw(2000)
        gaps, edges, seconds = learned(
            truth, layout_of(5, 2, 6), data, held, ("full", "no-lateral")
        )
        found = {frozenset(edge) for edge in edges}
        scores.append(2 * len(found & wanted) / (len(found) + len(wanted)))
        extra = sorted(map(sorted, found - wanted))
        print(f"  {scores[-1]:.2f}  {line(gaps)}  {seconds:.0f} s  {extra}", flush=True)
    print(f"  mean F1 {np.mean(scores):.3f}", flush=True)


def mixed(seeds: int) -> None:
    print("mixed table, 200 rows of 49 columns: nats below the truth", flush=True)
    for seed in range(seeds):
        truth = Mixed(np.random.default_rng(seed))
        data, held = truth.draw(200), truth.draw(2000)
        layout = layout_of(5, 5, 24)
        gaps, _, seconds = learned(truth, layout, data, held, VARIANTS)
        gaps |= peers(truth, layout, data, held)
        print(f"  {line(gaps)}  ({seconds:.0f} s)", flush=True)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recovery", type=int, default=6, help="networks")
    parser.add_argument("--mixed", type=int, default=3, help="tables")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.recovery:
        recovery(options.recovery)
    if options.mixed:
        mixed(options.mixed)


if __name__ == "__main__":
    main()
