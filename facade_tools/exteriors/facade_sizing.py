"""Sizes of elements: the quadratic programme of FW16 eq. 5, solved exactly.

    minimise Σ m_i (x_i − a_i)²   subject to   Σ b_i x_i = total,   low_i ≤ x_i ≤ high_i

is a bounded quadratic knapsack: x_i(µ) = clip(a_i + µ b_i / m_i, low_i, high_i) and Σ b_i x_i(µ)
rises piecewise linearly in µ, so that the right µ lies between two of its 2n sorted breakpoints.
"""

from __future__ import annotations

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats


@compiled
def _clipped(wanted: float, low: float, high: float) -> float:
    return min(max(wanted, low), high)


@compiled
def sized(
    wanted: Floats, share: Floats, weight: Floats, low: Floats, high: Floats, total: float
) -> Floats:
    """Return the sizes (n,) of the knapsack above in O(n log n).

    wanted: a. share: b > 0. weight: m > 0. low ≤ high. Where the bounds do not allow the total,
    all sizes stand at the bounds that come nearest to it.
    """
    n = len(wanted)
    out = np.empty(n)
    slope = np.empty(n)
    breaks = np.empty(2 * n)
    for i in range(n):
        slope[i] = share[i] / weight[i]
        breaks[2 * i] = (low[i] - wanted[i]) / slope[i]
        breaks[2 * i + 1] = (high[i] - wanted[i]) / slope[i]
    order = np.argsort(breaks, kind="mergesort")
    reached = 0.0  # Σ b x(µ) at the breakpoint before
    for i in range(n):
        reached += share[i] * low[i]
        out[i] = low[i]
    if n == 0 or total <= reached:
        return out
    rising = 0.0  # Σ b² / m of the sizes between their bounds
    level = breaks[order[0]]
    for k in order:
        step = (breaks[k] - level) * rising
        if reached + step >= total:
            break
        reached += step
        level = breaks[k]
        change = share[k // 2] * slope[k // 2]
        rising += change if k % 2 == 0 else -change
    else:
        for i in range(n):
            out[i] = high[i]
        return out
    multiplier = level + (total - reached) / rising if rising > 0.0 else level
    for i in range(n):
        out[i] = _clipped(wanted[i] + multiplier * slope[i], low[i], high[i])
    return out
