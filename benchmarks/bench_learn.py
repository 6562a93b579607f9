"""How fast learning is and how well it foresees held-out buildings, beside its peers.

    python benchmarks/bench_learn.py [--attributes real.jsonl] [--splits 3] [--train 2845]

Without --attributes: the sample houses. Splits are random, the same for every model. The density
is the contract's for all; the mixture of products is what StepMix fits, with atoms and with every
standard deviation held at the contract's floor.
"""

from __future__ import annotations

import argparse
import resource
import time
import warnings
from pathlib import Path

import numpy as np
from peers_density import columns, fit_independent, fit_products, fit_stepmix, has_stepmix

from facade_tools.artifacts.attributes import Attributes
from facade_tools.artifacts.store import read
from facade_tools.exteriors.coordinates import read_attributes
from facade_tools.exteriors.evaluation import negative_log_density
from facade_tools.exteriors.holdout import splits
from facade_tools.exteriors.layout import building_layout
from facade_tools.exteriors.learning import LearnOptions, boundary_of, learn_model
from facade_tools.exteriors.prior import shipped_prior

MODELS = ("full", "no-lateral", "no-middle", "flat", "gmm", "faithful")
PEERS = {
    "products": lambda c: fit_products(c, np.random.default_rng(0)),
    "StepMix": fit_stepmix,
    "independent": fit_independent,
}


def held_out(name: str, train: list[Attributes], test: list[Attributes]) -> np.ndarray:
    if name in PEERS:
        layout = building_layout(boundary_of(train))
        fit = PEERS[name](columns(read_attributes(train, layout), layout))
        return fit.nll(columns(read_attributes(test, layout), layout))
    faithful = name == "faithful"
    options = LearnOptions("full" if faithful else name, faithful)
    model = learn_model(train, rng=np.random.default_rng(0), options=options)
    return negative_log_density(model, test)


def compare(rows: list[Attributes], repeats: int, limit: int | None, names: list[str]) -> None:
    found: dict[str, list[np.ndarray]] = {name: [] for name in names}
    seconds = dict.fromkeys(names, 0.0)
    for train, test in splits(len(rows), repeats, 0):
        for name in names:
            start = time.process_time()
            chosen = [rows[i] for i in train[:limit]]
            found[name].append(held_out(name, chosen, [rows[i] for i in test]))
            seconds[name] += time.process_time() - start
    first = np.concatenate(found[names[0]])
    head = f"{'model':<12} {'nll':>8} {'s.e.':>6} {'minus ' + names[0]:>12} {'s.e.':>6}"
    print(f"{head} {'ratio':>6} CPU s")
    for name in names:
        nll = np.concatenate(found[name])
        gap, root = nll - first, len(nll) ** 0.5
        ratio = gap.mean() / max(gap.std() / root, 1e-9)
        print(
            f"{name:<12} {nll.mean():8.3f} {nll.std() / root:6.3f} {gap.mean():12.3f} "
            f"{gap.std() / root:6.3f} {ratio:6.1f} {seconds[name] / repeats:5.1f}",
            flush=True,
        )


def speed(rows: list[Attributes], sizes: list[int]) -> None:
    print("\nfull structure search and EM (one process; the paper: 40 min for 200 buildings)")
    rng = np.random.default_rng(0)
    for size in sizes:
        index = rng.choice(len(rows), size, replace=size > len(rows))
        chosen = [rows[i] for i in index]
        start, cpu = time.perf_counter(), time.process_time()
        model = learn_model(chosen, rng=rng)
        wall, cpu = time.perf_counter() - start, time.process_time() - cpu
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        tried = len(model.search)
        print(
            f"{size:6d} rows {wall:7.1f} s, {cpu:.1f} s of CPU, {tried} configurations, "
            f"peak {memory:.2f} GiB",
            flush=True,
        )


def main() -> None:
    """Print the held-out table and the times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--attributes", type=Path)
    parser.add_argument("--splits", type=int, default=3)
    parser.add_argument("--train", type=int)
    parser.add_argument("--models", default=",".join((*MODELS, *PEERS)))
    parser.add_argument("--sizes", default="200,2000")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    names = [n for n in options.models.split(",") if n != "StepMix" or has_stepmix()]
    given = options.attributes
    rows = shipped_prior() if given is None else list(read([str(given)], "attributes"))
    learn_model(rows[:60], rng=np.random.default_rng(0), options=LearnOptions(largest=2))  # compile
    if options.splits:
        compare(rows, options.splits, options.train, names)
    if options.sizes:
        speed(rows, [int(size) for size in options.sizes.split(",")])


if __name__ == "__main__":
    main()
