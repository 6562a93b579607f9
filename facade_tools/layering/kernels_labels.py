"""Labels of the alignment decision network: states by hash, dominance, the best path."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled

# Columns of the label table.
OMEGA, SIGMA, PIECES, COLUMNS, PARENT, STATE, NEXT, ALIVE = range(8)
EXPANDED = 2  # a value of ALIVE: what can follow the label has been tried
# Entries of `limits`. LOOSE: columns need no opaque substring; BARE: only Ω counts, no ties.
# RIVAL: an Ω that is known, with MORE columns: what only ties must have as many.
BUDGET, WIDEST, CANVAS, SPLITS, MAX_STEPS, BEAM, LOOSE, FLOOR, SHORTEST, RIVAL, MORE = range(11)
# Columns of `places`: REST from there on, DEPTH 2 · letters + OPEN, AFTER an attached letter, ASKS:
# before one, OPEN: inside a letter of size LEAST to MOST whose rank is that of the edge SPELT.
# BEFORE: size of the letters before, COVER: of the opaque ones.
REST, DEPTH, AFTER, ASKS, OPEN, LEAST, MOST, FINAL, SPELT, BEFORE, COVER = range(11)
# Columns of `steps`: LOW and HIGH of their whole letters, which the segment SPELLING spells.
TO_PLACE, LOW, HIGH, IS_CLEAR, IS_SOLID, IS_BARE, HAS_GRIPS, SPELLING = range(8)
# Columns of `rows`.
SOLID, WEIGHT, NEEDS_GAP = range(3)
# Entries of `status`; REACHED: Ω of the best label, where there is one.
BEST, COMPLETE, STEPS, LABELS, STATES, REACHED = range(6)
BARE = 2  # a value of limits[LOOSE]

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
            count += labels[label, ALIVE] > 0
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
    target: int, parent: int, omega: int, sigma: int, pieces: int, m: int, places: Array,
    first: Array, steps: Array, spelling: Any, limits: Array, labels: Array,
    reach: Array, codes: Array, head: Array, status: Array, grip: Array,
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
    rest = np.int64(0)
    for r in range(m):
        there = codes[target, r] >> 2
        held = places[there, OPEN]
        if limits[SPLITS]:
            reach[fresh, r, 0] = grip[r, 0] if held else 0
            reach[fresh, r, 1] = grip[r, 1] if held else 0
        rest = max(rest, places[there, REST] - places[there, LEAST])
    ample = limits[CANVAS] - rest  # a Σ that will reach the canvas
    other, before = head[target], np.int64(-1)
    while other >= 0:
        after = labels[other, NEXT]
        if labels[other, ALIVE]:
            if better(
                other, fresh, m, labels, reach, codes, ample, limits, places, first, steps,
                spelling,
            ):  # fmt: skip
                return
            if better(
                fresh, other, m, labels, reach, codes, ample, limits, places, first, steps,
                spelling,
            ):  # fmt: skip
                labels[other, ALIVE] = 0
                if before < 0:
                    head[target] = after
                else:
                    labels[before, NEXT] = after
                other = after
                continue
        before, other = other, after
    labels[fresh, NEXT], labels[fresh, ALIVE] = head[target], 1
    head[target] = fresh
    status[LABELS] += 1


@compiled
def better(
    a: int, b: int, m: int, labels: Array, reach: Array, codes: Array, ample: int, limits: Array,
    places: Array, first: Array, steps: Array, spelling: Any,
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
    if labels[a, OMEGA] < labels[b, OMEGA] or limits[LOOSE] == BARE:
        return True
    if labels[a, PIECES] != labels[b, PIECES]:
        return bool(labels[a, PIECES] < labels[b, PIECES])
    if labels[a, COLUMNS] != labels[b, COLUMNS]:
        return bool(labels[a, COLUMNS] > labels[b, COLUMNS])
    if labels[a, SIGMA] < labels[b, SIGMA]:
        return bool(labels[a, SIGMA] >= ample)
    return not named_before(b, a, m, labels, codes, places, first, steps, spelling)


@compiled
def named_before(
    a: int, b: int, m: int, labels: Array, codes: Array, places: Array, first: Array,
    steps: Array, spelling: Any,
) -> bool:  # fmt: skip
    """Compare two labels with equally many columns: words by row, then columns by row."""
    count = labels[a, COLUMNS]
    borders = np.empty((2, count + 1), np.int64)
    for side in range(2):
        label = a if side == 0 else b
        for k in range(count + 1):
            borders[side, count - k] = labels[label, STATE]
            label = labels[label, PARENT]
    for r in range(m):
        if spelling[3][r]:
            mine = spelt(borders[0], r, codes, places, first, steps, spelling)
            theirs = spelt(borders[1], r, codes, places, first, steps, spelling)
            for k in range(min(len(mine), len(theirs))):
                x, y = spelling[0][mine[k]], spelling[0][theirs[k]]
                if x != y:
                    return bool(x < y)
            if len(mine) != len(theirs):
                return len(mine) < len(theirs)
    for r in range(m):
        for k in range(count + 1):
            x = places[codes[borders[0, k], r] >> 2, DEPTH]
            y = places[codes[borders[1, k], r] >> 2, DEPTH]
            if x != y:
                return bool(x < y)
    return False


@compiled
def spelt(
    border: Array, r: int, codes: Array, places: Array, first: Array, steps: Array, spelling: Any
) -> Array:
    """Return the edges that a row's path of places spells, the first word of those possible."""
    heads, tails = spelling[1], spelling[2]
    last = codes[border[len(border) - 1], r] >> 2
    out = np.empty(places[last, DEPTH] >> 1, np.int64)
    length = 0
    for k in range(len(border) - 1):
        code, end = codes[border[k], r], codes[border[k + 1], r] >> 2
        here = code >> 2
        if here == end:
            continue
        if places[here, OPEN]:
            out[length] = places[here, SPELT]
            length += 1
        best = np.int64(-1)
        for step in range(first[here], first[here + 1]):
            if steps[step, TO_PLACE] == end and not (code & 1 and steps[step, HAS_GRIPS]):
                segment = steps[step, SPELLING]
                if best < 0 or segment_before(segment, best, spelling):
                    best = segment
        while best >= 0:
            out[length] = heads[best]
            length += 1
            best = tails[best]
    return out[:length]


@compiled
def segment_before(a: Any, b: Any, spelling: Any) -> bool:
    """Tell whether a segment's word comes before another's of the same length."""
    ranks, heads, tails = spelling[0], spelling[1], spelling[2]
    while a >= 0 and b >= 0:
        x, y = ranks[heads[a]], ranks[heads[b]]
        if x != y:
            return bool(x < y)
        a, b = tails[a], tails[b]
    return False


@compiled
def best_label(
    count: int, head: Array, labels: Array, codes: Array, places: Array, first: Array,
    steps: Array, spelling: Any, limits: Array, rows: Array, stack: Array,
) -> Any:  # fmt: skip
    """Return the best complete label among those of the first `count` states, or -1."""
    best = np.int64(-1)
    m = codes.shape[1]
    for state in range(count):
        if not finished(codes[state], places, limits, rows, stack):
            continue
        label = head[state]
        while label >= 0:
            within = lifted(label, labels, limits) <= limits[BUDGET]
            if (
                labels[label, ALIVE]
                and within
                and (
                    best < 0
                    or wins(
                        label, best, m, labels, codes, limits, places, first, steps, spelling,
                    )
                )
            ):  # fmt: skip
                best = label
            label = labels[label, NEXT]
    return best


@compiled
def finished(code: Array, places: Array, limits: Array, rows: Array, stack: Array) -> bool:
    """Tell whether every row is at an end, and its word long enough (IMAW15 eq. 7)."""
    for r in range(len(code)):
        been = (code[r] >> 1) & 1
        if not places[code[r] >> 2, FINAL] or been < rows[r, NEEDS_GAP]:
            return False
    above = np.int64(0)
    for layer in range(len(stack)):
        there = code[stack[layer]] >> 2
        if places[there, BEFORE] + above < limits[SHORTEST]:
            return False
        above += places[there, COVER]
    return True


@compiled
def lifted(a: int, labels: Array, limits: Array) -> Any:
    """Return a label's Ω, and what it must grow by for Σ to reach its floor.

    The topmost word reaches the floor; with unsized symbols Σ is only a lower bound, and every
    column that grows, grows its error by as much.
    """
    return labels[a, OMEGA] + max(np.int64(0), limits[FLOOR] - labels[a, SIGMA])


@compiled
def wins(
    a: Any, b: Any, m: int, labels: Array, codes: Array, limits: Array, places: Array,
    first: Array, steps: Array, spelling: Any,
) -> bool:  # fmt: skip
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
    return named_before(a, b, m, labels, codes, places, first, steps, spelling)


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
