"""What two rows of a candidate still cost, from every pair of their places to the end."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled
from .kernels_labels import (
    AFTER,
    BEFORE,
    DEPTH,
    FINAL,
    HIGH,
    IS_BARE,
    IS_CLEAR,
    LEAST,
    LOW,
    MOST,
    OPEN,
    REST,
    TO_PLACE,
)

Array = Any  # integer arrays; numba knows their exact types
NEVER = np.int64(2**61)


@compiled
def pair_costs(  # noqa: C901 - one flat loop over both rows' steps
    starts: Array,  # (3,) first place of each of the two rows, the upper one first
    places: Array,
    steps: Array,
    first: Array,
    weights: Array,  # (k, 2) of Ω and of Σ
    most: int,  # of Ω
    widest: int,  # of Σ
) -> Any:
    """Return (places of one, places of the other, k): least weighted sums of Ω and Σ to come.

    A relaxation: no column needs an opaque substring, sizes of pieces are free, of one letter even
    in sum, and attached letters only bind inside their own row. NEVER: there is no way within the
    limits.
    """
    spans = _spans(places, steps, first)
    open_ = places[:, OPEN] * places[:, LEAST]  # may have been consumed
    count = len(weights)
    out = np.full((starts[1], starts[2] - starts[1], count), NEVER, np.int64)
    upper = np.argsort(-places[: starts[1], DEPTH], kind="mergesort")
    lower = np.argsort(-places[starts[1] : starts[2], DEPTH], kind="mergesort") + starts[1]
    for a in upper:
        for b in lower:
            reached = max(places[a, BEFORE], places[b, BEFORE])
            if reached + max(places[a, REST] - open_[a], places[b, REST] - open_[b]) > widest:
                continue
            here = out[a, b - starts[1]]
            if places[a, FINAL] and places[b, FINAL]:
                here[:] = 0
            if not (places[b, OPEN] or places[b, AFTER]):
                for step in range(first[a], first[a + 1]):
                    there = steps[step, TO_PLACE]
                    if there != a:
                        _least(here, out[there, b - starts[1]], weights, 0, spans[step, 0])
            if not (places[a, OPEN] or places[a, AFTER]):
                for step in range(first[b], first[b + 1]):
                    there = steps[step, TO_PLACE]
                    if there != b:
                        _least(here, out[a, there - starts[1]], weights, 0, spans[step, 0])
            for one in range(first[a], first[a + 1]):
                there, low, high = steps[one, TO_PLACE], spans[one, 0], spans[one, 1]
                for two in range(first[b], first[b + 1]):
                    then = steps[two, TO_PLACE]
                    if steps[two, LOW] > high + most:
                        break
                    if (there == a and then == b) or (
                        steps[two, IS_BARE] and not steps[one, IS_CLEAR]
                    ):
                        continue
                    size = max(low, spans[two, 0])
                    error = max(np.int64(0), size - min(high, spans[two, 1]))
                    if error > most:
                        continue
                    _least(here, out[there, then - starts[1]], weights, error, size)
    return out


@compiled
def _spans(places: Array, steps: Array, first: Array) -> Array:
    """Return the least and greatest size of every step, pieces included."""
    out = np.empty((len(steps), 2), np.int64)
    for at in range(len(places)):
        for step in range(first[at], first[at + 1]):
            there = steps[step, TO_PLACE]
            out[step, 0], out[step, 1] = steps[step, LOW], steps[step, HIGH]
            if places[at, OPEN]:
                out[step, 1] += places[at, MOST]
            if places[there, OPEN] and there != at:
                out[step, 1] += places[there, MOST]
    return out


@compiled
def _least(here: Array, there: Array, weights: Array, error: int, size: int) -> None:
    for k in range(len(weights)):
        value = there[k] + weights[k, 0] * error + weights[k, 1] * size
        if value < here[k]:
            here[k] = value


@compiled
def hopeless(
    row: int, place: int, before: int, order: Array, now: Array, omega: int, sigma: int,
    starts: Array, guide: Any,
) -> bool:  # fmt: skip
    """Tell whether a row at a place, with one of those before it in `order`, costs too much.

    now: the places of the rows. omega, sigma: what may come. guide: pairs (m, m), where the costs
    of two rows begin in the flat array that follows, or -1; weights (k, 2).
    """
    pairs, future, weights = guide
    for k in range(before):
        other = order[k]
        a, b = min(row, other), max(row, other)
        if pairs[a, b] < 0:
            continue
        x, y = (place, now[other]) if row == a else (now[other], place)
        wide = starts[b + 1] - starts[b]
        at = pairs[a, b] + len(weights) * ((x - starts[a]) * wide + (y - starts[b]))
        for j in range(len(weights)):
            if future[at + j] > weights[j, 0] * omega + weights[j, 1] * sigma:
                return True
    return False


@compiled
def to_come(m: int, code: Array, starts: Array, guide: Any) -> Any:
    """Return a lower bound on the Ω to come from a state; the first weights are those of Ω."""
    pairs, future, weights = guide
    out = np.int64(0)
    if len(future) == 0:
        return out
    for a in range(m):
        for b in range(a + 1, m):
            if pairs[a, b] >= 0:
                x, y = (code[a] >> 2) - starts[a], (code[b] >> 2) - starts[b]
                wide = starts[b + 1] - starts[b]
                out = max(out, future[pairs[a, b] + len(weights) * (x * wide + y)])
    return out
