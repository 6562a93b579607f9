"""The random walk's inner loop, compiled: perturb words, adapt sizes, sum integral images.

A policy is kept in fixed arrays: axis 0 is the word of rows, axes 1… the words of the sets of
columns. word[a, i] is the state of part i, size[a, i] its length in pixels before adapting.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

Ints = NDArray[np.int64]
Reals = NDArray[np.float64]
Flags = NDArray[np.bool_]


@compiled
def cut_of(
    word: Ints, size: Reals, count: int, length: int, least: Ints, most: Ints, out: Ints
) -> bool:
    """Adapt sizes so that they fill `length`; write borders to `out`. False if out of bounds.

    What exceeds the least sizes is scaled, so that nearly any set of sizes is a valid split.
    """
    total, floor = 0.0, 0
    for i in range(count):
        floor += least[word[i]]
        total += max(0.0, size[i] - least[word[i]])
    if floor > length or (total <= 0.0 and floor < length):
        return False
    scale = (length - floor) / max(total, 1e-9)
    running, base = 0.0, 0
    out[0] = 0
    for i in range(count):
        base += least[word[i]]
        running += max(0.0, size[i] - least[word[i]]) * scale
        out[i + 1] = base + round(running)
        if out[i + 1] - out[i] > most[word[i]]:
            return False
    return bool(out[count] == length)


@compiled
def perturb(
    word: Ints,
    size: Reals,
    count: int,
    allowed: Flags,
    first: Flags,
    last: Flags,
    typical: Reals,
    sigma: float,
    change: float,
    rng: np.random.Generator,
) -> int:
    """Perturb one word in place; returns its new number of parts.

    Sizes move by centred Gaussians (eq. 9): all of them, or about two. With probability `change`
    the word itself does: a part is put in or taken out, or a run between two equal states is
    doubled or dropped.
    """  # fmt: skip
    if rng.random() < change:
        kind = rng.random()
        if kind < 0.25:
            count = _take_out(word, size, count, allowed, first, last, rng)
        elif kind < 0.5:
            count = _put_in(word, size, count, allowed, first, last, typical, rng)
        else:
            count = _pump(word, size, count, kind < 0.75, rng)
    share = 1.0 if rng.random() < 0.3 else 2.0 / count
    for i in range(count):
        if rng.random() < share:
            step = max(sigma * rng.normal(), -size[i])
            size[i] += step
            if i + 1 < count and rng.random() < 0.5:  # only the border moves
                size[i + 1] = max(0.0, size[i + 1] - step)
    return count


@compiled
def _fits(allowed: Flags, first: Flags, last: Flags, before: Any, after: Any) -> bool:
    if before < 0:
        return after >= 0 and bool(first[after])
    if after < 0:
        return bool(last[before])
    return bool(allowed[before, after])


@compiled
def _take_out(
    word: Ints, size: Reals, count: int, allowed: Flags, first: Flags, last: Flags,
    rng: np.random.Generator,
) -> int:  # fmt: skip
    if count < 2:
        return count
    at = rng.integers(0, count)
    before = word[at - 1] if at > 0 else -1
    after = word[at + 1] if at + 1 < count else -1
    if not _fits(allowed, first, last, before, after):
        return count
    size[at - 1 if at > 0 else 1] += size[at]
    for i in range(at, count - 1):
        word[i] = word[i + 1]
        size[i] = size[i + 1]
    return count - 1


@compiled
def _put_in(
    word: Ints, size: Reals, count: int, allowed: Flags, first: Flags, last: Flags,
    typical: Reals, rng: np.random.Generator,
) -> int:  # fmt: skip
    if count + 1 > len(word):
        return count
    at = rng.integers(0, count + 1)
    before = word[at - 1] if at > 0 else -1
    after = word[at] if at < count else -1
    fresh = rng.integers(0, len(first))
    if not (
        _fits(allowed, first, last, before, fresh) and _fits(allowed, first, last, fresh, after)
    ):
        return count
    for i in range(count, at, -1):
        word[i] = word[i - 1]
        size[i] = size[i - 1]
    word[at] = fresh
    beside = at - 1 if at > 0 else 1
    size[at] = min(typical[fresh], size[beside] / 2)
    size[beside] -= size[at]
    return count + 1


@compiled
def _pump(word: Ints, size: Reals, count: int, double: bool, rng: np.random.Generator) -> Any:
    low = rng.integers(0, count)
    high = rng.integers(0, count)
    if low > high:
        low, high = high, low
    run = high - low
    if run == 0 or word[low] != word[high]:
        return count
    if double:
        if count + run > len(word):
            return count
        for i in range(count - 1, high, -1):
            word[i + run] = word[i]
            size[i + run] = size[i]
        for i in range(run):
            word[high + 1 + i] = word[low + 1 + i]
            size[high + 1 + i] = size[low + 1 + i]
        return count + run
    for i in range(high + 1, count):
        word[i - run] = word[i]
        size[i - run] = size[i]
    return count - run


@compiled
def energy_of(
    table: Reals, label: Ints, group: Ints, owner: Ints, words: Ints, cuts: Ints, counts: Ints
) -> float:
    """Return the energy of a policy from integral images (labels, height + 1, width + 1).

    label[state, kind]; group[state] is −1 for a terminal's row. owner[i] is the set of columns of
    row part i, or −2 where a group's own number is meant.
    """
    total = 0.0
    width = table.shape[2] - 1
    for i in range(counts[0]):
        state = words[0, i]
        low, high = cuts[0, i], cuts[0, i + 1]
        if group[state] < 0:
            plane = label[state, 0]
            total += table[plane, high, width] - table[plane, low, width]
            continue
        own = 1 + (group[state] if owner[i] == -2 else owner[i])
        for j in range(counts[own]):
            plane = label[state, words[own, j]]
            left, right = cuts[own, j], cuts[own, j + 1]
            total += (
                table[plane, high, right] - table[plane, low, right]
                - table[plane, high, left] + table[plane, low, left]
            )  # fmt: skip
    return total


@compiled
def prior_of(prior: Reals, word: Ints, cut: Ints, count: int) -> float:
    """Return the prior energy of one word's sizes; prior: (states, 3), see `segments.Bounds`."""
    total = 0.0
    for i in range(count):
        weight = prior[word[i], 2]
        if weight > 0.0:
            off = (cut[i + 1] - cut[i] - prior[word[i], 0]) * prior[word[i], 1]
            total += weight * off * off / 2
    return total
