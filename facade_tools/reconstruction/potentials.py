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
    boundary: of the unary term (eq. 7), whose B is 1 on the strongest line. gap: of eq. 8, per
    cell. content: of the evidence of windows inside an element, per cell.
    """

    alpha: float = 4.0
    beta: float = 0.1
    boundary: float = 0.3
    gap: float = 1.0
    content: float = 0.0


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


def labels(n: int, first: tuple[int, int], other: tuple[int, int]) -> Floats:
    """Return the label set as (n+1, widest+1): 0 for an allowed (start, size), ∞ elsewhere.

    first: least and greatest size (cells) of an element that starts at line 0; other: of the rest.
    """
    table = np.full((n + 1, max(first[1], other[1]) + 1), np.inf)
    for start in range(n):
        low, high = first if start == 0 else other
        table[start, low : min(high, n - start) + 1] = 0.0
    return table


def boundary_costs(strength: Floats, widest: int) -> Floats:
    """Return −(B(start) + B(start + size)) of every label (n+1, widest+1) (eq. 7, both borders)."""
    n = len(strength) - 1
    ends = np.minimum(np.arange(n + 1)[:, None] + np.arange(widest + 1), n)
    costs: Floats = -(strength[:, None] + strength[ends])
    return costs


@compiled
def band_contents(evidence: Floats, widest: int) -> Floats:
    """Return what a band of windows explains in every element, (n+1, widest+1).

    evidence (n,): positive where a line holds windows. The sum over the best run of lines inside
    the element, less the positive evidence that it leaves out.
    """
    n = len(evidence)
    table = np.zeros((n + 1, widest + 1))
    for start in range(n):
        best = run = left = 0.0
        for size in range(1, min(widest, n - start) + 1):
            value = evidence[start + size - 1]
            above = max(value, 0.0)
            left += above
            run = max(run, 0.0) + value + above
            best = max(best, run)
            table[start, size] = best - left
    return table


@compiled
def best_band(evidence: Floats) -> tuple[int, int]:
    """Return the run of lines (start, stop) that `band_contents` finds; (0, 0) where none pays."""
    best = run = 0.0
    start = low = high = 0
    for i in range(len(evidence)):
        if run <= 0.0:
            run, start = 0.0, i
        run += evidence[i] + max(evidence[i], 0.0)
        if run > best:
            best, low, high = run, start, i + 1
    return low, high


def run_contents(evidence: Floats, widest: int) -> Floats:
    """Return Σ of the evidence over every element, (n+1, widest+1); 0 beyond the picture."""
    n = len(evidence)
    prefix = np.concatenate([[0.0], np.cumsum(evidence)])
    ends = np.minimum(np.arange(n + 1)[:, None] + np.arange(widest + 1), n)
    sums: Floats = prefix[ends] - prefix[:, None]
    return sums


def gap_costs(picture: Floats, longest: int) -> Floats:
    """Return G (eq. 8) of every gap as (n + 1, longest + 1): from line i, over k lines.

    picture (n, m, 3), lines are rows, colours in 0..1. The mean square difference of the gap from
    its mirror image plus its variance (mean over channels), times its lines; 0 for no gap, ∞
    beyond the picture.
    """
    n = len(picture)
    mirror = _mirror_sums(line_differences(picture), longest)
    mean = np.concatenate(
        [np.zeros((1, picture.shape[2])), np.cumsum(picture.mean(axis=1), axis=0)]
    )
    square = np.concatenate(
        [np.zeros((1, picture.shape[2])), np.cumsum((picture**2).mean(axis=1), axis=0)]
    )
    table = np.full((n + 1, longest + 1), np.inf)
    table[:, 0] = 0.0
    for k in range(1, min(longest, n) + 1):
        sums = mean[k:] - mean[:-k]
        spread = (square[k:] - square[:-k]) - sums**2 / k  # k · variance
        table[: n + 1 - k, k] = mirror[: n + 1 - k, k] + np.maximum(spread, 0.0).mean(axis=1)
    return table


@compiled
def _mirror_sums(differences: Floats, longest: int) -> Floats:
    """Return Σ_t differences[i+t, i+k−1−t] for every i and k ≤ longest, (n+1, longest+1)."""
    n = len(differences)
    table = np.zeros((n + 1, longest + 1))
    for k in range(2, min(longest, n) + 1):
        for i in range(n - k + 1):
            inner = table[i + 1, k - 2] if k > 2 else 0.0
            table[i, k] = inner + 2.0 * differences[i, i + k - 1]
    return table
