"""The alignment decision network as a dynamic programme, in compiled scalar code (IMAW15 5.2).

Sizes are integers (see `rows.py`), so that ties are exact. A state says for each row how many
letters are consumed, whether the column border lies inside the next letter (transparent splits)
and whether the last column was empty where an attached letter wants to know. Labels of a state
are kept while none of the others is better in every respect.

Splits: pieces are not enumerated by size. With U the largest and V the smallest substring of a
column, a row whose borders lie inside letters only asks that its borders' positions can be
reached by steps between V and U; both ends of the reachable range are carried along (`reach`),
which makes Ω = Σ (U − V) exact for letters of known size. A letter whose size is only known to
lie between `low` and `high` (unsized symbols) makes Ω a lower bound.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled
from .kernels_labels import (
    ALIVE,
    BEAM,
    BEST,
    BUDGET,
    COMPLETE,
    LABELS,
    LOOSE,
    MAX_STEPS,
    NEXT,
    OMEGA,
    PARENT,
    PIECES,
    SIGMA,
    SPLITS,
    STATES,
    STEPS,
    WIDEST,
    add_label,
    beam_bar,
    best_label,
    path_of,
    power_of_two,
    slot_of,
)

Array = Any  # integer arrays; numba knows their exact types
_MIX = np.uint64(0x9E3779B97F4A7C15)


@compiled
def search(  # noqa: C901 - one flat loop: a compiled call a row would cost more than the row
    starts: Array,  # (m + 1,) first letter of each row in the flat arrays
    low: Array,  # (letters,) least size
    high: Array,  # (letters,) greatest size
    flags: Array,  # (letters, 5) transparent, opaque, unoccludable, attached, run end
    tally: Array,  # (letters, symbols) 1 where the letter is of the symbol
    keys: Array,  # (letters,) random 64-bit number of the letter's symbol
    forbidden: Array,  # (f,) hashes of columns that must not be used
    limits: Array,  # (8,) budget of Ω, greatest Σ, canvas, splits, steps, beam, loose, least Σ
    capacity: Array,  # (2,) labels, states
) -> Any:
    """Return (status, codes): the best alignment's borders as (columns + 1, m) row codes.

    A code is 4 · letters consumed + 2 · inside the next letter + last column empty. status[BEST]
    is -1 where there is none; status[COMPLETE] is 0 where a bound cut the search short.
    """
    m = len(starts) - 1
    total = starts[m]
    prefix_low, prefix_high = np.zeros(total + m, np.int64), np.zeros(total + m, np.int64)
    solid = np.zeros(total + m, np.int64)
    for r in range(m):
        for p in range(starts[r], starts[r + 1]):
            prefix_low[p + r + 1] = prefix_low[p + r] + low[p]
            prefix_high[p + r + 1] = prefix_high[p + r] + high[p]
            solid[p + r + 1] = solid[p + r] + flags[p, 1]
    order, able = _row_order(m, starts, solid)
    max_labels, max_states = capacity[0], capacity[1]
    labels = np.zeros((max_labels, 8), np.int64)
    wide = m if limits[SPLITS] else 0
    reach = np.zeros((max_labels, wide, 2), np.int64)
    codes = np.zeros((max_states, m), np.int64)
    head, chain = np.full(max_states, -1, np.int64), np.full(max_states, -1, np.int64)
    bucket = np.full(total + 1, -1, np.int64)
    slots = np.full(power_of_two(2 * max_states), -1, np.int64)
    status = np.zeros(5, np.int64)
    status[COMPLETE] = 1
    # The empty prefix.
    status[STATES], status[LABELS] = 1, 1
    labels[0, PARENT], labels[0, NEXT], labels[0, ALIVE] = -1, -1, 1
    head[0], bucket[0] = 0, 0
    slots[slot_of(codes, codes[0], slots)] = 0
    # What each row takes in the column under construction.
    option = np.zeros(m + 1, np.int64)  # by place in the order of rows
    ends, opens = np.zeros(m, np.int64), np.zeros(m, np.int64)
    upper, lower = np.zeros(m + 1, np.int64), np.zeros(m + 1, np.int64)
    opaque, cut = np.zeros(m + 1, np.int64), np.zeros(m + 1, np.int64)
    full_low, full_high = np.zeros(m, np.int64), np.zeros(m, np.int64)
    code, grip = np.zeros(m, np.int64), np.zeros((max(wide, 1), 2), np.int64)
    pair = np.zeros((2, tally.shape[1]), np.int64)
    for progress in range(total):
        bar = beam_bar(bucket[progress], chain, head, labels, limits[BEAM], status)
        state = bucket[progress]
        while state >= 0:
            label = head[state]
            while label >= 0:
                if labels[label, ALIVE] and labels[label, OMEGA] <= bar:
                    spare = limits[BUDGET] - labels[label, OMEGA]
                    k = 0
                    option[0] = -1
                    upper[0], lower[0] = 0, np.int64(2**62)
                    opaque[0], cut[0] = 0, 0
                    while k >= 0:
                        status[STEPS] += 1
                        if status[STEPS] > limits[MAX_STEPS]:
                            status[COMPLETE] = 0
                            break
                        if k == m:
                            if lower[m] < 2**62:
                                _finish(
                                    m, starts, low, high, flags, tally, keys, forbidden, limits,
                                    prefix_low, labels, reach, codes, head, chain, bucket, slots,
                                    status, label, state, ends, opens, upper[m], lower[m],
                                    opaque[m], cut[m], full_low, full_high, code, grip, pair,
                                )  # fmt: skip
                            k -= 1
                            continue
                        if not (opaque[k] or able[k] or limits[LOOSE]):
                            k -= 1
                            continue
                        r = order[k]
                        option[k] += 1
                        here = codes[state, r]
                        p, inside, gap = here >> 2, (here >> 1) & 1, here & 1
                        first, last = starts[r], starts[r + 1]
                        q = first + p
                        take = option[k]
                        if take == 0:  # nothing
                            if inside or (p > 0 and flags[q - 1, 3]):
                                continue
                            rest = prefix_low[last + r] - prefix_low[q + r]
                            if labels[label, SIGMA] + upper[k] + rest > limits[WIDEST]:
                                continue
                            ends[r], opens[r] = p, 0
                            upper[k + 1], lower[k + 1] = upper[k], lower[k]
                            opaque[k + 1], cut[k + 1] = opaque[k], cut[k]
                            k += 1
                            option[k] = -1
                            continue
                        if q >= last or (gap and flags[q, 3]):
                            k -= 1
                            continue
                        clear = flags[q, 0]
                        end = q + take // 2
                        opened = take & 1
                        if end > flags[q, 4] or (opened and end >= flags[q, 4]):
                            k -= 1
                            continue
                        if opened and not (clear and limits[SPLITS]):
                            continue
                        need, cap, pieces = np.int64(0), np.int64(0), np.int64(0)
                        bottom, top = np.int64(0), np.int64(0)
                        if inside and end == q:
                            cap = high[q] - reach[label, r, 1]
                            pieces = np.int64(1)
                        else:
                            start = q
                            if inside:
                                bottom = max(np.int64(0), low[q] - reach[label, r, 0])
                                top = high[q] - reach[label, r, 1]
                                start, pieces = q + 1, np.int64(1)
                            bottom += prefix_low[end + r] - prefix_low[start + r]
                            top += prefix_high[end + r] - prefix_high[start + r]
                            need, cap = bottom, top
                            if opened:
                                cap += high[end]
                                pieces += 1
                        largest, smallest = max(upper[k], need), min(lower[k], cap)
                        rest = prefix_low[last + r] - prefix_low[end + r]
                        if (
                            need - lower[k] > spare
                            or labels[label, SIGMA] + largest > limits[WIDEST]
                        ):
                            k -= 1
                            continue
                        if largest - smallest > spare:
                            continue
                        if not opened and labels[label, SIGMA] + largest + rest > limits[WIDEST]:
                            continue
                        ends[r], opens[r] = end - first, opened
                        full_low[r], full_high[r] = bottom, top
                        upper[k + 1], lower[k + 1] = largest, smallest
                        whole = not clear and solid[end + r] - solid[q + r] == end - q
                        opaque[k + 1] = 1 if whole else opaque[k]
                        cut[k + 1] = cut[k] + pieces
                        k += 1
                        option[k] = -1
                label = labels[label, NEXT]
            state = chain[state]
        if status[STEPS] > limits[MAX_STEPS]:
            break
    status[BEST] = best_label(bucket[total], chain, head, labels, codes, starts, limits, status)
    return status, path_of(status[BEST], labels, codes)


@compiled
def _row_order(m: int, starts: Array, solid: Array) -> Any:
    """Return rows with most opaque letters first, and whether such are left from each place on.

    A column needs an opaque substring, and the first one that is chosen narrows all others.
    """
    count = np.empty(m, np.int64)
    for r in range(m):
        count[r] = solid[starts[r + 1] + r] - solid[starts[r] + r]
    order = np.argsort(-count, kind="mergesort")
    able = np.zeros(m + 1, np.int64)
    for k in range(m - 1, -1, -1):
        able[k] = 1 if count[order[k]] > 0 else able[k + 1]
    return order, able


@compiled
def _finish(
    m: int, starts: Array, low: Array, high: Array, flags: Array, tally: Array, keys: Array,
    forbidden: Array, limits: Array, prefix_low: Array, labels: Array, reach: Array, codes: Array,
    head: Array, chain: Array, bucket: Array, slots: Array, status: Array, label: int, state: int,
    ends: Array, opens: Array, upper: int, lower: int, opaque: int, cut: int,
    full_low: Array, full_high: Array, code: Array, grip: Array, pair: Array,
) -> None:  # fmt: skip
    """Check the column that every row has chosen for, and add its label."""
    if not opaque and not limits[LOOSE]:
        return
    if _occluded(m, starts, flags, codes[state], ends, opens):
        return
    size = labels[label, SIGMA] + upper
    omega = labels[label, OMEGA] + max(np.int64(0), upper - lower)
    splits = limits[SPLITS] > 0
    progress = np.int64(0)
    for r in range(m):
        first = starts[r]
        p, inside = codes[state, r] >> 2, (codes[state, r] >> 1) & 1
        empty = ends[r] == p and opens[r] == inside and not inside
        e = first + ends[r]
        rest = prefix_low[starts[r + 1] + r] - prefix_low[e + r]
        if splits and opens[r]:
            if inside and ends[r] == p:
                grip[r, 0] = min(high[e], reach[label, r, 0] + upper)
                grip[r, 1] = reach[label, r, 1] + lower
            else:
                grip[r, 0] = min(high[e], upper - full_low[r])
                grip[r, 1] = max(np.int64(0), lower - full_high[r])
            rest -= min(low[e], grip[r, 0])
        if size + rest > limits[WIDEST]:
            return
        asks = e < starts[r + 1] and flags[e, 3] and not opens[r]
        code[r] = 4 * ends[r] + 2 * opens[r] + (1 if empty and asks else 0)
        progress += ends[r]
    if _contradicts(m, starts, codes[state], ends, opens, tally, pair):
        return
    if len(forbidden) and _is_forbidden(m, starts, codes[state], ends, opens, keys, forbidden):
        return
    at = slot_of(codes, code, slots)
    if slots[at] < 0:
        if status[STATES] >= len(codes):
            status[COMPLETE] = 0
            return
        fresh = status[STATES]
        status[STATES] += 1
        codes[fresh] = code
        slots[at] = fresh
        chain[fresh] = bucket[progress]
        bucket[progress] = fresh
    add_label(
        slots[at], label, omega, size, labels[label, PIECES] + cut, m, starts, limits,
        prefix_low, labels, reach, codes, head, status, grip,
    )  # fmt: skip


@compiled
def _occluded(m: int, starts: Array, flags: Array, code: Array, ends: Array, opens: Array) -> bool:
    """Tell whether an unoccludable letter has a layer above it that is not transparent."""
    covered = False
    for r in range(m):
        p, inside = code[r] >> 2, (code[r] >> 1) & 1
        if ends[r] == p and not opens[r] and not inside:
            continue
        q = starts[r] + p
        if covered:
            for k in range(q, starts[r] + ends[r] + opens[r]):
                if flags[k, 2]:
                    return True
        covered = covered or not flags[q, 0]
    return False


@compiled
def _contradicts(
    m: int, starts: Array, code: Array, ends: Array, opens: Array, tally: Array, pair: Array
) -> bool:
    """Tell whether a whole substring is part of another one, which no positive sizes allow."""
    reference = -1
    symbols = tally.shape[1]
    for r in range(m):
        p, inside = code[r] >> 2, (code[r] >> 1) & 1
        if inside or opens[r] or ends[r] == p:
            continue
        mine = 0 if reference < 0 else 1
        for s in range(symbols):
            pair[mine, s] = 0
        for k in range(starts[r] + p, starts[r] + ends[r]):
            for s in range(symbols):
                pair[mine, s] += tally[k, s]
        if reference < 0:
            reference = r
            continue
        less, more = False, False
        for s in range(symbols):
            less = less or pair[1, s] < pair[0, s]
            more = more or pair[1, s] > pair[0, s]
        if less != more:
            return True
    return False


@compiled
def column_hash(
    m: int, starts: Array, code: Array, ends: Array, opens: Array, keys: Array
) -> np.uint64:
    """Return a 64-bit hash of what every row has in a column."""
    value = np.uint64(0)
    for r in range(m):
        p, inside = code[r] >> 2, (code[r] >> 1) & 1
        if ends[r] == p and not opens[r] and not inside:
            continue
        part = np.uint64(r + 1) * _MIX
        if inside or opens[r]:  # pieces: this very place
            part ^= np.uint64(code[r] >> 1) * np.uint64(0xBF58476D1CE4E5B9)
            part += np.uint64(2 * ends[r] + opens[r]) * np.uint64(0x94D049BB133111EB)
        else:
            for k in range(starts[r] + p, starts[r] + ends[r]):
                part += keys[k]
        part = (part ^ (part >> np.uint64(31))) * _MIX
        value += part ^ (part >> np.uint64(27))
    return value


@compiled
def _is_forbidden(
    m: int, starts: Array, code: Array, ends: Array, opens: Array, keys: Array, forbidden: Array
) -> bool:
    value = column_hash(m, starts, code, ends, opens, keys)
    return bool(np.any(forbidden == value))
