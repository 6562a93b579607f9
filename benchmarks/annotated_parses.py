"""Parses from annotated pictures: label maps forced into a grammar of floors.

    python benchmarks/annotated_parses.py DATA [--convention ecp] [--limit N] -o parses.jsonl
    python benchmarks/annotated_parses.py DATA --convention cmp --void sky -o parses.jsonl

DATA holds images/ and labels/. Nine tenths of the belief of a pixel go to its label. CMP calls
what is not the facade, mostly sky, background.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.parse import LABELS, ImageInfo, Parse
from facade_tools.errors import FacadeError
from facade_tools.grammar.library import builtin
from facade_tools.grammar.plan import plan
from facade_tools.imaging.image_io import read_photo
from facade_tools.segmentation import dp
from facade_tools.segmentation.conventions import convention
from facade_tools.segmentation.deriving import Frame, derivation, floors_of, regions_of
from facade_tools.segmentation.energy import field_of

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ROWS, PIXELS = 288, 160_000
CLASSES = LABELS[1:]


def parse_of(photo, labels, identity, made, grammar):
    height, width = labels.shape
    scale = min(1.0, ROWS / height, (PIXELS / (height * width)) ** 0.5)
    size = (round(width * scale), round(height * scale))
    small = cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST)
    belief = np.full((len(CLASSES), *small.shape), 0.1 / (len(CLASSES) - 1), np.float32)
    for k in range(len(CLASSES)):
        belief[k][small == k + 1] = 0.9
    belief[:, small == 0] = 1 / len(CLASSES)
    solution = dp.solve(field_of(belief, CLASSES, made), made)
    tree = derivation(made, solution.layout, Frame(small.shape, labels.shape))
    floors = floors_of(tree)
    return Parse(
        identity, ImageInfo(photo.name, (width, height), photo.sha256), IDENTITY, "annotation",
        "dp", grammar, "", float(solution.energy), size, regions_of(tree), floors,
        max((floor.columns for floor in floors), key=len, default=()), derivation=tree,
    )  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--convention", default="ecp")
    parser.add_argument("--grammar", default="haussmann-floors")
    parser.add_argument("--void", default="outlier", help="label of pixels without a class")
    parser.add_argument("--limit", type=int, default=10**6)
    parser.add_argument("-o", "--output", type=Path, required=True)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    made, classes = plan(builtin(args.grammar)), convention(args.convention)
    pictures = sorted((args.data / "images").iterdir())
    pictures = pictures[:: max(1, len(pictures) // args.limit)][: args.limit]
    with args.output.open("wb") as file:
        for path in pictures:
            labels = classes.read(str(args.data / "labels" / f"{path.stem}.png"))
            labels[labels == 0] = LABELS.index(args.void)
            try:
                parse = parse_of(read_photo(str(path)), labels, path.stem, made, args.grammar)
            except FacadeError as error:
                print(f"{path.name}: {error}")
                continue
            file.write(dump_line(encode(parse)))


if __name__ == "__main__":
    main()
