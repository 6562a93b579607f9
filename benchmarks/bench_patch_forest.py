"""Detection rates of the patch forest over depth and patch size (TSKP10 Fig. 6).

python benchmarks/bench_patch_forest.py DATA [--convention ecp] [--limit N]
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from facade_tools.artifacts.parse import LABELS
from facade_tools.randomness import item_generator
from facade_tools.segmentation.conventions import convention
from facade_tools.segmentation.evaluation import Tally
from facade_tools.segmentation.parsing import raw_labels
from facade_tools.segmentation.patches import ForestOptions
from facade_tools.segmentation.training import TrainOptions, read_pairs, train


def rates(training, test, forest, pixels):
    options = replace(TrainOptions("patch"), forest=forest, pixels=pixels)
    classifier = train(training, options, rng=item_generator(0, "patch-forest"))
    tally, none = Tally(), np.empty((0, 4))
    for pair in test:
        belief = classifier.probabilities(classifier.working(pair.picture))
        found = raw_labels(belief, classifier.classes, pair.labels.shape)
        tally.add(pair.labels, found, none, none)
    return tally


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--convention", default="ecp")
    parser.add_argument("--limit", type=int, default=10**6, help="pictures")
    parser.add_argument("--pixels", type=int, default=600, help="a picture")
    parser.add_argument("--depths", type=int, nargs="*", default=[5, 9, 13, 18, 21])
    parser.add_argument("--patches", type=int, nargs="*", default=[7, 11, 15, 17])
    args = parser.parse_args()
    known = convention(args.convention)
    pairs = list(read_pairs(str(args.data / "images"), str(args.data / "labels"), known))
    pairs = pairs[: args.limit]
    test = pairs[:: max(2, len(pairs) // 10)]
    chosen = {pair.name for pair in test}
    training = [pair for pair in pairs if pair.name not in chosen]
    print("depth patch  overall  " + " ".join(f"{name:>8}" for name in LABELS[1:]))
    settings = [(depth, 15) for depth in args.depths] + [(18, patch) for patch in args.patches]
    for depth, patch in dict.fromkeys(settings):
        tally = rates(training, test, ForestOptions(10, depth, patch), args.pixels)
        shares = " ".join(f"{value:8.3f}" for value in tally.recall())
        print(f"{depth:5} {patch:5}  {tally.accuracy():7.4f}  {shares}", flush=True)


if __name__ == "__main__":
    main()
