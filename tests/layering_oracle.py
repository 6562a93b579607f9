# ruff: noqa: B905, C901
"""An independent, slow reading of what CONTRACT.md says `layer-solve` minimises.

Every partition of every tuple of words is walked through (layering_walk), linear programmes give Ω
where sizes are free and tell whether a sizing exists. Nothing here is shared with the solver but
the data classes of a problem.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from layering_walk import SYMBOLS, simplex, walk

TOLERANCES = (0.02, 0.05, 0.1, 0.2, 0.4)
SHARES = (0.0, 1 / 16, 1 / 4, 1 / 2, 3 / 4, 1.0)  # of µ: what is found first is least
MOST_PARTITIONS = 300_000
MOST_STEPS = 200_000_000
MOST_PROGRAMMES = 20_000


class TooLarge(Exception):
    """The oracle would take too long."""


@dataclass
class Cell:
    """One letter, or one piece of it, in one column of one row."""

    letter: int
    piece: bool


def least_cost(cost, upper, equal, least):
    """(status, x) of min cost · x with rows (line, right) ≤ or =, x ≥ least; status 0: found."""
    n, slacks = len(cost), len(upper)
    matrix = np.zeros((slacks + len(equal), n + slacks))
    right = np.zeros(len(matrix))
    for i, (line, value) in enumerate([*upper, *equal]):
        matrix[i, :n] = line
        right[i] = value - np.dot(line, least)
    matrix[:slacks, n:] = np.eye(slacks)
    status, x = simplex(np.concatenate([cost, np.zeros(slacks)]), matrix, right)
    return status, x[:n] + least


def unsized_and_known(direction, word):
    counts, known = {}, 0.0
    for a in word:
        size = direction.rules[a.symbol].size
        if size is None:
            counts[a.symbol] = counts.get(a.symbol, 0) + 1
        else:
            known += size
    return counts, known


def eq7(direction, words, mu):
    """Rows (counts, known, least, greatest) of eq. 7."""
    slack = 1e-9 * direction.canvas
    rows, opaque = [], 0.0
    for word in words:
        counts, known = unsized_and_known(direction, word)
        rows.append(
            (counts, known, direction.canvas - mu - opaque - slack, direction.canvas + mu + slack)
        )
        opaque += sum(
            direction.rules[a.symbol].size
            for a in word
            if direction.rules[a.symbol].opaque and not a.transparent
        )
    return rows


def admitted(direction, words, mu):
    rows = eq7(direction, words, mu)
    names = sorted({n for counts, *_ in rows for n in counts})
    if not names:
        return all(low <= known <= high for _, known, low, high in rows)
    upper = []
    for counts, known, low, high in rows:
        line = np.array([counts.get(n, 0) for n in names], float)
        upper += [(line, high - known), (-line, known - low)]
    least = np.full(len(names), 0.01 * direction.canvas)
    return least_cost(np.zeros(len(names)), upper, [], least)[0] == 0


def substrings(direction, word, state, split):
    """Yield (cells, next state) of all that a row may have in the next column, ε first."""
    position, inside = state
    if not inside:
        yield [], state
    clear = position < len(word) and word[position].transparent
    cells = []
    for end in range(position, len(word)):
        if word[end].transparent != clear:
            return
        started = inside and end == position
        if split and clear:
            yield [*cells, Cell(end, True)], (end, True)
        cells = [*cells, Cell(end, started)]
        yield list(cells), (end + 1, False)


def options_of(direction, words, split, mu, symbols):
    """(table, first option of each row's states, cells, least sizes to come) for `walk`."""
    table, cells = [], []
    states = 2 * max(map(len, words)) + 3
    begin = np.zeros((len(words), states + 1), np.int64)
    rest = np.zeros((len(words), states))
    most = direction.canvas + mu
    for row, word in enumerate(words):
        for state in range(states):
            begin[row, state] = len(table)
            position, inside = divmod(state, 2)
            if position > len(word) or (position == len(word) and inside):
                continue
            rest[row, state] = sum(
                direction.rules[a.symbol].size or 0.01 * direction.canvas
                for a in word[position + inside :]
            )
            for own, (then, still) in substrings(direction, word, (position, bool(inside)), split):
                table.append([2 * then + still, *described(direction, word, own, most, symbols)])
                cells.append(own)
        begin[row, states] = len(table)
    return np.array(table, float), begin, cells, rest


def described(direction, word, cells, most, symbols):
    """What `walk` reads of a substring, but for the state that it leads to."""
    rules = [direction.rules[word[c.letter].symbol] for c in cells]
    clear = [word[c.letter].transparent for c in cells]
    low = high = 0.0
    for c, rule in zip(cells, rules):
        low += 0.0 if c.piece else rule.size or 0.01 * direction.canvas
        high += rule.size or most
    counts = [sum(word[c.letter].symbol == s and not c.piece for c in cells) for s in symbols]
    return (
        len(cells),
        all(clear),
        bool(cells) and all(r.opaque and not t for r, t in zip(rules, clear)),
        any(r.unoccludable for r in rules),
        bool(cells) and rules[0].attached,
        bool(cells) and rules[-1].attached,
        low,
        high,
        sum(c.piece for c in cells),
        *counts,
    )


def partitions(direction, words, split, mu, most, patience=1):
    """Return (Ω at least, pieces, −columns, columns of cells) of all that may count.

    most: greatest Ω that known sizes may ask for.
    """
    symbols = sorted({a.symbol for word in words for a in word})
    table, begin, cells, rest = options_of(direction, words, split, mu, symbols)
    ends = np.array([2 * len(word) for word in words])
    sizes = [direction.rules[s].size for s in symbols]
    least = np.array([0.01 * (direction.canvas if z is None else z) for z in sizes])
    slack = 1e-9 * direction.canvas
    m = len(words)
    assert table.shape[1] == SYMBOLS + len(symbols)
    for rows in (1_000, 16_000, patience * MOST_PARTITIONS):
        found, columns, omega, pieces, all_ = walk(
            table, begin, ends, rest, m, len(symbols), least, most + slack,
            direction.canvas + mu + slack, rows, patience * MOST_STEPS,
        )  # fmt: skip
        if all_:
            break
    else:
        raise TooLarge
    for choice, count, value, cuts in zip(found, columns, omega, pieces):
        taken = [[choice[j * m + r] for r in range(m)] for j in range(count)]
        yield round(value, 7), int(cuts), -int(count), [[cells[k] for k in col] for col in taken]


def whole(columns):
    """Return how many pieces every split letter has."""
    counts = {}
    for column in columns:
        for row, cells in enumerate(column):
            for c in cells:
                if c.piece:
                    counts[row, c.letter] = counts.get((row, c.letter), 0) + 1
    return counts


def error(direction, words, columns, mu):
    """(Ω, Σ) of a partition by a linear programme; None where no sizes are admitted."""
    canvas, slack = direction.canvas, 1e-9 * direction.canvas
    pieces = whole(columns)
    names = sorted({a.symbol for w in words for a in w if direction.rules[a.symbol].size is None})
    if not pieces and not names:
        omega = sigma = 0.0
        for column in columns:
            values = [
                sum(direction.rules[w[c.letter].symbol].size for c in cells)
                for w, cells in zip(words, column)
                if cells
            ]
            omega, sigma = omega + max(values) - min(values), sigma + max(values)
        return (omega, sigma) if omega <= mu + slack and sigma <= canvas + mu + slack else None
    place = {n: i for i, n in enumerate(names)}
    for j, column in enumerate(columns):
        for row, cells in enumerate(column):
            for c in cells:
                if c.piece:
                    place[row, c.letter, j] = len(place)
    n, k = len(place), len(columns)
    upper, equal = [], []
    for j, column in enumerate(columns):
        for row, cells in enumerate(column):
            if not cells:
                continue
            line, known = np.zeros(n + 2 * k), 0.0
            for c in cells:
                symbol = words[row][c.letter].symbol
                if c.piece:
                    line[place[row, c.letter, j]] += 1
                elif direction.rules[symbol].size is None:
                    line[place[symbol]] += 1
                else:
                    known += direction.rules[symbol].size
            up, down = line.copy(), -line
            up[n + j] -= 1
            down[n + k + j] += 1
            upper += [(up, -known), (down, known)]
    for row, letter in pieces:
        line = np.zeros(n + 2 * k)
        for j in range(k):
            if (row, letter, j) in place:
                line[place[row, letter, j]] = 1
        symbol = words[row][letter].symbol
        size = direction.rules[symbol].size
        if size is None:
            line[place[symbol]] -= 1
        equal.append((line, size or 0.0))
    total = np.zeros(n + 2 * k)
    total[n : n + k] = 1
    upper.append((total, canvas + mu + slack))
    for counts, known, low, high in eq7(direction, words, mu):
        line = np.zeros(n + 2 * k)
        for name, times in counts.items():
            line[place[name]] = times
        upper += [(line, high - known), (-line, known - low)]
    least = np.zeros(n + 2 * k)
    least[: len(names)] = 0.01 * canvas
    cost = np.zeros(n + 2 * k)
    cost[n : n + k], cost[n + k :] = 1, -1
    status, x = least_cost(cost, upper, equal, least)
    if status != 0 or cost @ x > mu + 2 * slack:
        return None
    return max(0.0, float(cost @ x)), float(x[n : n + k].sum())


def sizable(direction, words, columns):
    """Tell whether positive sizes fill the canvas, by a linear programme."""
    canvas = direction.canvas
    symbols = sorted({a.symbol for w in words for a in w})
    place = {s: i for i, s in enumerate(symbols)}
    pieces = {}
    for j, column in enumerate(columns):
        for row, cells in enumerate(column):
            for c in cells:
                if c.piece:
                    pieces.setdefault((row, c.letter), []).append(len(place))
                    place[row, c.letter, j] = len(place)
    equal = []
    fill = np.zeros(len(place))
    for j, column in enumerate(columns):
        first = None
        for row, cells in enumerate(column):
            if not cells:
                continue
            line = np.zeros(len(place))
            for c in cells:
                line[place[(row, c.letter, j) if c.piece else words[row][c.letter].symbol]] += 1
            if first is None:
                first = line
                fill += line
            else:
                equal.append((line - first, 0.0))
    for (row, letter), places in pieces.items():
        line = np.zeros(len(place))
        line[places] = 1
        line[place[words[row][letter].symbol]] -= 1
        equal.append((line, 0.0))
    equal.append((fill, 1.0))
    sizes = [direction.rules[s].size for s in symbols]
    least = np.zeros(len(place))
    least[: len(symbols)] = [0.01 * s / canvas if s else 0.01 for s in sizes]
    return least_cost(np.zeros(len(place)), [], equal, least)[0] == 0


def best(direction, words_of_layers, patience=1):
    """(µ/canvas, Ω, pieces, columns, |Σ − canvas|) of the contract's answer, or None.

    words_of_layers: all words of every layer, topmost first. patience: how many times more than
    the tests have time for. Raises TooLarge.
    """
    for share in TOLERANCES:
        mu = share * direction.canvas
        candidates = [
            words for words in itertools.product(*words_of_layers) if admitted(direction, words, mu)
        ]
        for split in (False, True):
            for part in SHARES:
                found = best_within(direction, candidates, split, mu, part * mu, patience)
                if found is not None:
                    return (share, *found)
    return None


def best_within(direction, candidates, split, mu, most, patience):
    """(Ω, pieces, columns, |Σ − canvas|) of the best sizable partition with Ω ≤ most, or None.

    Partitions come by what they are at best; those that cannot go before what is known are left.
    """
    rows = []
    for words in candidates:
        found = partitions(direction, words, split, mu, most, patience)
        for floor, pieces, columns, cells in found:
            rows.append(((floor, pieces, columns), words, cells))
    winner = None
    for number, (floor, words, cells) in enumerate(sorted(rows, key=lambda row: row[0])):
        if winner is not None and floor > winner[:3]:
            break
        if number > patience * MOST_PROGRAMMES:
            raise TooLarge
        value = error(direction, words, cells, mu)
        if value is None or value[0] > most + 1e-9 * direction.canvas:
            continue
        key = round(value[0], 7), *floor[1:], round(abs(value[1] - direction.canvas), 7)
        if (winner is None or key < winner) and sizable(direction, words, cells):
            winner = key
    if winner is None:
        return None
    omega, pieces, columns, off = winner
    return omega, pieces, -columns, off
