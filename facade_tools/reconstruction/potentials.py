"""Potentials of the grammar MRF on a picture of 10 cm cells (KSTTP09 3.2, 3.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats

CELL = 0.1  # m: the discretisation of the paper


@dataclass(frozen=True, slots=True)
class Weights:
    """α of the similarity and β of the difference in size (1/m) in eq. 5; the weight of eq. 8.

    alpha: the similarity is a mean square of colours in 0..1. beta: per metre of difference.
    boundary: of the unary term, whose B is 1 on the strongest line. gap: of eq. 8, per cell.
    """

    alpha: float = 4.0
    beta: float = 0.1
    boundary: float = 0.3
    gap: float = 1.0


def line_differences(picture: Floats) -> Floats:
    """Return the mean square difference of every two lines of a picture (n, m, 3) as (n, n).

    Lines are rows; give the transposed picture to compare columns. Colours in 0..1.
    """
    flat = picture.reshape(len(picture), -1)
    square = np.einsum("ij,ij->i", flat, flat)
    products = flat @ flat.T
    differences: Floats = np.maximum(square[:, None] + square[None] - 2 * products, 0.0)
    return differences / max(flat.shape[1], 1)


def diagonal_sums(table: Floats) -> Floats:
    """Return c (n+1, n+1) with c[i+k, j+k] − c[i, j] = Σ_{t<k} table[i+t, j+t]."""
    n = len(table)
    sums = np.zeros((n + 1, n + 1))
    for i in range(n):
        sums[i + 1, 1:] = sums[i, :-1] + table[i]
    return sums


def similarity(sums: Floats, a: int, size_a: int, b: int, size_b: int) -> float:
    """Return S (eq. 6) of two stretches of lines that begin at `a` and `b`, aligned there.

    Σ of squared differences over the overlap, divided by its size.
    """
    overlap = min(size_a, size_b)
    return float(sums[a + overlap, b + overlap] - sums[a, b]) / overlap


def boundary_strength(picture: Floats) -> Floats:
    """Return B at every border between lines (n+1,): the mean gradient across it, maximum 1.

    The outer borders are 1: the facade ends there.
    """
    steps = np.abs(np.diff(picture, axis=0)).mean(axis=(1, 2))
    top = steps.max(initial=0.0)
    inner = steps / top if top > 1e-9 else np.zeros_like(steps)
    return np.concatenate([[1.0], inner, [1.0]])


def gap_costs(picture: Floats, longest: int) -> Floats:
    """Return G (eq. 8) of every gap as (n + 1, longest + 1): from line i, over k lines.

    picture (n, m, 3), lines are rows, colours in 0..1. The mean square difference of the gap from
    its mirror image plus its variance (mean over channels), times its lines; 0 for no gap, ∞
    beyond the picture.
    """
    flat = np.ascontiguousarray(picture.reshape(len(picture), -1))
    line_mean = picture.mean(axis=1)
    line_square = (picture**2).mean(axis=1)
    return _gap_costs(flat, line_mean, line_square, longest)


@compiled
def _gap_costs(flat: Floats, mean: Floats, square: Floats, longest: int) -> Floats:
    n, width = flat.shape
    table = np.full((n + 1, longest + 1), np.inf)
    table[:, 0] = 0.0
    for i in range(n):
        for k in range(1, min(longest, n - i) + 1):
            mirror = 0.0
            for t in range(k):
                other = i + k - 1 - t
                for c in range(width):
                    d = flat[i + t, c] - flat[other, c]
                    mirror += d * d
            variance = 0.0
            for channel in range(mean.shape[1]):
                m = 0.0
                s = 0.0
                for t in range(k):
                    m += mean[i + t, channel]
                    s += square[i + t, channel]
                variance += s / k - (m / k) * (m / k)
            table[i, k] = mirror / width + k * variance / mean.shape[1]
    return table
