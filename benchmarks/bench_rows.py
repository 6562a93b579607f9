"""Rows of windows of parses, counted in other ways than ours, and on disturbed copies.

    python benchmarks/bench_rows.py DATA --work FOLDER [--grammar haussmann-floors] [--copies N]

FOLDER holds the classifiers that `facade_parsing.py DATA --work FOLDER` has trained: each picture
is read by that of its fold. The annotation's windows are counted in the same way as the parse's,
and beside them stands the share of pictures on which one constant answer would be right.
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from facade_parsing import FOLDS, folds_of
from threadpoolctl import threadpool_limits

from facade_tools.grammar.library import builtin
from facade_tools.grammar.plan import plan
from facade_tools.segmentation import dp
from facade_tools.segmentation.augmentation import varied
from facade_tools.segmentation.bare_roofs import Seen
from facade_tools.segmentation.classifier import load
from facade_tools.segmentation.conventions import convention
from facade_tools.segmentation.deriving import Frame, regions_of
from facade_tools.segmentation.energy import field_of
from facade_tools.segmentation.evaluation import boxes_of_labels, boxes_of_regions, groups
from facade_tools.segmentation.finishing import finished
from facade_tools.segmentation.training import read_pairs

SHARES = (0.0, 0.1, 0.15, 0.2, 0.25, 0.3)


class Count(NamedTuple):
    """A way to count rows by grouping the centres of windows.

    area: of the smallest window, pixels. fragments: of the median area, less is left out. gap:
    between rows, median heights. few: windows of the smallest row. share: of the largest row's
    windows, more make a row.
    """

    area: float = 0
    fragments: float = 0.25
    gap: float = 0.5
    few: int = 1
    share: float = 0.5

    def rows(self, boxes):
        """Return the number of rows."""
        area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
        least = self.fragments * np.median(area) if len(area) else 0
        boxes = boxes[area >= max(self.area, least)]
        if not len(boxes):
            return 0
        centres = np.sort((boxes[:, 1] + boxes[:, 3]) / 2)
        gap = self.gap * np.median(boxes[:, 3] - boxes[:, 1])
        sizes = np.bincount(np.cumsum(np.diff(centres, prepend=centres[0]) > gap))
        return int(((sizes >= self.few) & (sizes > self.share * sizes.max())).sum())


def others():
    """Yield simple counts: a least area or share, a gap, a least number or share of windows."""
    left_out = [(area, 0.0) for area in (0, 50, 75, 100, 120, 150)]
    left_out += [(0, share) for share in SHARES[1:]]
    many = [(1, 0.0), (2, 0.0), (3, 0.0), (1, 0.25), (1, 0.33), (1, 0.5)]
    for (area, share), gap, (few, most) in product(left_out, (0.33, 0.5, 0.6, 0.75, 1.0), many):
        yield Count(area, share, gap, few, most)


def measured(count, pairs):
    """Return the share of pictures that parses, and the best constant answer, have right."""
    truth, found = np.array([[count.rows(boxes) for boxes in pair] for pair in pairs]).T
    return np.mean(truth == found), np.bincount(truth).max() / len(truth)


def parsed(classifier, made, picture, shape):
    """Return the boxes of the windows of a parse."""
    working = classifier.working(picture)
    belief = classifier.probabilities(working)
    layout = dp.solve(field_of(belief, classifier.classes, made), made).layout
    seen = Seen(belief, classifier.classes, np.zeros(belief.shape[1:], bool))
    tree = finished(made, layout, seen, Frame(working.shape[:2], shape), dp.solve)
    return boxes_of_regions(regions_of(tree))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--convention", default="ecp")
    parser.add_argument("--work", type=Path, default=Path("build/facade_parsing"))
    parser.add_argument("--grammar", default="haussmann-floors")
    parser.add_argument("--copies", type=int, default=0, help="disturbed copies a picture")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    threadpool_limits(1)  # as the command line does
    made = plan(builtin(args.grammar))
    names = convention(args.convention)
    pairs = list(read_pairs(str(args.data / "images"), str(args.data / "labels"), names))
    own, copies = [], []
    for fold in range(FOLDS):
        classifier = load(str(args.work / f"{args.data.name}-context-{fold}.npz"))
        for pair in (p for p, f in zip(pairs, folds_of(pairs, FOLDS), strict=True) if f == fold):
            shape = pair.labels.shape
            boxes = parsed(classifier, made, pair.picture, shape)
            own.append((boxes_of_labels(pair.labels), boxes))
            if groups(own[-1][0], 1) != groups(boxes, 1):
                print(f"{pair.name}: {groups(own[-1][0], 1)} rows, parsed {groups(boxes, 1)}")
            for number in range(args.copies):
                rng = np.random.default_rng([number, fold, len(pair.name)])
                picture, labels = varied(pair.picture, pair.labels, rng=rng)
                found = parsed(classifier, made, picture, shape)
                copies.append((boxes_of_labels(labels), found))
    for share in SHARES:
        right, constant = measured(Count(fragments=share), own)
        print(f"fragments below {share:.2f} left out: {right:.3f}, a constant {constant:.3f}")
    same = measured(Count(), own)[1]
    alike = [(measured(count, own), count) for count in others()]
    alike = sorted((right, count) for (right, constant), count in alike if constant == same)
    print(f"{len(alike)} other counts with the constant {same:.3f}:")
    for right, count in alike:
        print(f"  {right:.3f} {count}")
    if copies:
        right, constant = measured(Count(), copies)
        print(f"{len(copies)} disturbed copies: {right:.3f}, a constant {constant:.3f}")


if __name__ == "__main__":
    main()
