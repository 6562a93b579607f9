"""Layouts of facade pieces: a side as the genetic search sees it, and how layouts are drawn.

Everything here is compiled scalar code over the arrays of one side. The genome of a side holds for
each piece a row of elements; the columns of an element are its substyle, the centre along the
piece, the lower edge, the height, and the greatest width that its neighbourhood allows (m).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from .facade_sizing import sized

MOST = 24  # generated elements a piece
EDGE = 0.2  # wall between an element and its piece's border (m)
GAP = 0.16  # wall between two elements (m)
LOWEST_SILL = 0.1  # over the storey's floor or the roof below (m)
LEAST_HEIGHT = 0.45  # of a window (m)
AIR = 0.002  # so that rounding to millimetres touches nothing (m)
SPARE = 0.05  # share of draws that take any size of window
WIDE_WALL = 1.6  # in wider ones sidelights stand beside the main door alone (m)
SIDELIGHTS = 0.7  # share of main doors that get a pair, where the library's building has some
SQUEEZE = 0.75  # an element is placed where it has at least this share of its usual width

SUB, CENTRE, LOWER, TALL, CLEAR = range(5)  # columns of a genome's element
FLOOR, HEAD, UPPER, OPEN, QUIET = range(5)  # columns of `room`
CODE, WIDTH, HEIGHT, DOOR, GROUND, ABOVE, TWIN, LOW, SLIM, NEEDS, ROWS = range(
    11
)  # columns of `subs`


class Side(NamedTuple):
    """One side as the search sees it (metres).

    pieces (p, 8): as in `facade_attributes`, the last two are first and count of its `fixed`.
    room (p, 5): v of the storey's floor and of the window heads; 1 in an upper storey; 1 where
    elements may be placed; 1 where few are expected (garages). fixed (f, 5): code, u, v, width,
    height of what stands. blocked (b, 5): piece, u0, v0, u1, v1. stacked (m, 2): lower and upper
    piece. subs (k, 11): number of kind and style, average width and height, 1 for doors, weight on
    the ground and above, row of the narrow twin or −1, least width, 1 for sidelights, width that a
    place must offer, 1 for what may stand in rows in wide walls. door (5,): piece that takes the
    main door or −1, range of its centre, substyle, share of draws at the middle of the range.
    targets (3,): wwr, sym, align, or NaN. plan (p,): 1 where a symmetric layout helps to meet sym.
    """

    pieces: Floats
    room: Floats
    fixed: Floats
    blocked: Floats
    stacked: Integers
    subs: Floats
    door: Floats
    targets: Floats
    plan: Floats


@compiled
def pick(rng: np.random.Generator, side: Side, p: int, doors: bool) -> int:
    """Return a substyle drawn by its weight in the storey of piece p; −1 where there is none.

    doors: whether doors may be drawn too. Now and then it is any window, also one of the spare
    sizes that weigh nothing: some targets cannot be met without.
    """
    wide = side.pieces[p, 4] > WIDE_WALL
    if rng.random() < SPARE:
        any_one = int(rng.random() * len(side.subs))
        ordinary = not wide or side.subs[any_one, ROWS] > 0.0
        return any_one if side.subs[any_one, DOOR] == 0.0 and ordinary else -1
    column = ABOVE if side.room[p, UPPER] > 0.0 else GROUND
    total = 0.0
    for k in range(len(side.subs)):
        ordinary = not wide or side.subs[k, ROWS] > 0.0
        if ordinary and (doors or side.subs[k, DOOR] == 0.0):
            total += side.subs[k, column]
    mark = rng.random() * total
    last = -1
    for k in range(len(side.subs)):
        ordinary = not wide or side.subs[k, ROWS] > 0.0
        weighs = side.subs[k, column] > 0.0
        if ordinary and weighs and (doors or side.subs[k, DOOR] == 0.0):
            last = k
            mark -= side.subs[k, column]
            if mark < 0.0:
                break
    return last


@compiled
def _bounds(side: Side, p: int, sub: int, u: float) -> tuple[float, float]:
    """Return lower edge and height of an element at u: windows hang from the storey's head.

    A roof below raises the sill; the head stays in line.
    """
    floor, head = side.room[p, FLOOR], side.room[p, HEAD]
    width, height = side.subs[sub, WIDTH], side.subs[sub, HEIGHT]
    if side.subs[sub, DOOR] > 0.0:
        return floor, height if floor >= -1e-6 else 0.0
    lower = max(head - height, floor + LOWEST_SILL, LOWEST_SILL)
    for k in range(len(side.blocked)):
        row = side.blocked[k]
        if row[0] == p and row[1] < u + width / 2 and row[3] > u - width / 2:
            low, high = row[2], row[4]
            if low < (lower + head) / 2 and high > lower and high <= head - LEAST_HEIGHT:
                lower = high + 0.02
    return lower, head - lower


@compiled
def _free_width(side: Side, p: int, u: float, lower: float, tall: float) -> float:
    """Return how wide an element at u may be between borders, obstacles and fixed elements."""
    piece = side.pieces[p]
    clear = 2.0 * min(u - EDGE, piece[4] - EDGE - u)
    for k in range(len(side.blocked)):
        row = side.blocked[k]
        if row[0] == p and row[2] < lower + tall and row[4] > lower:
            clear = min(clear, 2.0 * max(row[1] - u, u - row[3]))
    first = int(piece[6])
    for k in range(first, first + int(piece[7])):
        row = side.fixed[k]
        if row[2] < lower + tall + GAP and row[2] + row[4] > lower - GAP:
            clear = min(clear, 2.0 * (max(row[1] - u, u - row[1] - row[3]) - GAP))
    return float(clear - 2.0 * AIR)


@compiled
def place(side: Side, p: int, sub: int, u: float, row: Floats, count: int) -> int:
    """Put an element at u into `row` if there is room; return the new number of elements.

    Two neighbours share the wall between them in proportion to their usual widths.
    """
    lower, tall = _bounds(side, p, sub, u)
    if count >= MOST or tall < LEAST_HEIGHT or lower + tall > side.pieces[p, 5] - 0.0999:
        return count
    clear = _free_width(side, p, u, lower, tall)
    least = side.subs[sub, NEEDS]
    for k in range(count):
        wall = abs(u - row[k, CENTRE]) - GAP
        mine, its = _shares(side, sub, int(row[k, SUB]), wall)
        if its < side.subs[int(row[k, SUB]), NEEDS]:
            return count
        clear = min(clear, mine)
    if clear < least:
        return count
    for k in range(count):
        wall = abs(u - row[k, CENTRE]) - GAP
        row[k, CLEAR] = min(row[k, CLEAR], _shares(side, sub, int(row[k, SUB]), wall)[1])
    row[count, SUB], row[count, CENTRE], row[count, LOWER] = sub, u, lower
    row[count, TALL], row[count, CLEAR] = tall, clear
    return count + 1


@compiled
def _shares(side: Side, sub: int, other: int, wall: float) -> tuple[float, float]:
    """Return the widths two neighbours may have whose centres are `wall` + GAP apart."""
    mine, its = side.subs[sub, WIDTH], side.subs[other, WIDTH]
    if side.subs[sub, DOOR] > 0.0:
        return mine, 2.0 * wall - mine
    if side.subs[other, DOOR] > 0.0:
        return 2.0 * wall - its, its
    return 2.0 * wall * mine / (mine + its), 2.0 * wall * its / (mine + its)


@compiled
def spread(rng: np.random.Generator, length: float, width: float, count: int, even: bool) -> Floats:
    """Return `count` centres along a piece: in equal slots, or with uneven gaps that fill it.

    Uneven gaps are drawn, then adapted to the piece by eq. 5 with the gaps as its sizes.
    """
    out = np.empty(count)
    if even or count == 0:
        for k in range(count):
            out[k] = length * (k + 0.5) / count
        return out
    usual = np.empty(count + 1)
    least = np.empty(count + 1)
    for k in range(count + 1):
        usual[k] = (0.4 + 1.4 * rng.random()) * (length / count)
        least[k] = width + GAP
    usual[0], usual[count] = usual[0] / 2, usual[count] / 2
    least[0] = least[count] = width / 2 + EDGE
    most = np.full(count + 1, max(length, width + 1.0))
    ones = np.ones(count + 1)
    gaps = sized(usual, ones, ones, least, most, length)
    at = 0.0
    for k in range(count):
        at += gaps[k]
        out[k] = at
    return out


@compiled
def _neighbour(rng: np.random.Generator, side: Side, p: int, counts: Integers) -> int:
    """Return a piece directly above or below p that holds elements, or −1."""
    chosen = -1
    seen = 0
    for k in range(len(side.stacked)):
        low, high = side.stacked[k]
        q = high if low == p else low
        if (low == p or high == p) and counts[q] + side.pieces[q, 7] > 0:
            seen += 1
            if rng.random() * seen < 1.0:
                chosen = q
    return chosen


@compiled
def follow(side: Side, p: int, q: int, genome: Floats, counts: Integers) -> Floats:
    """Return the centres of q's elements in the frame of p, those that lie in it."""
    shift = side.pieces[q, 1] - side.pieces[p, 1]
    first, fixed = int(side.pieces[q, 6]), int(side.pieces[q, 7])
    out = np.empty(fixed + counts[q])
    n = 0
    for k in range(len(out)):
        own = k - fixed
        if own < 0:
            u = side.fixed[first + k, 1] + side.fixed[first + k, 3] / 2 + shift
        else:
            u = genome[q, own, CENTRE] + shift
        if EDGE + 0.2 <= u <= side.pieces[p, 4] - EDGE - 0.2:
            out[n] = u
            n += 1
    return out[:n]


@compiled
def _thinned(rng: np.random.Generator, centres: Floats) -> Floats:
    """Return the centres without one of them, drawn at random."""
    n = len(centres)
    if n == 0:
        return centres
    gone = int(rng.random() * n)
    for k in range(gone, n - 1):
        centres[k] = centres[k + 1]
    return centres[: n - 1]


@compiled
def _mirrored(centres: Floats, length: float, apart: float) -> Floats:
    """Return centres that mirror themselves: each is kept with its mirror image or left out."""
    out = np.empty(2 * len(centres))
    n = 0
    for i in range(len(centres)):
        u = centres[i]
        image = length - u
        single = abs(u - image) <= 0.05
        free = single or abs(u - image) >= apart
        for k in range(n):
            free = free and abs(out[k] - u) >= apart and abs(out[k] - image) >= apart
        if free:
            out[n] = u
            out[n + 1] = image
            n += 1 if single else 2
    return out[:n]


@compiled
def _number(rng: np.random.Generator, side: Side, p: int, sub: int) -> int:
    """Draw how many elements of a substyle a piece gets: about what the target ratio needs."""
    length, tall = side.pieces[p, 4], side.pieces[p, 5]
    most = int((length - 2 * EDGE + GAP) / (0.9 * side.subs[sub, WIDTH] + GAP))
    most = min(max(most, 0), MOST)
    if rng.random() < 0.1:
        return int(rng.random() * (most + 1))
    ratio = side.targets[0] if not np.isnan(side.targets[0]) else 0.15
    if side.room[p, QUIET] > 0.0:
        ratio *= 0.3
    wanted = ratio * length * tall / (side.subs[sub, WIDTH] * side.subs[sub, HEIGHT])
    return min(max(int(wanted + 1.6 * rng.random() - 0.3), 0), most)


@compiled
def draw_piece(
    rng: np.random.Generator, side: Side, p: int, genome: Floats, counts: Integers
) -> None:
    """Draw a new layout of piece p into the genome of its side."""
    counts[p] = 0
    if side.room[p, OPEN] == 0.0:
        return
    even = rng.random() < 0.15 + 0.75 * side.plan[p]
    row = genome[p]
    n = _draw_door(rng, side, p, even, row) if side.door[0] == p else 0
    if n == 1 and rng.random() < SIDELIGHTS:
        n = _sidelights(side, p, row)
    sub = _window(rng, side, p)
    if sub < 0:
        counts[p] = n
        return
    align = side.targets[2] if not np.isnan(side.targets[2]) else 0.8
    q = _neighbour(rng, side, p, counts) if rng.random() < 0.15 + 0.8 * align else -1
    length, width = side.pieces[p, 4], side.subs[sub, WIDTH]
    if q >= 0:
        centres = follow(side, p, q, genome, counts)
        if rng.random() < 0.3:
            centres = _thinned(rng, centres)
        if even:
            centres = _mirrored(centres, length, width + GAP)
    else:
        uneven = not even and rng.random() < 0.5
        centres = spread(rng, length, width, _number(rng, side, p, sub), not uneven)
        if not even and not uneven:
            centres = _thinned(rng, centres)
    counts[p] = _fill(rng, side, (p, sub, even), centres, row, n)


@compiled
def _window(rng: np.random.Generator, side: Side, p: int) -> int:
    """Draw a piece's substyle of windows: a narrow one where the drawn one is too wide; or −1."""
    sub = pick(rng, side, p, False)
    if sub >= 0 and SQUEEZE * side.subs[sub, WIDTH] + 2.0 * (EDGE + AIR) > side.pieces[p, 4]:
        return int(side.subs[sub, TWIN])
    return sub


@compiled
def _fill(
    rng: np.random.Generator,
    side: Side,
    what: tuple[int, int, bool],
    centres: Floats,
    row: Floats,
    n: int,
) -> int:
    """Place elements at the centres; now and then one (or a mirrored pair) of another kind.

    what: piece, substyle, whether the piece is to be symmetric.
    """
    p, sub, even = what
    m = len(centres)
    other, at = sub, -1
    if m and rng.random() < 0.3:
        other, at = pick(rng, side, p, True), int(rng.random() * m)
        if other < 0:
            at = -1
        elif side.subs[other, DOOR] > 0.0 and even:
            at = m // 2 if m % 2 == 1 else -1
    for k in range(m):
        special = k == at or (
            at >= 0 and even and k == m - 1 - at and side.subs[other, DOOR] == 0.0
        )
        n = place(side, p, other if special else sub, centres[k], row, n)
    return n


@compiled
def _draw_door(rng: np.random.Generator, side: Side, p: int, even: bool, row: Floats) -> int:
    """Place the main door within its range; return 1, or 0 where no place was found."""
    low, high, sub = side.door[1], side.door[2], int(side.door[3])
    middle = side.pieces[p, 4] / 2
    at = (low + high) / 2
    if even and low <= middle <= high:
        at = middle
    elif rng.random() >= side.door[4]:
        at = low + (high - low) * rng.random()
    for _ in range(12):
        if place(side, p, sub, at, row, 0) == 1:
            return 1
        at = low + (high - low) * rng.random()
    return 0


@compiled
def _sidelights(side: Side, p: int, row: Floats) -> int:
    """Place a pair of slim windows beside the door, the row's only element; return how many stand.

    Their substyle is the one that occurs most on the ground of this side; 1 where there is none, or
    no room for both.
    """
    best, most = -1, 0.0
    for k in range(len(side.subs)):
        weight = side.subs[k, GROUND]
        if side.subs[k, SLIM] > 0.0 and weight > most:
            best, most = k, weight
    if best < 0:
        return 1
    away = (side.subs[int(row[0, SUB]), WIDTH] + side.subs[best, WIDTH]) / 2 + GAP + 2 * AIR
    n = place(side, p, best, row[0, CENTRE] - away, row, 1)
    return 3 if place(side, p, best, row[0, CENTRE] + away, row, n) == 3 else 1
