"""What learning finds of a known truth: lateral edges, and nats a row below the true model.

    python benchmarks/bench_recovery.py

First: networks of our own family, 2,000 rows. Then: 200 rows of a mixed 49-column table (25
continuous in 5 groups, 24 bits, 3 clusters, direct dependencies between columns), beside the
mixture of products, which is what StepMix fits.
"""

from __future__ import annotations

import time
import warnings

import numpy as np
from peers_density import columns, fit_products

from facade_tools.exteriors.coordinates import Readings
from facade_tools.exteriors.density import log_density
from facade_tools.exteriors.groups import BitGroup, Coordinate
from facade_tools.exteriors.layout import GroupLayout, Layout
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


def gap(truth, layout: Layout, train: int) -> tuple[float, float, float, tuple, float]:
    """Return nats below the truth of full, no-lateral and products; edges; CPU seconds of full."""
    data, held = truth.draw(train), truth.draw(2000)
    best, rows = truth.log_density(*held), readings_of(*held)
    start = time.process_time()
    gaps, edges, seconds = [], (), 0.0
    for variant in ("full", "no-lateral"):
        options = LearnOptions(variant=variant)
        model = learn_readings(
            readings_of(*data), layout, rng=np.random.default_rng(0), options=options
        )
        gaps.append(float((best - log_density(network_of(model), rows)).mean()))
        if variant == "full":
            edges, seconds = model.edges, time.process_time() - start
    products = fit_products(columns(readings_of(*data), layout), np.random.default_rng(0))
    gaps.append(float((best + products.nll(columns(rows, layout))).mean()))
    return gaps[0], gaps[1], gaps[2], edges, seconds


def main() -> None:
    """Print both tables."""
    warnings.simplefilter("ignore")
    print("own family, 2,000 rows: edges F1, nats below the truth: full, no-lateral, products")
    wanted = {frozenset((f"g{a}", f"g{b}")) for a, b in Hierarchy.edges}
    for seed in range(4):
        full, plain, products, edges, seconds = gap(
            Hierarchy(np.random.default_rng(seed)), layout_of(5, 2, 6), 2000
        )
        found = {frozenset(edge) for edge in edges}
        score = 2 * len(found & wanted) / (len(found) + len(wanted))
        print(
            f"  {score:.2f} {full:7.3f} {plain:7.3f} {products:7.3f}  {seconds:.0f} s", flush=True
        )
    print("mixed table, 200 rows: nats below the truth: full, no-lateral, products (StepMix: 4.9)")
    for seed in range(3):
        full, plain, products, _, seconds = gap(
            Mixed(np.random.default_rng(seed)), layout_of(5, 5, 24), 200
        )
        print(f"       {full:7.3f} {plain:7.3f} {products:7.3f}  {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
