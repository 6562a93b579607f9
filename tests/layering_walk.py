"""Loops of the brute force: all partitions of a tuple of words, and a plain simplex method.

Nothing here is shared with the solver. The walk builds partitions column by column and turns back
only where no completion can count: an interval of Ω or Σ that is out of reach, a constraint of
IMAW15 5.2 that is broken, sizes that no positive numbers can have.
"""

from __future__ import annotations

import numba
import numpy as np

# Columns of what a row can have in a column (floats), by its state 2 · letters + inside.
NEXT, CELLS, CLEAR, SOLID, BARE, FIRST, LAST, LOW, HIGH, PIECES = range(10)
SYMBOLS = 10  # from this column on: how often each symbol stands in it whole


@numba.njit(cache=True, nogil=True)
def walk(options, begin, ends, rest, m, kinds, least, most, widest, rows, steps):  # noqa: C901
    """(choices, columns, Ω at least, pieces) of partitions, and whether these are all.

    options: of all rows; begin (rows, states + 1): the first of each state. ends: last state of a
    row. rest (rows, states): least size from a state on. kinds: number of symbols. least: of each.
    """
    deep = 30
    found = np.zeros((rows, deep * m), np.int16)
    columns = np.zeros(rows, np.int64)
    value = np.zeros(rows)
    cuts = np.zeros(rows, np.int64)
    count = 0
    state = np.zeros((deep + 1, m), np.int64)
    choice = np.zeros(deep * m, np.int64)
    omega, sigma = np.zeros(deep + 1), np.zeros(deep + 1)
    pieces = np.zeros(deep + 1, np.int64)
    upper, lower = np.zeros(deep * m + 1), np.zeros(deep * m + 1)
    basis = np.zeros((kinds + 1, kinds))
    rank = np.zeros(deep + 1, np.int64)
    level, done = 0, 0
    choice[0] = begin[0, 0] - 1
    while level >= 0:
        done += 1
        if done > steps:
            return found[:count], columns[:count], value[:count], cuts[:count], False
        d, r = level // m, level % m
        choice[level] += 1
        if choice[level] >= begin[r, state[d, r] + 1]:
            level -= 1
            continue
        mine = options[choice[level]]
        up, low = (0.0, 1e300) if r == 0 else (upper[level - 1], lower[level - 1])
        if mine[CELLS]:
            up, low = max(up, mine[LOW]), min(low, mine[HIGH])
        upper[level], lower[level] = up, low
        if omega[d] + max(0.0, up - low) > most or sigma[d] + up > widest:
            continue
        if r < m - 1:
            level += 1
            choice[level] = begin[r + 1, state[d, r + 1]] - 1
            continue
        at = d * m
        if not allowed(options, choice, at, m, d > 0):
            continue
        omega[d + 1] = omega[d] + max(0.0, up - low)
        sigma[d + 1], pieces[d + 1] = sigma[d] + up, pieces[d]
        over = True
        ahead = 0.0
        for i in range(m):
            then = options[choice[at + i]]
            state[d + 1, i] = int(then[NEXT])
            pieces[d + 1] += int(then[PIECES])
            over = over and state[d + 1, i] == ends[i]
            ahead = max(ahead, rest[i, state[d + 1, i]])
        if sigma[d + 1] + ahead > widest:
            continue
        rank[d + 1] = consistent(options, choice, at, m, kinds, basis, rank[d], least)
        if rank[d + 1] < 0:
            continue
        if over:
            if count >= rows:
                return found, columns, value, cuts, False
            found[count, : at + m] = choice[: at + m]
            columns[count], value[count], cuts[count] = d + 1, omega[d + 1], pieces[d + 1]
            count += 1
            continue
        level += 1
        choice[level] = begin[0, state[d + 1, 0]] - 1
    return found[:count], columns[:count], value[:count], cuts[:count], True


@numba.njit(cache=True, nogil=True)
def allowed(options, choice, at, m, later):
    """The constraints of IMAW15 5.2 as the contract reads them, of one column and its left one."""
    solid = covered = False
    for i in range(m):
        mine = options[choice[at + i]]
        if mine[CELLS]:
            solid = solid or mine[SOLID] > 0
            if mine[BARE] and covered:
                return False
            covered = covered or not mine[CLEAR]
        if later:
            left = options[choice[at - m + i]]
            if left[CELLS] and left[LAST] and not mine[CELLS]:
                return False
            if mine[CELLS] and mine[FIRST] and not left[CELLS]:
                return False
    return solid


@numba.njit(cache=True, nogil=True)
def consistent(options, choice, at, m, kinds, basis, rank, least):
    """The rank of all equations between substrings up to this column; -1: no sizes satisfy them."""
    reference = -1
    grown = rank
    for i in range(m):
        mine = options[choice[at + i]]
        if not mine[CELLS] or mine[PIECES]:
            continue
        if reference < 0:
            reference = choice[at + i]
            continue
        line = mine[SYMBOLS : SYMBOLS + kinds] - options[reference, SYMBOLS : SYMBOLS + kinds]
        if not (line.max() > 0 and line.min() < 0) and (line.max() > 0 or line.min() < 0):
            return -1  # a part of another
        for k in range(grown):
            pivot = 0
            while basis[k, pivot] == 0.0:
                pivot += 1
            line -= basis[k] * (line[pivot] / basis[k, pivot])
        line[np.abs(line) < 1e-9] = 0.0
        if np.any(line != 0.0):
            basis[grown] = line
            grown += 1
    if grown > rank:
        if grown == kinds:
            return -1  # only zero is left
        total = -basis[:grown] @ least
        status, _ = simplex(np.zeros(kinds), basis[:grown], total)
        if status:
            return -1
    return grown


@numba.njit(cache=True, nogil=True)
def simplex(cost, matrix, right):
    """(0, x) with least cost · x among matrix · x = right, x ≥ 0; (1, …) where there is none."""
    rows, n = matrix.shape
    width = n + rows + 1
    table = np.zeros((rows + 1, width))
    base = np.zeros(rows, np.int64)
    for i in range(rows):
        sign = -1.0 if right[i] < 0 else 1.0
        table[i, :n] = sign * matrix[i]
        table[i, n + i], table[i, -1] = 1.0, sign * right[i]
        table[rows, :n] -= table[i, :n]
        table[rows, -1] -= table[i, -1]
        base[i] = n + i
    pivoted(table, base, n)
    x = np.zeros(n)
    if table[rows, -1] < -1e-7:
        return 1, x
    for i in range(rows):  # artificial variables at zero leave, or their row means nothing
        if base[i] >= n:
            best = np.argmax(np.abs(table[i, :n]))
            if abs(table[i, best]) > 1e-7:
                exchange(table, base, i, best)
    table[rows, :] = 0.0
    table[rows, :n] = cost
    for i in range(rows):
        if base[i] < n:
            table[rows] -= table[i] * table[rows, base[i]]
    pivoted(table, base, n)
    for i in range(rows):
        if base[i] < n:
            x[base[i]] = table[i, -1]
    return 0, x


@numba.njit(cache=True, nogil=True)
def pivoted(table, base, n):
    """Go on by Bland's rule, which never circles, until no column is worth it."""
    rows = len(base)
    for _ in range(20_000):
        enter = -1
        for j in range(n):
            if table[rows, j] < -1e-9:
                enter = j
                break
        if enter < 0:
            return
        leave, best = -1, 0.0
        for i in range(rows):
            if table[i, enter] > 1e-9:
                ratio = table[i, -1] / table[i, enter]
                tie = leave >= 0 and abs(ratio - best) <= 1e-12
                if leave < 0 or (base[i] < base[leave] if tie else ratio < best):
                    leave, best = i, ratio
        if leave < 0:
            return  # unbounded: does not occur here
        exchange(table, base, leave, enter)


@numba.njit(cache=True, nogil=True)
def exchange(table, base, leave, enter):
    table[leave] /= table[leave, enter]
    for i in range(len(table)):
        if i != leave and table[i, enter] != 0.0:
            table[i] -= table[leave] * table[i, enter]
    base[leave] = enter
