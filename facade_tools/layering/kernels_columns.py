"""One column of an alignment: what is allowed in it, and where it leaves the rows."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled
from .kernels_labels import (
    ASKS,
    DEPTH,
    IS_BARE,
    IS_CLEAR,
    LEAST,
    MOST,
    NEEDS_GAP,
    OPEN,
    REST,
    TO_PLACE,
    WIDEST,
)

Array = Any  # integer arrays; numba knows their exact types
_MIX = np.uint64(0x9E3779B97F4A7C15)


@compiled
def advanced(
    m: int, rows: Array, places: Array, steps: Array, limits: Array, ahead: Array, before: Array,
    taken: Array, upper: int, lower: int, full_low: Array, full_high: Array, reach: Array,
    code: Array, grip: Array, size: int,
) -> Any:  # fmt: skip
    """Set every row's code behind a column, and what of an open letter can be consumed (`grip`).

    Return (letters consumed, columns to come at most); the first is -1 where Σ is too great.
    """
    progress = np.int64(0)
    fewest = np.int64(2**62)
    # Without an opaque substring, a column may be as wide as its transparent ones bear.
    upper, lower = max(upper, lower), min(upper, lower)
    for r in range(m):
        here, been = before[r] >> 2, (before[r] >> 1) & 1
        there = here if taken[r] < 0 else steps[taken[r], TO_PLACE]
        rest = places[there, REST]
        if places[there, OPEN]:
            if there == here:
                grip[r, 0] = min(places[there, MOST], reach[r, 0] + upper)
                grip[r, 1] = reach[r, 1] + lower
            else:
                grip[r, 0] = min(places[there, MOST], upper - full_low[r])
                grip[r, 1] = max(np.int64(0), lower - full_high[r])
            rest -= min(places[there, LEAST], grip[r, 0])
        if size + rest > limits[WIDEST]:
            return np.int64(-1), fewest
        code[r] = 4 * there + 2 * been
        if taken[r] < 0:
            code[r] = 4 * there + 2 * rows[r, NEEDS_GAP] + places[there, ASKS]
        progress += places[there, DEPTH] >> 1
        spare = (limits[WIDEST] - size - rest) // ahead[m]
        fewest = min(fewest, ahead[r] - (places[there, DEPTH] >> 1) + spare)
    return progress, fewest


@compiled
def occluded(m: int, steps: Array, taken: Array) -> bool:
    """Tell whether an unoccludable letter has a layer above it that is not transparent."""
    covered = False
    for r in range(m):
        if taken[r] >= 0:
            if covered and steps[taken[r], IS_BARE]:
                return True
            covered = covered or not steps[taken[r], IS_CLEAR]
    return False


@compiled
def contradicts(
    m: int, places: Array, before: Array, after: Array, taken: Array, tally: Array
) -> bool:
    """Tell whether a whole substring is part of another one, which no positive sizes allow."""
    reference = -1
    for r in range(m):
        a, b = before[r] >> 2, after[r] >> 2
        if taken[r] < 0 or places[a, OPEN] or places[b, OPEN]:
            continue
        if reference < 0:
            reference = r
            continue
        c, d = before[reference] >> 2, after[reference] >> 2
        less, more = False, False
        for s in range(tally.shape[1]):
            mine, theirs = tally[b, s] - tally[a, s], tally[d, s] - tally[c, s]
            less = less or mine < theirs
            more = more or mine > theirs
        if less != more:
            return True
    return False


@compiled
def column_hash(
    m: int, places: Array, keys: Array, before: Array, after: Array, taken: Array
) -> np.uint64:
    """Return a 64-bit hash of what every row has in a column."""
    value = np.uint64(0)
    for r in range(m):
        if taken[r] >= 0:
            a, b = before[r] >> 2, after[r] >> 2
            pieces = places[a, OPEN] + places[b, OPEN]
            value += row_hash(r, keys[a], keys[b], pieces)
    return value


@compiled
def row_hash(row: int, before: np.uint64, after: np.uint64, pieces: int) -> np.uint64:
    """Return the hash of a substring: of its letters; of its places where it has pieces."""
    part = np.uint64(row + 1) * _MIX
    if pieces:
        part ^= before * np.uint64(0x94D049BB133111EB)
        part += after * np.uint64(0xD6E8FEB86659FD93) + np.uint64(pieces)
    else:
        part += after - before
    part = (part ^ (part >> np.uint64(31))) * _MIX
    return part ^ (part >> np.uint64(27))
