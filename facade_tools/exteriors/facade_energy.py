"""The energy of facade layouts (FW16 eq. 4), with every layout sized by eq. 5 first."""

from __future__ import annotations

import numpy as np

from ..artifacts.attributes import FacadeAttributes
from ..artifacts.building import SIDES
from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from .facade_attributes import side_values, symmetric
from .facade_layout import (
    ABOVE,
    CENTRE,
    CLEAR,
    CODE,
    DOOR,
    GROUND,
    HEIGHT,
    LOW,
    LOWER,
    OPEN,
    QUIET,
    SLIM,
    SUB,
    TALL,
    UPPER,
    WIDTH,
    Side,
)
from .facade_sizing import sized

LEAST_TARGET = 0.1  # a difference is divided by max(target, this)
WIDE = 1.5  # upper bound of eq. 5, times the average size (the lower stands in `subs`)
NO_SIDELIGHTS = 0.2  # what a main door without them is worth, where the library's building has some
TASTE = 1e-3  # weight of what only looks better: far below what eq. 4 can tell apart


def energy(reached: FacadeAttributes, wanted: FacadeAttributes) -> float:
    """Return eq. 4: a difference is divided by max(target, 0.1); unknown numbers are left out.

    >>> one = FacadeAttributes((0.2, None, None, None), (1.0,) + (None,) * 3)
    >>> energy(one, FacadeAttributes((0.1, None, None, None), (1.0,) + (None,) * 3))
    1.0
    """
    total = 0.0
    for name in ("wwr", "sym", "align"):
        for value, target in zip(getattr(reached, name), getattr(wanted, name), strict=True):
            if value is not None and target is not None:
                total += ((value - target) / max(target, LEAST_TARGET)) ** 2
    return total


def side_targets(wanted: FacadeAttributes | None) -> Floats:
    """Return the targets (4, 3) of the sides: wwr, sym, align; NaN where there is none."""
    if wanted is None:
        return np.full((len(SIDES), 3), np.nan)
    return np.array([wanted.wwr, wanted.sym, wanted.align], dtype=np.float64).T.copy()


@compiled
def widths(side: Side, genome: Floats, counts: Integers) -> Floats:
    """Return the width of each substyle (k,) on a side, by eq. 5.

    Each substyle has one width on the whole side, within 0.5 to 1.5 times its average and what the
    walls allow; the total area of the side is the target ratio's. Doors and sidelights keep theirs.
    """
    k = len(side.subs)
    number, tall, high = np.zeros(k), np.zeros(k), np.empty(k)
    out = np.empty(k)
    for sub in range(k):
        out[sub], high[sub] = side.subs[sub, WIDTH], WIDE * side.subs[sub, WIDTH]
    wall = 0.0
    total = 0.0  # glass that is wanted beside what stands
    for p in range(len(side.pieces)):
        wall += side.pieces[p, 4] * side.pieces[p, 5]
        for e in range(counts[p]):
            sub = int(genome[p, e, SUB])
            number[sub] += 1.0
            tall[sub] += genome[p, e, TALL]
            high[sub] = min(high[sub], genome[p, e, CLEAR])
    for e in range(len(side.fixed)):
        total -= side.fixed[e, 3] * side.fixed[e, 4]
    for sub in range(k):
        if side.subs[sub, DOOR] > 0.0 or side.subs[sub, SLIM] > 0.0:
            total -= out[sub] * tall[sub]
            number[sub] = 0.0
    if np.isnan(side.targets[0]):
        for sub in range(k):
            out[sub] = min(out[sub], max(high[sub], side.subs[sub, LOW]))
        return out
    return _sized_used(side, out, number, tall, high, total + side.targets[0] * wall)


@compiled
def _sized_used(
    side: Side, out: Floats, number: Floats, tall: Floats, high: Floats, total: float
) -> Floats:
    """Size the substyles that occur, `number` times each; the others keep their width."""
    used = np.empty(len(out), dtype=np.int64)
    rows = np.empty((5, len(out)))
    n = 0
    for sub in range(len(out)):
        if number[sub] > 0.0:
            low = side.subs[sub, LOW]
            used[n] = sub
            rows[0, n], rows[1, n], rows[2, n] = out[sub], tall[sub], number[sub]
            rows[3, n], rows[4, n] = low, max(low, high[sub])
            n += 1
    new = sized(rows[0, :n], rows[1, :n], rows[2, :n], rows[3, :n], rows[4, :n], total)
    for i in range(n):
        out[used[i]] = new[i]
    return out


@compiled
def build(side: Side, genome: Floats, counts: Integers, wide: Floats) -> tuple[Floats, Floats]:
    """Return pieces (p, 8) and elements (m, 5) of a side as `side_values` takes them."""
    total = len(side.fixed)
    for p in range(len(counts)):
        total += counts[p]
    pieces = side.pieces.copy()
    elements = np.empty((total, 5))
    n = 0
    for p in range(len(pieces)):
        first, fixed = int(side.pieces[p, 6]), int(side.pieces[p, 7])
        pieces[p, 6], pieces[p, 7] = n, fixed + counts[p]
        for e in range(first, first + fixed):
            for c in range(5):
                elements[n, c] = side.fixed[e, c]
            n += 1
        for e in range(counts[p]):
            row = genome[p, e]
            sub = int(row[SUB])
            elements[n, 0] = side.subs[sub, CODE]
            elements[n, 1] = row[CENTRE] - wide[sub] / 2
            elements[n, 2], elements[n, 3], elements[n, 4] = row[LOWER], wide[sub], row[TALL]
            n += 1
    return pieces, elements


@compiled
def _term(value: float, target: float) -> float:
    if np.isnan(target):
        return 0.0
    return ((value - target) / max(target, LEAST_TARGET)) ** 2


@compiled
def least_energy(side: Side) -> tuple[float, Floats]:
    """Return a lower bound of eq. 4 on a side, and which pieces (p,) are symmetric there.

    The three terms are bounded one by one: the ratio by what stands already, symmetry over the
    subsets of open pieces, alignment over the fractions that the stacked pieces allow.
    """
    wall = 0.0
    glass = 0.0
    for p in range(len(side.pieces)):
        wall += side.pieces[p, 4] * side.pieces[p, 5]
    for e in range(len(side.fixed)):
        glass += side.fixed[e, 3] * side.fixed[e, 4]
    if side.door[0] >= 0:
        sub = int(side.door[3])
        glass += side.subs[sub, WIDTH] * side.subs[sub, HEIGHT]
    ratio = side.targets[0]
    bound = _term(glass / wall, ratio) if glass / wall > ratio else 0.0
    even, plan = _least_symmetry(side, wall)
    return bound + even + _least_alignment(_pairs(side), side.targets[2]), plan


@compiled
def _pairs(side: Side) -> int:
    """Return how many stacked pairs may both hold elements."""
    count = 0
    for k in range(len(side.stacked)):
        low, high = side.stacked[k]
        under = side.room[low, OPEN] > 0.0 or side.pieces[low, 7] > 0.0
        over = side.room[high, OPEN] > 0.0 or side.pieces[high, 7] > 0.0
        count += 1 if under and over else 0
    return count


@compiled
def _least_alignment(pairs: int, target: float) -> float:
    least = _term(1.0, target)
    for n in range(1, pairs + 1):
        for k in range(n + 1):
            least = min(least, _term(k / n, target))
    return least


@compiled
def _least_symmetry(side: Side, wall: float) -> tuple[float, Floats]:
    """Return the least symmetry term and the plan that reaches it, over at most 2¹² subsets.

    Of more open pieces than twelve, only the largest are varied: the others stay symmetric.
    """
    plan = np.ones(len(side.pieces))
    target = side.targets[1]
    base = 0.0
    count = 0
    free = np.zeros(len(side.pieces))
    for p in range(len(side.pieces)):
        area = side.pieces[p, 4] * side.pieces[p, 5]
        first = int(side.pieces[p, 6])
        own = side.fixed[first : first + int(side.pieces[p, 7])]
        if side.room[p, OPEN] > 0.0:
            free[p] = area
            count += 1
        if side.room[p, OPEN] > 0.0 or symmetric(side.pieces[p, 4], own):
            base += area
    largest = np.argsort(free, kind="mergesort")[::-1][: min(count, 12)]
    if np.isnan(target):
        return 0.0, plan
    least, best = np.inf, 0
    for mask in range(1 << len(largest)):
        area = base
        for k in range(len(largest)):
            area -= free[largest[k]] * ((mask >> k) & 1)
        value = _term(area / wall, target)
        if value < least - 1e-12:
            least, best = value, mask
    for k in range(len(largest)):
        plan[largest[k]] = 1.0 - ((best >> k) & 1)
    return least, plan


@compiled
def side_energy(side: Side, genome: Floats, counts: Integers) -> tuple[float, float]:
    """Return eq. 4 of one side, and the same plus a little for what looks worse.

    Worse look large walls left empty, sizes far from their average and a door that found no place.
    """
    wide = widths(side, genome, counts)
    pieces, elements = build(side, genome, counts, wide)
    wwr, sym, align = side_values(pieces, elements)
    value = _term(wwr, side.targets[0]) + _term(sym, side.targets[1])
    value += _term(align, side.targets[2])
    worse = _taste(side, genome, counts, wide)
    if side.door[0] >= 0 and not has_door(side, genome, counts):
        worse += 1e3 / TASTE
    return value, value + TASTE * worse


@compiled
def has_door(side: Side, genome: Floats, counts: Integers) -> bool:
    """Tell whether the main door found a place: it is the first element of its piece."""
    p = int(side.door[0])
    return bool(counts[p] > 0 and genome[p, 0, SUB] == side.door[3])


@compiled
def _taste(side: Side, genome: Floats, counts: Integers, wide: Floats) -> float:
    worse = _uneven(side, genome, counts, wide) + _unusual(side, genome, counts, wide)
    return worse + _plain_door(side, genome, counts)


@compiled
def _plain_door(side: Side, genome: Floats, counts: Integers) -> float:
    """Return what it is worth that the main door has no sidelights."""
    p = int(side.door[0])
    if p < 0 or (counts[p] > 1 and side.subs[int(genome[p, 1, SUB]), SLIM] > 0.0):
        return 0.0
    for sub in range(len(side.subs)):
        if side.subs[sub, SLIM] > 0.0 and side.subs[sub, GROUND] > 0.0:
            return NO_SIDELIGHTS
    return 0.0


@compiled
def _uneven(side: Side, genome: Floats, counts: Integers, wide: Floats) -> float:
    """Return how unevenly the windows are spread over the walls, in shares of their area."""
    ratio = side.targets[0] if not np.isnan(side.targets[0]) else 0.15
    wall = 0.0
    uneven = 0.0
    for p in range(len(side.pieces)):
        if side.room[p, OPEN] == 0.0 or side.room[p, QUIET] > 0.0:
            continue
        area = side.pieces[p, 4] * side.pieces[p, 5]
        glass = 0.0
        for e in range(counts[p]):
            glass += wide[int(genome[p, e, SUB])] * genome[p, e, TALL]
        wall += area
        uneven += abs(glass - ratio * area) / max(ratio, LEAST_TARGET)
    return uneven / wall if wall > 0.0 else 0.0


@compiled
def _unusual(side: Side, genome: Floats, counts: Integers, wide: Floats) -> float:
    """Return how far sizes are from their average, and kinds from their share in the library.

    Sidelights have their place, not a share.
    """
    extra = np.zeros(len(side.subs))  # elements of a substyle more than usual
    stretch = 0.0
    n = 0
    for p in range(len(side.pieces)):
        column = ABOVE if side.room[p, UPPER] > 0.0 else GROUND
        weight = 1e-9
        for sub in range(len(extra)):
            weight += side.subs[sub, column] * (1.0 - side.subs[sub, SLIM])
        own = 0
        for e in range(counts[p]):
            sub = int(genome[p, e, SUB])
            stretch += (wide[sub] / side.subs[sub, WIDTH] - 1.0) ** 2
            if side.subs[sub, SLIM] == 0.0:
                extra[sub] += 1.0
                own += 1
        for sub in range(len(extra)):
            extra[sub] -= own * side.subs[sub, column] * (1.0 - side.subs[sub, SLIM]) / weight
        n += counts[p]
    unlike = 0.0
    for sub in range(len(extra)):
        unlike += abs(extra[sub]) / 2
    return (4.0 * stretch + unlike) / n if n else 0.0
