"""Branch and bound over the columns of an alignment, in compiled scalar code.

The label search (kernels.py) is short where sizes fit. Where most paths of small Ω have no sizing,
or unsized symbols make Ω a matter of several columns together, it has to rule out one path after
another. This walk builds alignments column by column, and turns back where the columns so far
have no sizing (a linear programme over the sizes of the symbols), or where no unsized sizes keep
Ω below what is known (another one).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled
from .kernels_columns import advanced, contradicts, occluded
from .kernels_labels import (
    AFTER,
    CANVAS,
    HAS_GRIPS,
    HIGH,
    IS_SOLID,
    LEAST,
    LOW,
    MOST,
    OPEN,
    REST,
    TO_PLACE,
    WEIGHT,
    WIDEST,
    finished,
)
from .kernels_pairs import hopeless, to_come
from .kernels_simplex import IMPOSSIBLE
from .kernels_sizes import dependent, least_error_of, sizable

Array = Any  # numba knows their exact types
# Entries of `best`: what is known, of which nothing worse is wanted; SLACK of Ω; leaves KEPT.
OMEGA, PIECES, COLUMNS, OFF, SLACK, KEPT, LOST = range(7)
NONE = np.int64(2**62)
TAKEN, SKIPPED, DONE = range(3)


@compiled
def walk(net: Any, sizing: Any, frame: Any, best: Array, leaves: Array, most: int) -> bool:
    """Go on for at most so many steps; return whether everything has been walked through.

    net: what kernels.search reads. frame: where the walk stands (see walk.py). leaves
    (n, columns + 1, m): codes of the borders of all that tie for the best, -1 after the last.
    """
    m = len(net.starts) - 1
    level = frame.at[0]
    while level >= 0:
        if most <= 0:
            frame.at[0] = level
            return False
        most -= 1
        d, k = level // m, level % m
        verdict = _take(net, frame, best, d, k)
        if verdict == DONE:
            level -= 1
        elif verdict == TAKEN:
            if k < m - 1:
                level += 1
                frame.option[d, k + 1] = 0
            elif _column(net, sizing, frame, best, leaves, d):
                level += 1
                frame.option[d + 1, 0] = 0
                frame.upper[d + 1, 0], frame.lower[d + 1, 0] = 0, NONE
                frame.opaque[d + 1, 0], frame.cut[d + 1, 0] = 0, 0
    frame.at[0] = -1
    return True


@compiled
def _take(  # noqa: C901 - called once a step
    net: Any, frame: Any, best: Array, d: int, k: int
) -> int:
    """Let a row take what it has not yet had in a column."""
    places, steps, limits = net.places, net.steps, net.limits
    if not (frame.opaque[d, k] or net.able[k]):
        return DONE
    r = net.order[k]
    option = frame.option[d, k]
    frame.option[d, k] += 1
    here, gap = frame.code[d, r] >> 2, frame.code[d, r] & 1
    inside = places[here, OPEN]
    upper, lower = frame.upper[d, k], frame.lower[d, k]
    sigma, spare = frame.sigma[d], best[OMEGA] + best[SLACK] - frame.omega[d]
    if option == 0:
        if inside or places[here, AFTER] or (sigma + upper + places[here, REST] > limits[WIDEST]):
            return SKIPPED
        need, there, step = np.int64(0), here, np.int64(-1)
        largest, smallest, solid, pieces = upper, lower, frame.opaque[d, k], np.int64(0)
    else:
        step = net.first[here] + option - 1
        if step >= net.first[here + 1]:
            return DONE
        if gap and steps[step, HAS_GRIPS]:
            return SKIPPED
        there = steps[step, TO_PLACE]
        opened = places[there, OPEN]
        need, bottom, top = np.int64(0), np.int64(0), np.int64(0)
        pieces = np.int64(inside)
        if inside and there == here:
            cap = places[here, MOST] - frame.reach[d, r, 1]
        else:
            if inside:
                bottom = max(np.int64(0), places[here, LEAST] - frame.reach[d, r, 0])
                top = places[here, MOST] - frame.reach[d, r, 1]
            bottom += steps[step, LOW]
            top += steps[step, HIGH]
            need, cap = bottom, top
            if opened:
                cap += places[there, MOST]
                pieces += 1
        largest, smallest = max(upper, need), min(lower, cap)
        if need - lower > spare or sigma + largest > limits[WIDEST]:
            return DONE
        if largest - smallest > spare:
            return SKIPPED
        if not opened and sigma + largest + places[there, REST] > limits[WIDEST]:
            return SKIPPED
        frame.low[d, r], frame.high[d, r] = bottom, top
        solid = 1 if steps[step, IS_SOLID] else frame.opaque[d, k]
    error = max(np.int64(0), largest - smallest)
    if len(net.guide[1]) > 0 and hopeless(
        r, there, k, net.order, frame.now[d], spare - error, limits[WIDEST] - sigma - largest,
        net.starts, net.guide,
    ):  # fmt: skip
        return SKIPPED
    frame.now[d, r] = there
    frame.taken[d, r] = step
    frame.upper[d, k + 1], frame.lower[d, k + 1] = largest, smallest
    frame.opaque[d, k + 1] = solid
    frame.cut[d, k + 1] = frame.cut[d, k] + pieces * net.rows[r, WEIGHT]
    return TAKEN


@compiled
def _column(net: Any, sizing: Any, frame: Any, best: Array, leaves: Array, d: int) -> bool:
    """Check a column that every row has chosen for; keep it if it is the last one.

    Return whether the walk goes on behind it.
    """
    m = len(net.starts) - 1
    places, limits = net.places, net.limits
    upper, lower = frame.upper[d, m], frame.lower[d, m]
    if lower >= NONE or not frame.opaque[d, m] or occluded(m, net.steps, frame.taken[d]):
        return False
    size = frame.sigma[d] + upper
    progress, fewest = advanced(
        m, net.rows, places, net.steps, limits, net.ahead, frame.code[d], frame.taken[d], upper,
        lower, frame.low[d], frame.high[d], frame.reach[d], frame.code[d + 1],
        frame.reach[d + 1], size,
    )  # fmt: skip
    if progress < 0:
        return False
    frame.sigma[d + 1] = size
    frame.omega[d + 1] = frame.omega[d] + max(np.int64(0), upper - lower)
    frame.pieces[d + 1] = frame.pieces[d] + frame.cut[d, m]
    if not _wanted(net, frame, best, d + 1, fewest):
        return False
    if contradicts(m, places, frame.code[d], frame.code[d + 1], frame.taken[d], net.tally):
        return False
    over = finished(frame.code[d + 1], places, limits, net.rows, net.stack)
    if not sizable(net, sizing, frame, d, False):
        return False
    if len(sizing.low) and (over or dependent(net, sizing, frame, d)):
        floor = least_error_of(net, sizing, frame, d, (best[OMEGA] + best[SLACK]) / sizing.units[0])
        if floor >= IMPOSSIBLE:
            return False
        frame.omega[d + 1] = max(frame.omega[d + 1], np.int64(floor * sizing.units[0]))
        if not _wanted(net, frame, best, d + 1, fewest):
            return False
    if over and sizable(net, sizing, frame, d, True):
        _keep(net, sizing, frame, best, leaves, d + 1)
    more = False
    for r in range(m):
        here = frame.code[d + 1, r] >> 2
        more = more or net.first[here + 1] > net.first[here]
    return more and d + 2 < len(frame.option)


@compiled
def _wanted(net: Any, frame: Any, best: Array, d: int, fewest: int) -> Any:
    """Tell whether what begins so may still tie with the best that is known."""
    m = len(net.starts) - 1
    omega = frame.omega[d] + to_come(m, frame.code[d], net.starts, net.guide)
    if omega > best[OMEGA] + best[SLACK]:
        return False
    if omega < best[OMEGA] - best[SLACK] or frame.pieces[d] < best[PIECES]:
        return True
    return frame.pieces[d] == best[PIECES] and d + fewest >= best[COLUMNS]


@compiled
def _keep(net: Any, sizing: Any, frame: Any, best: Array, leaves: Array, d: int) -> None:
    """Put an alignment among the best, or in their place."""
    omega, pieces = frame.omega[d], frame.pieces[d]
    off = abs(frame.sigma[d] - net.limits[CANVAS]) if len(sizing.low) == 0 else np.int64(0)
    slack = best[SLACK]
    if omega > best[OMEGA] + slack:
        return
    ahead = omega < best[OMEGA] - slack
    if not ahead:
        mine = (pieces, -d, off)
        theirs = (best[PIECES], -best[COLUMNS], best[OFF])
        if mine > theirs:
            return
        ahead = mine < theirs
    if ahead:
        best[KEPT], best[LOST] = 0, 0
        best[OMEGA] = omega
        best[PIECES], best[COLUMNS], best[OFF] = pieces, d, off
    best[OMEGA] = min(best[OMEGA], omega)
    if best[KEPT] >= len(leaves):
        best[LOST] = 1
        return
    leaf = leaves[best[KEPT]]
    leaf[:] = -1
    leaf[: d + 1] = frame.code[: d + 1]
    best[KEPT] += 1
