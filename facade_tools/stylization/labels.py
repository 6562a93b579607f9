"""Windows and walls told apart in a variance signal, and the rule that they make (LNSW13 4.3)."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.arrays import Booleans, Floats
from .splitting import SplitRule

SMOOTHNESS = 0.025  # λ of eq. 3


def variance_signal(picture: NDArray[Any], axis: int) -> Floats:
    """Return the variance of colour along `axis` for every place of the other one, maximum 1.

    picture: (h, w, 3), colours in 0..1 or 8 bits. axis 0 gives one value a column (n = w). The
    variance is the mean over the channels; a signal without variance is all zero (CONTRACT).
    """
    colours = np.asarray(picture, dtype=np.float64)
    if np.asarray(picture).dtype == np.uint8:
        colours = colours / 255
    signal: Floats = colours.var(axis=axis).mean(axis=-1)
    top = signal.max(initial=0.0)
    return signal / top if top > 1e-12 else np.zeros_like(signal)


def two_means(signal: Floats) -> tuple[float, float]:
    """Return the two cluster centres (low, high) that split the sorted signal best.

    In one dimension 2-means is solved exactly by trying every cut of the sorted values.
    """
    values = np.sort(signal)
    count = np.arange(1, len(values))
    sums, squares = np.cumsum(values), np.cumsum(values**2)
    left = squares[:-1] - sums[:-1] ** 2 / count
    rest = sums[-1] - sums[:-1]
    right = squares[-1] - squares[:-1] - rest**2 / (len(values) - count)
    cut = int(np.argmin(left + right)) + 1
    return float(values[:cut].mean()), float(values[cut:].mean())


def insertable_labels(signal: Floats, smoothness: float = SMOOTHNESS) -> Booleans:
    """Label every place insertable (True) or scalable by the exact minimum of eq. 3 to 5.

    signal: (n,) in 0..1. Returns (n,). Ties are scalable.
    """
    if len(signal) < 2 or signal.max() - signal.min() < 1e-9:
        return np.zeros(len(signal), dtype=bool)
    low, high = two_means(signal)
    cost = np.stack([np.abs(signal - low), np.abs(signal - high)])
    return _least_path(cost, smoothness)


def _least_path(cost: Floats, smoothness: float) -> Booleans:
    """Return the labels of least Σ cost[label_i, i] + smoothness·(number of changes)."""
    n = cost.shape[1]
    stays = np.empty((2, n), dtype=bool)
    total = cost[:, 0].copy()
    for i in range(1, n):
        change = total[::-1] + smoothness
        stays[:, i] = total <= change
        total = np.minimum(total, change) + cost[:, i]
    labels = np.empty(n, dtype=bool)
    state = int(total[1] < total[0])
    for i in range(n - 1, -1, -1):
        labels[i] = bool(state)
        if i and not stays[state, i]:
            state = 1 - state
    return labels


def merged(labels: Booleans, least: float, gap: float | None = None) -> Booleans:
    """Drop insertable runs shorter than half of `least` places: fragments of a window, or noise.

    A gap shorter than half of `gap` (if not given, of `least`) between two insertable runs is
    closed first, so that a window with a mullion stays one window.
    """
    out = labels.copy()
    for value, limit in ((False, least if gap is None else gap), (True, least)):
        for start, end in _runs(out, value):
            inside = value or (start > 0 and end < len(out))
            if end - start < limit / 2 and inside:
                out[start:end] = not value
    return out


def _runs(labels: Booleans, value: bool) -> list[tuple[int, int]]:
    padded = np.concatenate([[False], labels == value, [False]])
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def rule_of(labels: Booleans, size: float) -> SplitRule:
    """Return the rule of labelled places that together measure `size` metres."""
    place = size / max(len(labels), 1)
    windows = _runs(labels, True)
    borders = [0, *(edge for run in windows for edge in run), len(labels)]
    widths = [place * (b - a) for a, b in itertools.pairwise(borders)]
    return SplitRule(tuple(widths[::2]), tuple(widths[1::2]))
