"""Facade parsing by folds: raw classifier, dp and walk, from a folder of images and label maps.

    python benchmarks/facade_parsing.py DATA [--convention ecp] [--folds 5] [--work FOLDER]
    python benchmarks/facade_parsing.py DATA --convention cmp --grammars plain --limit 60 --only 0

DATA holds images/ and labels/. Trained classifiers are kept in --work and used again.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from threadpoolctl import threadpool_limits

from facade_tools.artifacts.parse import LABELS
from facade_tools.grammar.derivation import painted
from facade_tools.grammar.library import builtin
from facade_tools.grammar.plan import plan
from facade_tools.grammar.reading import label_index
from facade_tools.randomness import item_generator
from facade_tools.segmentation import dp, walk
from facade_tools.segmentation.bare_roofs import Seen
from facade_tools.segmentation.classifier import load, save
from facade_tools.segmentation.conventions import convention
from facade_tools.segmentation.deriving import Frame, regions_of
from facade_tools.segmentation.energy import field_of
from facade_tools.segmentation.evaluation import Tally, boxes_of_labels, boxes_of_regions
from facade_tools.segmentation.finishing import finished
from facade_tools.segmentation.parsing import raw_labels
from facade_tools.segmentation.training import TrainOptions, load_start, read_pairs, train

GRAMMARS = ("haussmann", "haussmann-floors")
FOLDS = 5


def folds_of(pairs, folds):
    """Return the fold of every picture."""
    return item_generator(0, "folds").permutation(len(pairs)) % folds


def trained(path, pairs, options, fold):
    if not path.exists():
        start = time.process_time()
        path.write_bytes(save(train(pairs, options, rng=item_generator(0, "train", fold))))
        print(f"fold {fold}: trained in {time.process_time() - start:.0f} s of CPU", flush=True)
    return load(str(path))


def measure(pair, classifier, plans, walks, tallies, times):
    shape = pair.labels.shape
    start, clock = time.process_time(), time.perf_counter()
    working = classifier.working(pair.picture)
    belief = classifier.probabilities(working)
    times["classifier clock"].append(time.perf_counter() - clock)
    times["classifier"].append(time.process_time() - start)
    truth = boxes_of_labels(pair.labels)
    raw = raw_labels(belief, classifier.classes, shape)
    tallies["raw"].add(pair.labels, raw, truth, boxes_of_labels(raw))
    for name, made in plans.items():
        field = field_of(belief, classifier.classes, made)
        solvers = {"dp": lambda f, p: dp.solve(f, p)}
        if walks:
            rng = item_generator(0, "walk", pair.name)
            solvers["walk"] = lambda f, p, rng=rng: walk.solve(f, p, rng=rng)
        for solver, solve in solvers.items():
            start = time.process_time()
            solution = solve(field, made)
            times[f"{solver} {name}"].append(time.process_time() - start)
            times[f"{solver} {name} energy"].append(solution.energy)
            frame = Frame(working.shape[:2], shape)
            seen = Seen(belief, classifier.classes, np.zeros(belief.shape[1:], bool))
            tree = finished(made, solution.layout, seen, frame, solve)
            labels = painted(tree, shape, label_index())
            key = f"{solver} {name}"
            tallies[key].add(pair.labels, labels, truth, boxes_of_regions(regions_of(tree)))


def warm_up(pair, classifier, plans):
    """Load what is compiled, which no picture's time shall hold."""
    belief = classifier.probabilities(classifier.working(pair.picture))
    for made in plans.values():
        dp.solve(field_of(belief, classifier.classes, made), made)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--convention", default="ecp")
    parser.add_argument("--folds", type=int, default=FOLDS)
    parser.add_argument("--only", type=int, nargs="*", help="these folds alone")
    parser.add_argument("--features", default="context")
    parser.add_argument("--classifier", help="test this one on everything instead of training")
    parser.add_argument("--start", help="classifier of other pictures whose networks go on")
    parser.add_argument("--steps", type=int, help="views of the network, else as by default")
    parser.add_argument("--work", type=Path, default=Path("build/facade_parsing"))
    parser.add_argument("--no-walk", action="store_true")
    parser.add_argument("--grammars", nargs="*", default=GRAMMARS, help="none: pixels alone")
    parser.add_argument("--limit", type=int, default=10**6, help="pictures, spread over the set")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    threadpool_limits(1)  # as the command line does
    args.work.mkdir(parents=True, exist_ok=True)
    images, labels = str(args.data / "images"), str(args.data / "labels")
    pairs = list(read_pairs(images, labels, convention(args.convention)))
    pairs = pairs[:: max(1, len(pairs) // args.limit)][: args.limit]
    folds = folds_of(pairs, args.folds)
    start = load_start(args.start) if args.start else None
    options = replace(TrainOptions(), features=args.features, start=start)
    if args.steps is not None:
        options = replace(options, network=replace(options.network, steps=args.steps))
    plans = {name: plan(builtin(name)) for name in args.grammars}
    solvers = ("dp",) if args.no_walk else ("dp", "walk")
    keys = ["raw", *(f"{s} {g}" for s in solvers for g in args.grammars)]
    tallies = {key: Tally() for key in keys}
    times = {
        key: []
        for key in ["classifier", "classifier clock", *keys[1:], *(f"{k} energy" for k in keys[1:])]
    }
    for fold in range(args.folds) if args.only is None else args.only:
        rest = [pair for pair, f in zip(pairs, folds, strict=True) if f != fold]
        test = [pair for pair, f in zip(pairs, folds, strict=True) if f == fold]
        if args.classifier:
            classifier = load(args.classifier)
        else:
            path = args.work / f"{args.data.name}-{args.features}-{fold}.npz"
            classifier = trained(path, rest, options, fold)
        if not times["classifier"]:
            warm_up(test[0], classifier, plans)
        for pair in test:
            measure(pair, classifier, plans, not args.no_walk, tallies, times)
        print(f"after fold {fold}, {tallies['raw'].pictures} pictures:", flush=True)
        report(tallies, times, args.grammars)


def report(tallies, times, grammars):
    print(f"{'':24} acc7   acc8   mIoU7  mIoU8  F1 win rows  cols   s/image  recall by class")
    for key, tally in tallies.items():
        recall = " ".join(f"{v:.2f}" for v in tally.recall(fold_chimney=True))
        spent = np.mean(times["classifier" if key == "raw" else key])
        print(
            f"{key:24} {tally.accuracy(fold_chimney=True):.4f} {tally.accuracy():.4f} "
            f"{tally.mean_iou(fold_chimney=True):.4f} {tally.mean_iou():.4f} {tally.f1():.4f} "
            f"{tally.rows_right():.3f} {tally.columns_right():.3f}  {spent:.3f}    {recall}"
        )
    print("classes:", " ".join(LABELS[1:8]))
    clock = times["classifier clock"]
    print(f"classifier by the clock: mean {np.mean(clock):.2f} s, largest {max(clock):.2f} s")
    for grammar in grammars:
        exact, walked = (np.array(times.get(f"{s} {grammar} energy", [])) for s in ("dp", "walk"))
        spent, long = (np.array(times.get(f"{s} {grammar}", [])) for s in ("dp", "walk"))
        print(f"{grammar}: dp's largest {max(spent):.3f} s of CPU")
        if len(walked):
            share = np.mean(exact <= walked + 1e-6)
            print(f"{grammar}: dp's energy at most the walk's on {share:.1%} of {len(exact)}")
            print(f"{grammar}: dp {long.sum() / spent.sum():.1f} times as fast as the walk")
    print("confusion (rows truth, columns raw):")
    print(tallies["raw"].confusion, flush=True)


if __name__ == "__main__":
    main()
