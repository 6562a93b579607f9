"""Context features: what an earlier stage of the classifier believes around a pixel."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from .features import Features, Plane, blurred, boxed, shifted, stacked

Probabilities = NDArray[np.float32]  # (classes, height, width), sums to 1 over the classes

BLURS = (2.0, 6.0)  # pixels
RUNS = (31, 101)  # pixels
STEPS = (5, 10, 20, 36, 60)  # pixels
GAIN = np.float32(255.0)
PROFILE = 8  # pixels of a row or column that are averaged where lines are compared
ALIKE = np.float32(0.15)  # of the mean squared distance of two lines: those count as alike


def context_features(probabilities: Probabilities) -> Features:
    """Return the planes of context of class probabilities (auto-context).

    For each class: the pixel's own, blurred, of its row and column, of neighbours, and how much
    of the class lies above and below.

    >>> context_features(np.full((2, 4, 6), 0.5, np.float32)).shape[1:]
    (4, 6)
    """
    out: Features | None = None
    for k, one in enumerate(probabilities):
        # class by class: the planes of one are in memory as floats at a time
        planes: list[Plane | Features] = [GAIN * plane for plane in _planes(one)]
        planes += _neighbours(one)
        if out is None:
            out = np.empty((len(probabilities), len(planes), *one.shape), np.uint8)
        stacked(planes, out[k])
    assert out is not None
    return out.reshape(-1, *out.shape[2:])


def belief_features(probabilities: Probabilities) -> Features:
    """Return beliefs as planes of bytes."""
    return stacked([GAIN * one for one in probabilities])


def repeated(probabilities: Probabilities) -> list[Probabilities]:
    """Return beliefs averaged over columns that are alike, rows that are alike, and both.

    A facade repeats: what hides one window, or blurs its edge, is told by the others of its row
    and column. Lines weigh exp(−d²/(0.15 · mean d²)) with d the distance of their beliefs.

    >>> [one.shape for one in repeated(np.full((2, 4, 6), 0.5, np.float32))]
    [(2, 4, 6), (2, 4, 6), (2, 4, 6)]
    """
    upright = _likeness(probabilities)
    lying = _likeness(np.ascontiguousarray(probabilities.transpose(0, 2, 1)))
    across = probabilities @ upright.T
    return [across, lying @ probabilities, lying @ across]


def _likeness(probabilities: Probabilities) -> NDArray[np.float32]:
    """Return (width, width) weights of columns in the average of each column."""
    _, height, width = probabilities.shape
    size = (width, max(1, height // PROFILE))
    short = [cv2.resize(one, size, interpolation=cv2.INTER_AREA) for one in probabilities]
    lines = np.concatenate(short).T.astype(np.float32)
    square = (lines * lines).sum(axis=1)
    distance = np.maximum(square[:, None] + square - 2 * (lines @ lines.T), 0)
    weight = np.exp(-distance / np.maximum(ALIKE * distance.mean(), np.float32(1e-6)))
    shares: NDArray[np.float32] = weight / weight.sum(axis=1, keepdims=True)
    return shares


def _planes(one: Plane) -> Iterator[Plane]:
    yield one
    for sigma in BLURS:
        yield blurred(one, sigma)
    for run in RUNS:
        yield boxed(one, (run, 3))
        yield boxed(one, (3, run))
    yield from _lines(one)
    yield from _sides(one)


def _neighbours(one: Plane) -> Iterator[Features]:
    """Yield planes of bytes: they are moved as such, a quarter of the memory."""
    smooth = stacked([GAIN * boxed(one, (3, 3))])[0]
    for step in STEPS:
        for dx, dy in ((step, 0), (-step, 0), (0, step), (0, -step)):
            yield shifted(smooth, dx, dy)


def _lines(one: Plane) -> Iterator[Plane]:
    rows = one.mean(1, keepdims=True)
    columns = one.mean(0, keepdims=True)
    yield np.broadcast_to(rows, one.shape)
    yield np.broadcast_to(columns, one.shape)
    yield np.broadcast_to(one.max(1, keepdims=True), one.shape)
    # a window is where a row of windows crosses a column of them
    peak = max(float(rows.max()), 1e-6) * max(float(columns.max()), 1e-6)
    yield rows * columns / np.float32(peak)
    yield np.broadcast_to(np.float32(one.mean()), one.shape)


def _sides(one: Plane) -> Iterator[Plane]:
    """Share of the column, and of the rows, above the pixel."""
    height = np.float32(one.shape[0])
    above = np.cumsum(one, axis=0, dtype=np.float32)
    yield above / height
    yield (above[-1:] - above) / height
    rows = np.cumsum(one.mean(1, keepdims=True), axis=0, dtype=np.float32)
    yield np.broadcast_to(rows / height, one.shape)
    yield np.broadcast_to((rows[-1:] - rows) / height, one.shape)
