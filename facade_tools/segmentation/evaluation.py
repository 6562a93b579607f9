"""How well a parse agrees with a label map: pixels, window boxes, rows and columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS, Region

Boxes = NDArray[np.float64]  # (n, 4) x0, y0, x1, y1, half-open pixels

WINDOW, SKY, CHIMNEY = LABELS.index("window"), LABELS.index("sky"), LABELS.index("chimney")
LEAST_AREA = 30  # pixels of a component that counts as a window
SAME = 0.5  # IoU of a window that is found


def confusion(truth: NDArray[np.uint8], found: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return pixel counts, rows truth and columns found; truth 0 is ignored."""
    known = truth > 0
    pairs = truth[known].astype(np.int64) * len(LABELS) + found[known]
    return np.bincount(pairs, minlength=len(LABELS) ** 2).reshape(len(LABELS), -1)


def boxes_of_mask(mask: NDArray[np.bool_], least: int) -> Boxes:
    """Return the bounding boxes of the connected parts of a mask of at least `least` pixels."""
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    x, y, width, height, area = stats[1:].T
    boxes = np.stack([x, y, x + width, y + height], axis=1).astype(np.float64)
    kept: Boxes = boxes[area >= least]
    return kept


def boxes_of_labels(labels: NDArray[np.uint8]) -> Boxes:
    """Return the bounding boxes of the connected components of window pixels.

    Annotated rectangles that lie on each other leave lines one pixel high, some 25 pixels long,
    which are no windows.
    """
    return boxes_of_mask(labels == WINDOW, LEAST_AREA)


def boxes_of_regions(regions: Sequence[Region]) -> Boxes:
    """Return the windows of a parse."""
    rows = [(r.x0, r.y0, r.x1, r.y1) for r in regions if r.label == "window"]
    return np.array(rows, np.float64).reshape(-1, 4)


def overlaps(one: Boxes, other: Boxes) -> NDArray[np.float64]:
    """Return the intersection over union of every pair, (n, m)."""
    low = np.maximum(one[:, None, :2], other[None, :, :2])
    high = np.minimum(one[:, None, 2:], other[None, :, 2:])
    inside = np.prod(np.clip(high - low, 0, None), axis=2)
    areas = [np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) for boxes in (one, other)]
    union = areas[0][:, None] + areas[1][None] - inside
    shares: NDArray[np.float64] = inside / np.maximum(union, 1e-9)
    return shares


def matched(truth: Boxes, found: Boxes) -> int:
    """Return how many boxes meet one to one with at least the IoU that counts (an assignment)."""
    from scipy.optimize import linear_sum_assignment

    if not len(truth) or not len(found):
        return 0
    hits = overlaps(truth, found) >= SAME
    rows, columns = linear_sum_assignment(~hits)
    return int(hits[rows, columns].sum())


def groups(boxes: Boxes, axis: int) -> int:
    """Return the number of rows (axis 1) or columns (axis 0) by grouping the boxes' centres.

    A gap of more than half of the median size along the axis separates two groups. Fragments (less
    than a quarter of the median area) and groups of at most half as many windows as the largest
    (a shop's windows, those of a staircase) do not count.
    """
    if not len(boxes):
        return 0
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    boxes = boxes[area >= np.median(area) / 4]
    centres = np.sort((boxes[:, axis] + boxes[:, axis + 2]) / 2)
    gap = np.median(boxes[:, axis + 2] - boxes[:, axis]) / 2
    sizes = np.bincount(np.cumsum(np.diff(centres, prepend=centres[0]) > gap))
    return int((sizes > sizes.max() / 2).sum())


@dataclass
class Tally:
    """Sums over pictures."""

    confusion: NDArray[np.int64] = field(
        default_factory=lambda: np.zeros((len(LABELS), len(LABELS)), np.int64)
    )
    hits: int = 0
    truths: int = 0
    founds: int = 0
    rows: int = 0
    columns: int = 0
    pictures: int = 0

    def add(
        self, truth: NDArray[np.uint8], found: NDArray[np.uint8], real: Boxes, boxes: Boxes
    ) -> None:
        """Count one picture: label maps, and boxes of windows."""
        self.confusion += confusion(truth, found)
        self.hits += matched(real, boxes)
        self.truths += len(real)
        self.founds += len(boxes)
        self.rows += groups(real, 1) == groups(boxes, 1)
        self.columns += groups(real, 0) == groups(boxes, 0)
        self.pictures += 1

    def table(self, fold_chimney: bool = False) -> NDArray[np.int64]:
        """Return the confusion of classes 1…8, or 1…7 with chimneys counted as sky."""
        table = self.confusion.copy()
        if fold_chimney:
            table[SKY] += table[CHIMNEY]
            table[:, SKY] += table[:, CHIMNEY]
            table = table[:CHIMNEY, :CHIMNEY]
        return table[1:]

    def accuracy(self, fold_chimney: bool = False) -> float:
        """Return the share of labelled pixels that are right."""
        table = self.table(fold_chimney)
        return float(np.trace(table[:, 1:]) / max(table.sum(), 1))

    def recall(self, fold_chimney: bool = False) -> NDArray[np.float64]:
        """Return the share of each class's pixels that is right; NaN for absent classes."""
        table = self.table(fold_chimney)
        total = table.sum(axis=1)
        return np.where(total > 0, np.diag(table[:, 1:]) / np.maximum(total, 1), np.nan)

    def mean_iou(self, fold_chimney: bool = False) -> float:
        """Return the mean intersection over union of the classes that occur."""
        table = self.table(fold_chimney)
        right = np.diag(table[:, 1:])
        union = table.sum(axis=1) + table[:, 1:].sum(axis=0) - right
        present = table.sum(axis=1) > 0
        return float(np.mean(right[present] / union[present]))

    def f1(self) -> float:
        """Return the F1 of window boxes at IoU 0.5."""
        return 2 * self.hits / max(self.truths + self.founds, 1)

    def rows_right(self) -> float:
        """Return the share of pictures whose number of rows of windows is right."""
        return self.rows / max(self.pictures, 1)

    def columns_right(self) -> float:
        """Return the share of pictures whose number of columns of windows is right."""
        return self.columns / max(self.pictures, 1)
