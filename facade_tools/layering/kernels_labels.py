"""Labels of the alignment decision network: states by hash, dominance, the best path."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled

# Columns of the label table.
OMEGA, SIGMA, PIECES, COLUMNS, PARENT, STATE, NEXT, ALIVE = range(8)
# Entries of `limits`.
BUDGET, WIDEST, CANVAS, SPLITS, MAX_STEPS, BEAM, LOOSE, FLOOR = range(8)
# Entries of `status`.
BEST, COMPLETE, STEPS, LABELS, STATES = range(5)

Array = Any  # integer arrays; numba knows their exact types
_MIX = np.uint64(0x9E3779B97F4A7C15)


@compiled
def power_of_two(n: int) -> Any:
    """Return the least power of two, from 16 on, that is not below n."""
    size = 16
    while size < n:
        size *= 2
    return size


@compiled
def slot_of(codes: Array, code: Array, slots: Array) -> Any:
    """Return where `code` is or belongs in the open-addressing table of states."""
    mask = len(slots) - 1
    value = np.uint64(1469598103934665603)
    for r in range(len(code)):
        value = (value ^ np.uint64(code[r])) * np.uint64(1099511628211)
    value = (value ^ (value >> np.uint64(29))) * _MIX
    at = np.int64(value >> np.uint64(20)) & mask
    while slots[at] >= 0:
        same = True
        for r in range(len(code)):
            if codes[slots[at], r] != code[r]:
                same = False
                break
        if same:
            break
        at = (at + 1) & mask
    return at


@compiled
def beam_bar(state: int, chain: Array, head: Array, labels: Array, beam: int, status: Array) -> Any:
    """Return the Ω above which labels of a bucket are dropped by the beam."""
    none = np.int64(2**62)
    if beam <= 0:
        return none
    count, at = 0, state
    while at >= 0:
        label = head[at]
        while label >= 0:
            count += labels[label, ALIVE]
            label = labels[label, NEXT]
        at = chain[at]
    if count <= beam:
        return none
    values = np.empty(count, np.int64)
    count, at = 0, state
    while at >= 0:
        label = head[at]
        while label >= 0:
            if labels[label, ALIVE]:
                values[count] = labels[label, OMEGA]
                count += 1
            label = labels[label, NEXT]
        at = chain[at]
    status[COMPLETE] = 0
    return np.sort(values)[beam]


@compiled
def add_label(
    target: int, parent: int, omega: int, sigma: int, pieces: int, m: int, starts: Array,
    limits: Array, prefix_low: Array, labels: Array, reach: Array, codes: Array, head: Array,
    status: Array, grip: Array,
) -> None:  # fmt: skip
    """Add a label to a state unless another is better; drop those that it betters."""
    columns = labels[parent, COLUMNS] + 1
    if status[LABELS] >= len(labels):
        status[COMPLETE] = 0
        return
    fresh = status[LABELS]
    labels[fresh, OMEGA], labels[fresh, SIGMA] = omega, sigma
    labels[fresh, PIECES], labels[fresh, COLUMNS] = pieces, columns
    labels[fresh, PARENT], labels[fresh, STATE] = parent, target
    if limits[SPLITS]:
        for r in range(m):
            held = (codes[target, r] >> 1) & 1
            reach[fresh, r, 0] = grip[r, 0] if held else 0
            reach[fresh, r, 1] = grip[r, 1] if held else 0
    rest = np.int64(0)
    for r in range(m):
        at = starts[r] + (codes[target, r] >> 2) + ((codes[target, r] >> 1) & 1) + r
        rest = max(rest, prefix_low[starts[r + 1] + r] - prefix_low[at])
    full = sigma + rest >= limits[CANVAS]
    other = head[target]
    while other >= 0:
        if not labels[other, ALIVE]:
            other = labels[other, NEXT]
            continue
        if better(other, fresh, m, labels, reach, codes, full, limits):
            return
        if better(fresh, other, m, labels, reach, codes, full, limits):
            labels[other, ALIVE] = 0
        other = labels[other, NEXT]
    labels[fresh, NEXT], labels[fresh, ALIVE] = head[target], 1
    head[target] = fresh
    status[LABELS] += 1


@compiled
def better(
    a: int, b: int, m: int, labels: Array, reach: Array, codes: Array, full: bool,
    limits: Array,
) -> bool:  # fmt: skip
    """Tell whether whatever completes label b completes label a at least as well."""
    if labels[a, OMEGA] > labels[b, OMEGA] or labels[a, SIGMA] > labels[b, SIGMA]:
        return False
    if limits[FLOOR] and (
        labels[a, OMEGA] - labels[a, SIGMA] > labels[b, OMEGA] - labels[b, SIGMA]
    ):
        return False
    if limits[SPLITS]:
        for r in range(m):
            if reach[a, r, 0] < reach[b, r, 0] or reach[a, r, 1] > reach[b, r, 1]:
                return False
    if labels[a, OMEGA] < labels[b, OMEGA]:
        return True
    if labels[a, PIECES] != labels[b, PIECES]:
        return bool(labels[a, PIECES] < labels[b, PIECES])
    if labels[a, COLUMNS] != labels[b, COLUMNS]:
        return bool(labels[a, COLUMNS] > labels[b, COLUMNS])
    if labels[a, SIGMA] < labels[b, SIGMA]:
        return full
    return not lexically_less(b, a, m, labels, codes)


@compiled
def lexically_less(a: int, b: int, m: int, labels: Array, codes: Array) -> bool:
    """Compare the columns of two labels with equally many: by row, then by column."""
    count = labels[a, COLUMNS]
    borders = np.empty((2, count), np.int64)
    for side in range(2):
        label = a if side == 0 else b
        for k in range(count):
            borders[side, count - 1 - k] = labels[label, STATE]
            label = labels[label, PARENT]
    for r in range(m):
        for k in range(count):
            x, y = codes[borders[0, k], r] >> 1, codes[borders[1, k], r] >> 1
            if x != y:
                return bool(x < y)
    return False


@compiled
def best_label(
    state: int, chain: Array, head: Array, labels: Array, codes: Array, starts: Array,
    limits: Array, status: Array,
) -> Any:  # fmt: skip
    """Return the best complete label, or -1."""
    best = -1
    m = len(starts) - 1
    while state >= 0:
        finished = True
        for r in range(m):
            finished = finished and codes[state, r] >> 1 == 2 * (starts[r + 1] - starts[r])
        label = head[state] if finished else -1
        while label >= 0:
            within = lifted(label, labels, limits) <= limits[BUDGET]
            if (
                labels[label, ALIVE]
                and within
                and (best < 0 or wins(label, best, m, labels, codes, limits))
            ):
                best = label
            label = labels[label, NEXT]
        state = chain[state]
    return best


@compiled
def lifted(a: int, labels: Array, limits: Array) -> Any:
    """Return a label's Ω, and what it must grow by for Σ to reach its floor.

    The topmost word reaches the floor; with unsized symbols Σ is only a lower bound, and every
    column that grows, grows its error by as much.
    """
    return labels[a, OMEGA] + max(np.int64(0), limits[FLOOR] - labels[a, SIGMA])


@compiled
def wins(a: int, b: int, m: int, labels: Array, codes: Array, limits: Array) -> bool:
    """Tell whether a complete label goes before another: Ω, pieces, columns, Σ, names."""
    canvas = limits[CANVAS]
    x, y = lifted(a, labels, limits), lifted(b, labels, limits)
    if x != y:
        return bool(x < y)
    if labels[a, PIECES] != labels[b, PIECES]:
        return bool(labels[a, PIECES] < labels[b, PIECES])
    if labels[a, COLUMNS] != labels[b, COLUMNS]:
        return bool(labels[a, COLUMNS] > labels[b, COLUMNS])
    x, y = abs(labels[a, SIGMA] - canvas), abs(labels[b, SIGMA] - canvas)
    if x != y:
        return bool(x < y)
    return lexically_less(a, b, m, labels, codes)


@compiled
def path_of(best: int, labels: Array, codes: Array) -> Array:
    """Return the borders' codes (columns + 1, m) that lead to a label; none for -1."""
    if best < 0:
        return np.zeros((0, codes.shape[1]), np.int64)
    count = labels[best, COLUMNS]
    out = np.zeros((count + 1, codes.shape[1]), np.int64)
    for k in range(count, -1, -1):
        out[k] = codes[labels[best, STATE]]
        best = labels[best, PARENT]
    return out
