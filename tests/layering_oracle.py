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


def eq7(direction, words, mu, parts=()):
    """Rows (counts, known, least, greatest) of eq. 7; parts: layers of each alignment group."""
    slack = 1e-9 * direction.canvas
    rows, opaque = [], 0.0
    tops = set(itertools.accumulate(parts))
    for layer, word in enumerate(words):
        opaque = 0.0 if layer in tops else opaque
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


def admitted(direction, words, mu, parts=()):
    rows = eq7(direction, words, mu, parts)
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
    for rows in (1_000, 16_000, int(patience * MOST_PARTITIONS)):
        found, columns, omega, pieces, all_ = walk(
            table, begin, ends, rest, m, len(symbols), least, most + slack,
            direction.canvas + mu + slack, rows, int(patience * MOST_STEPS),
        )  # fmt: skip
        if all_:
            break
    else:
        raise TooLarge
    for choice, count, value, cuts in zip(found, columns, omega, pieces):
        taken = [[choice[j * m + r] for r in range(m)] for j in range(count)]
        yield round(value, 7), int(cuts), -int(count), [[cells[k] for k in col] for col in taken]


def whole(groups):
    """Return how many pieces every split letter (group, row, letter) has."""
    counts = {}
    for g, (_, columns) in enumerate(groups):
        for column in columns:
            for row, cells in enumerate(column):
                for c in cells:
                    if c.piece:
                        counts[g, row, c.letter] = counts.get((g, row, c.letter), 0) + 1
    return counts


def error(direction, groups, mu):
    """(Ω, Σ) of the partitions of alignment groups by a linear programme, summed over them.

    groups: (words, columns) of each. None where no sizes are admitted.
    """
    canvas, slack = direction.canvas, 1e-9 * direction.canvas
    pieces = whole(groups)
    every = [word for words, _ in groups for word in words]
    names = sorted({a.symbol for w in every for a in w if direction.rules[a.symbol].size is None})
    if not pieces and not names:
        return known_error(direction, groups, mu)
    place = {n: i for i, n in enumerate(names)}
    flat = [(g, words, column) for g, (words, columns) in enumerate(groups) for column in columns]
    for j, (g, _, column) in enumerate(flat):
        for row, cells in enumerate(column):
            for c in cells:
                if c.piece:
                    place[g, row, c.letter, j] = len(place)
    n, k = len(place), len(flat)
    upper, equal = [], []
    for j, (g, words, column) in enumerate(flat):
        for row, cells in enumerate(column):
            if not cells:
                continue
            line, known = np.zeros(n + 2 * k), 0.0
            for c in cells:
                symbol = words[row][c.letter].symbol
                if c.piece:
                    line[place[g, row, c.letter, j]] += 1
                elif direction.rules[symbol].size is None:
                    line[place[symbol]] += 1
                else:
                    known += direction.rules[symbol].size
            up, down = line.copy(), -line
            up[n + j] -= 1
            down[n + k + j] += 1
            upper += [(up, -known), (down, known)]
    for g, row, letter in pieces:
        line = np.zeros(n + 2 * k)
        for j in range(k):
            if (g, row, letter, j) in place:
                line[place[g, row, letter, j]] = 1
        symbol = groups[g][0][row][letter].symbol
        size = direction.rules[symbol].size
        if size is None:
            line[place[symbol]] -= 1
        equal.append((line, size or 0.0))
    for g in range(len(groups)):
        total, value = np.zeros(n + 2 * k), np.zeros(n + 2 * k)
        for j in range(k):
            if flat[j][0] == g:
                total[n + j] = value[n + j] = 1
                value[n + k + j] = -1
        upper += [(total, canvas + mu + slack), (value, mu + slack)]
    for counts, known, low, high in eq7(direction, every, mu, [len(words) for words, _ in groups]):
        line = np.zeros(n + 2 * k)
        for name, times in counts.items():
            line[place[name]] = times
        upper += [(line, high - known), (-line, known - low)]
    least = np.zeros(n + 2 * k)
    least[: len(names)] = 0.01 * canvas
    cost = np.zeros(n + 2 * k)
    cost[n : n + k], cost[n + k :] = 1, -1
    status, x = least_cost(cost, upper, equal, least)
    if status != 0:
        return None
    return max(0.0, float(cost @ x)), float(x[n : n + k].sum())


def known_error(direction, groups, mu):
    """(Ω, Σ) where all sizes are known."""
    canvas, slack = direction.canvas, 1e-9 * direction.canvas
    sums = []
    for words, columns in groups:
        omega = sigma = 0.0
        for column in columns:
            values = [
                sum(direction.rules[w[c.letter].symbol].size for c in cells)
                for w, cells in zip(words, column)
                if cells
            ]
            omega, sigma = omega + max(values) - min(values), sigma + max(values)
        if omega > mu + slack or sigma > canvas + mu + slack:
            return None
        sums.append((omega, sigma))
    return tuple(map(sum, zip(*sums)))


def sizable(direction, groups):
    """Tell whether positive sizes fill the canvas in all groups, by a linear programme."""
    canvas = direction.canvas
    symbols = sorted({a.symbol for words, _ in groups for w in words for a in w})
    place = {s: i for i, s in enumerate(symbols)}
    pieces = {}
    equal = []
    flat = [(g, words, column) for g, (words, columns) in enumerate(groups) for column in columns]
    for j, (g, _, column) in enumerate(flat):
        for row, cells in enumerate(column):
            for c in cells:
                if c.piece:
                    pieces.setdefault((g, row, c.letter), []).append(len(place))
                    place[g, row, c.letter, j] = len(place)
    fill = np.zeros((len(groups), len(place)))
    for j, (g, words, column) in enumerate(flat):
        first = None
        for row, cells in enumerate(column):
            if not cells:
                continue
            line = np.zeros(len(place))
            for c in cells:
                at = (g, row, c.letter, j) if c.piece else words[row][c.letter].symbol
                line[place[at]] += 1
            if first is None:
                first = line
                fill[g] += line
            else:
                equal.append((line - first, 0.0))
    for (g, row, letter), places in pieces.items():
        line = np.zeros(len(place))
        line[places] = 1
        line[place[groups[g][0][row][letter].symbol]] -= 1
        equal.append((line, 0.0))
    equal += [(line, 1.0) for line in fill]
    sizes = [direction.rules[s].size for s in symbols]
    least = np.zeros(len(place))
    least[: len(symbols)] = [0.01 * s / canvas if s else 0.01 for s in sizes]
    return least_cost(np.zeros(len(place)), [], equal, least)[0] == 0


def best(direction, words_of_layers, patience=1):
    """Return `best_of` all tuples of the words of every layer, topmost first."""
    return best_of(direction, list(itertools.product(*words_of_layers)), patience)


def best_of(direction, tuples, patience=1, parts=()):
    """(µ/canvas, Ω, pieces, columns, |Σ − canvas|, layout) of the contract's answer, or None.

    tuples: of words, one a layer, topmost first, alignment groups one after another; parts: layers
    of each. Ω, pieces and columns are sums over the groups; layout: names of words and columns
    that are the smallest, where all sizes are known. patience: how many times more than the tests
    have time for. Raises TooLarge.
    """
    parts = parts or (len(tuples[0]) if tuples else 0,)
    for share in TOLERANCES:
        mu = share * direction.canvas
        candidates = [words for words in tuples if admitted(direction, words, mu, parts)]
        for split in (False, True):
            for part in SHARES:
                found = best_within(
                    direction, candidates, split, mu, part * mu * len(parts), patience, parts
                )
                if found is not None:
                    return (share, *found)
    return None


def best_within(direction, candidates, split, mu, most, patience, parts):
    """(Ω, pieces, columns, |Σ − canvas|, layout) of the best sizable partition with Ω ≤ most.

    None where there is none. Partitions come by what they are at best; those that cannot go before
    what is known are left.
    """
    rows = []
    for words in candidates:
        ends = list(itertools.accumulate(parts))
        split_words = [words[end - size : end] for end, size in zip(ends, parts)]
        lists = [
            list(partitions(direction, own, split, mu, min(most, mu), patience))
            for own in split_words
        ]
        for several in itertools.product(*lists):
            floor, pieces, columns = map(sum, list(zip(*several))[:3])
            if floor <= most + 1e-6:
                cells = [one[3] for one in several]
                key = round(floor, 7), pieces, columns
                rows.append((key, list(zip(split_words, cells))))
            if len(rows) > 10 * patience * MOST_PROGRAMMES:
                raise TooLarge
    winner = None
    for number, (floor, groups) in enumerate(sorted(rows, key=lambda row: row[0])):
        if winner is not None and floor > winner[:3]:
            break
        if number > patience * MOST_PROGRAMMES:
            raise TooLarge
        value = error(direction, groups, mu)
        if value is None or value[0] > most + 1e-9 * direction.canvas:
            continue
        off = round(abs(value[1] - direction.canvas * len(parts)), 7)
        key = round(value[0], 7), *floor[1:], off, names(groups)
        if (winner is None or key < winner) and sizable(direction, groups):
            winner = key
    if winner is None:
        return None
    omega, pieces, columns, *rest = winner
    return omega, pieces, -columns, *rest


def names(groups):
    """Return the names of all words and of all columns."""
    words = tuple(tuple(a.name for a in word) for words, _ in groups for word in words)
    columns = tuple(
        tuple(tuple(words[row][c.letter].name for c in column[row]) for column in cells)
        for words, cells in groups
        for row in range(len(words))
    )
    return words, columns
