"""The alignment decision network as a dynamic programme, in compiled scalar code (IMAW15 5.2).

Sizes are integers (see `rows.py`), so that ties are exact. A state says for each row at which
place of its lattice the column border lies: at a node, or inside a transparent letter (splits),
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
from .kernels_columns import advanced, column_hash, contradicts, occluded
from .kernels_labels import (
    AFTER,
    ALIVE,
    BARE,
    BEAM,
    BEST,
    BUDGET,
    COLUMNS,
    COMPLETE,
    DEPTH,
    EXPANDED,
    HAS_GRIPS,
    HIGH,
    IS_SOLID,
    LABELS,
    LEAST,
    LOOSE,
    LOW,
    MAX_STEPS,
    MORE,
    MOST,
    NEXT,
    OMEGA,
    OPEN,
    PARENT,
    PIECES,
    REACHED,
    REST,
    RIVAL,
    SIGMA,
    SOLID,
    SPLITS,
    STATES,
    STEPS,
    TO_PLACE,
    WEIGHT,
    WIDEST,
    add_label,
    beam_bar,
    best_label,
    path_of,
    power_of_two,
    slot_of,
)
from .kernels_pairs import hopeless, to_come

Array = Any  # integer arrays; numba knows their exact types


@compiled
def search(  # noqa: C901 - one flat loop: a compiled call a row would cost more than the row
    starts: Array,  # (m + 1,) first place of each row
    places: Array,  # (places, 11) see kernels_labels; a row's first place is its start
    tally: Array,  # (places, symbols) letters before each place
    keys: Array,  # (places,) hash of the letters before each place
    steps: Array,  # (steps, 8) what a row can have in a column, by place and least size
    first: Array,  # (places + 1,) first step of each place
    rows: Array,  # (m, 3) opaque letters of each row, layers in it, 1: must be empty somewhere
    stack: Array,  # (layers,) row of each layer, the topmost first
    spelling: Any,  # ranks of the letters of edges, heads and tails of segments
    forbidden: Array,  # (f,) hashes of columns that must not be used
    limits: Array,  # (11,) see kernels_labels
    guide: Any,  # see kernels_pairs.hopeless: pairs of rows, their costs to come, weights
    capacity: Array,  # (2,) labels, states
) -> Any:
    """Return (status, codes): the best alignment's borders as (columns + 1, m) row codes.

    A code is 4 · place + 2 · the row has been empty, as it must + last column empty, where the
    next letter asks. status[BEST] is -1 where there is none; status[COMPLETE] is 0 where a bound
    cut the search short.
    """
    m = len(starts) - 1
    total = np.int64(0)
    for r in range(m):
        depth = np.int64(0)
        for at in range(starts[r], starts[r + 1]):
            depth = max(depth, places[at, DEPTH] >> 1)
        total += depth
    order, able = row_order(m, rows[:, SOLID])
    ahead = letters_ahead(m, starts, places, steps)
    guided = len(guide[1]) > 0
    now = np.zeros(m, np.int64)  # the place of each row that has chosen
    max_labels, max_states = capacity[0], capacity[1]
    labels = np.zeros((max_labels, 8), np.int64)
    wide = m if limits[SPLITS] else 0
    reach = np.zeros((max_labels, wide, 2), np.int64)
    codes = np.zeros((max_states, m), np.int64)
    head, chain = np.full(max_states, -1, np.int64), np.full(max_states, -1, np.int64)
    bucket = np.full(total + 1, -1, np.int64)
    slots = np.full(power_of_two(2 * max_states), -1, np.int64)
    status = np.zeros(6, np.int64)
    status[COMPLETE] = 1
    # The empty prefix.
    status[STATES], status[LABELS] = 1, 1
    labels[0, PARENT], labels[0, NEXT], labels[0, ALIVE] = -1, -1, 1
    head[0], bucket[0] = 0, 0
    for r in range(m):
        codes[0, r] = 4 * starts[r]
    slots[slot_of(codes, codes[0], slots)] = 0
    # What each row takes in the column under construction.
    option = np.zeros(m + 1, np.int64)  # by place in the order of rows
    taken = np.zeros(m, np.int64)  # the step, or -1
    upper, lower = np.zeros(m + 1, np.int64), np.zeros(m + 1, np.int64)
    opaque, cut = np.zeros(m + 1, np.int64), np.zeros(m + 1, np.int64)
    full_low, full_high = np.zeros(m, np.int64), np.zeros(m, np.int64)
    code, grip = np.zeros(m, np.int64), np.zeros((max(wide, 1), 2), np.int64)
    for progress in range(total):  # Σ letters consumed
        bar = beam_bar(bucket[progress], chain, head, labels, limits[BEAM], status)
        state, grown = bucket[progress], False
        while state >= 0:
            label = head[state]
            while label >= 0:
                if labels[label, ALIVE] == 1 and labels[label, OMEGA] <= bar:
                    labels[label, ALIVE] = EXPANDED
                    grown = True
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
                                    m, rows, places, tally, keys, steps, spelling, forbidden,
                                    limits, labels, reach, codes, head, chain, bucket, slots, first,
                                    status, label, state, taken, upper[m], lower[m],
                                    opaque[m], cut[m], full_low, full_high, code, grip,
                                    starts, guide, ahead,
                                )  # fmt: skip
                            k -= 1
                            continue
                        if not (opaque[k] or able[k] or limits[LOOSE]):
                            k -= 1
                            continue
                        r = order[k]
                        option[k] += 1
                        here, gap = codes[state, r] >> 2, codes[state, r] & 1
                        inside = places[here, OPEN]
                        if option[k] == 0:  # nothing
                            if inside or places[here, AFTER]:
                                continue
                            if (
                                labels[label, SIGMA] + upper[k] + places[here, REST]
                                > limits[WIDEST]
                            ):
                                continue
                            if guided and hopeless(
                                r, here, k, order, now,
                                spare - max(np.int64(0), upper[k] - lower[k]),
                                limits[WIDEST] - labels[label, SIGMA] - upper[k], starts, guide,
                            ):  # fmt: skip
                                continue
                            now[r] = here
                            taken[r] = -1
                            upper[k + 1], lower[k + 1] = upper[k], lower[k]
                            opaque[k + 1], cut[k + 1] = opaque[k], cut[k]
                            k += 1
                            option[k] = -1
                            continue
                        step = first[here] + option[k] - 1
                        if step >= first[here + 1]:
                            k -= 1
                            continue
                        if gap and steps[step, HAS_GRIPS]:
                            continue
                        there = steps[step, TO_PLACE]
                        opened = places[there, OPEN]
                        need, cap, pieces = np.int64(0), np.int64(0), np.int64(0)
                        bottom, top = np.int64(0), np.int64(0)
                        if inside and there == here:
                            cap = places[here, MOST] - reach[label, r, 1]
                            pieces = np.int64(1)
                        else:
                            if inside:
                                bottom = max(np.int64(0), places[here, LEAST] - reach[label, r, 0])
                                top = places[here, MOST] - reach[label, r, 1]
                                pieces = np.int64(1)
                            bottom += steps[step, LOW]
                            top += steps[step, HIGH]
                            need, cap = bottom, top
                            if opened:
                                cap += places[there, MOST]
                                pieces += 1
                        largest, smallest = max(upper[k], need), min(lower[k], cap)
                        if (
                            need - lower[k] > spare
                            or labels[label, SIGMA] + largest > limits[WIDEST]
                        ):
                            k -= 1
                            continue
                        if largest - smallest > spare:
                            continue
                        if (
                            not opened
                            and labels[label, SIGMA] + largest + places[there, REST]
                            > limits[WIDEST]
                        ):
                            continue
                        if guided and hopeless(
                            r, there, k, order, now, spare - max(np.int64(0), largest - smallest),
                            limits[WIDEST] - labels[label, SIGMA] - largest, starts, guide,
                        ):  # fmt: skip
                            continue
                        now[r] = there
                        taken[r] = step
                        full_low[r], full_high[r] = bottom, top
                        upper[k + 1], lower[k + 1] = largest, smallest
                        opaque[k + 1] = 1 if steps[step, IS_SOLID] else opaque[k]
                        cut[k + 1] = cut[k] + pieces * rows[r, WEIGHT]
                        k += 1
                        option[k] = -1
                label = labels[label, NEXT]
            state = chain[state]
            if state < 0 and grown and limits[LOOSE] == BARE and limits[SPLITS]:
                # A column of pieces alone consumes no letter: its labels are in this bucket, too.
                state, grown = bucket[progress], False
        if status[STEPS] > limits[MAX_STEPS]:
            break
    status[BEST] = best_label(
        status[STATES], head, labels, codes, places, first, steps, spelling, limits, rows, stack
    )
    if status[BEST] >= 0:
        status[REACHED] = labels[status[BEST], OMEGA]
    return status, path_of(status[BEST], labels, codes)


@compiled
def row_order(m: int, solid: Array) -> Any:
    """Return rows with most opaque letters first, and whether such are left from each place on.

    A column needs an opaque substring, and the first one that is chosen narrows all others.
    """
    order = np.argsort(-solid, kind="mergesort")
    able = np.zeros(m + 1, np.int64)
    for k in range(m - 1, -1, -1):
        able[k] = 1 if solid[order[k]] > 0 else able[k + 1]
    return order, able


@compiled
def letters_ahead(m: int, starts: Array, places: Array, steps: Array) -> Any:
    """Return the most letters that each row has, and at the end the least size of a column."""
    out = np.zeros(m + 1, np.int64)
    for r in range(m):
        for at in range(starts[r], starts[r + 1]):
            out[r] = max(out[r], places[at, DEPTH] >> 1)
    out[m] = np.int64(2**62)
    for step in range(len(steps)):
        if steps[step, IS_SOLID]:
            out[m] = min(out[m], max(np.int64(1), steps[step, LOW]))
    return out


@compiled
def _finish(
    m: int, rows: Array, places: Array, tally: Array, keys: Array, steps: Array, spelling: Any,
    forbidden: Array, limits: Array, labels: Array, reach: Array, codes: Array, head: Array,
    chain: Array, bucket: Array, slots: Array, first: Array, status: Array,
    label: int, state: int, taken: Array, upper: int, lower: int, opaque: int, cut: int,
    full_low: Array, full_high: Array, code: Array, grip: Array, starts: Array, guide: Any,
    ahead: Array,
) -> None:  # fmt: skip
    """Check the column that every row has chosen for, and add its label."""
    if not opaque and not limits[LOOSE]:
        return
    if occluded(m, steps, taken):
        return
    size = labels[label, SIGMA] + upper
    omega = labels[label, OMEGA] + max(np.int64(0), upper - lower)
    progress, fewest = advanced(
        m, rows, places, steps, limits, ahead, codes[state], taken, upper, lower, full_low,
        full_high, reach[label], code, grip, size,
    )  # fmt: skip
    if progress < 0:
        return
    if (
        labels[label, COLUMNS] + 1 + fewest < limits[MORE]
        and omega + to_come(m, code, starts, guide) >= limits[RIVAL]
    ):
        return
    if contradicts(m, places, codes[state], code, taken, tally):
        return
    if len(forbidden):
        value = column_hash(m, places, keys, codes[state], code, taken)
        for k in range(len(forbidden)):
            if forbidden[k] == value:
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
        slots[at], label, omega, size, labels[label, PIECES] + cut, m, places, first, steps,
        spelling, limits, labels, reach, codes, head, status, grip,
    )  # fmt: skip
