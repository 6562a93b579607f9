"""`parse-image` without training on the data: rows, columns, window boxes, pixels, time, memory.

    python benchmarks/bench_mrf.py DATA [--convention ecp|cmp] [--step N] [--start K] [--sheet PNG]
    python benchmarks/bench_mrf.py DATA --method forest|both [--classifier NPZ]

DATA holds images/ and labels/. Pictures whose windows are no grid (less than 90% of the cells of
rows × columns hold one) are counted apart.
"""

from __future__ import annotations

import argparse
import resource
import time
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from facade_tools.artifacts.parse import LABELS
from facade_tools.grammar.reading import ReadOptions
from facade_tools.imaging.image_io import PICTURES, read_photo
from facade_tools.imaging.label_views import overlay
from facade_tools.reconstruction.mrf import mrf_method
from facade_tools.segmentation.conventions import convention
from facade_tools.segmentation.evaluation import (
    Tally,
    boxes_of_labels,
    boxes_of_regions,
    groups,
    overlaps,
)
from facade_tools.segmentation.parsing import forest_method

WINDOW, WALL = LABELS.index("window"), LABELS.index("wall")


METHODS = {
    "forest": forest_method,
    "mrf": mrf_method,
    "both": lambda options: forest_method(options, second=partial(mrf_method, options)),
}


def pairs(data, kind, start, step):
    known = convention(kind)
    for path in sorted((data / "images").iterdir())[start::step]:
        if path.suffix.lower() in PICTURES:
            labels = known.read(str(data / "labels" / f"{path.stem}.png"))
            yield path.stem, read_photo(str(path)), labels


def lines_of(boxes, axis):
    """Return the mean intervals (k, 2) of the groups of boxes along an axis that count."""
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    boxes = boxes[area >= np.median(area) / 4]
    boxes = boxes[np.argsort(boxes[:, axis] + boxes[:, axis + 2])]
    centres = (boxes[:, axis] + boxes[:, axis + 2]) / 2
    gap = np.median(boxes[:, axis + 2] - boxes[:, axis]) / 2
    parts = np.split(boxes, np.flatnonzero(np.diff(centres) > gap) + 1)
    most = max(map(len, parts))
    return np.array([p[:, [axis, axis + 2]].mean(axis=0) for p in parts if len(p) > most / 2])


def grid_share(boxes):
    """Return the share of cells of rows × columns that hold a window."""
    if len(boxes) < 2:
        return 0.0
    rows, columns = lines_of(boxes, 1), lines_of(boxes, 0)
    cells = np.array([(x0, y0, x1, y1) for y0, y1 in rows for x0, x1 in columns])
    return float((overlaps(cells, boxes).max(axis=1) > 0.15).mean())


def split(truth, found):
    """Return pixels of windows and walls that are right, and all of them."""
    known = (truth == WINDOW) | (truth == WALL)
    return int(((truth == WINDOW) == (found == WINDOW))[known].sum()), int(known.sum())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--convention", default="ecp")
    parser.add_argument("--step", type=int, default=1, help="every N-th picture")
    parser.add_argument("--sheet", type=Path, help="overlays of the first 24 pictures")
    parser.add_argument("--bad", action="store_true", help="name what is wrong; sheet shows these")
    parser.add_argument("--start", type=int, default=0, help="the first picture")
    parser.add_argument("--method", choices=list(METHODS), default="mrf")
    parser.add_argument("--classifier", help="of forest and both; the shipped one without it")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    read = METHODS[args.method](ReadOptions(args.classifier))
    every, grid, tiles, times = Tally(), Tally(), [], []
    right = whole = constant = 0
    for name, photo, truth in pairs(args.data, args.convention, args.start, args.step):
        start = time.process_time()
        reading = read(photo, name, rng=np.random.default_rng(0))
        times.append(time.process_time() - start)
        real, boxes = boxes_of_labels(truth), boxes_of_regions(reading.parse.regions)
        every.add(truth, reading.labels, real, boxes)
        if grid_share(real) >= 0.9:
            grid.add(truth, reading.labels, real, boxes)
        good, known = split(truth, reading.labels)
        right, whole, constant = right + good, whole + known, constant + (groups(real, 1) == 6)
        counts = [(groups(real, axis), groups(boxes, axis)) for axis in (1, 0)]
        wrong = any(a != b for a, b in counts)
        if args.bad and wrong:
            print(name, "rows", counts[0], "columns", counts[1])
        if args.sheet and len(tiles) < 24 and (wrong or not args.bad):
            tiles.append(cv2.resize(overlay(photo.pixels, reading.parse), (260, 360)))
    for title, tally in (("all", every), ("grids", grid)):
        print(
            f"{title:6} {tally.pictures:4} pictures: rows {tally.rows_right():.3f}, "
            f"columns {tally.columns_right():.3f}, window boxes F1 {tally.f1():.3f}"
        )
    print(f"constant answer 6 rows: {constant / max(every.pictures, 1):.3f}")
    print(f"window/wall pixels right: {right / max(whole, 1):.4f}")
    print(f"all pixels right: {every.accuracy(True):.4f}, mean IoU {every.mean_iou(True):.3f}")
    print(f"CPU s an image: median {np.median(times):.3f}, most {max(times[1:], default=0):.3f}")
    print(f"peak memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")
    if args.sheet and tiles:
        tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % 6)
        sheet = np.vstack([np.hstack(tiles[i : i + 6]) for i in range(0, len(tiles), 6)])
        cv2.imwrite(str(args.sheet), sheet[:, :, ::-1])


if __name__ == "__main__":
    main()
