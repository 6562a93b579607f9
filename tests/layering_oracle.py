# ruff: noqa: B905, C901
"""An independent, slow reading of what CONTRACT.md says `layer-solve` minimises.

Words are enumerated outright, every partition is built column by column, linear programmes give
Ω where sizes are free and tell whether a sizing exists. Nothing here is shared with the solver
but the data classes of a problem.
"""

from __future__ import annotations

import itertools
import random
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog, nnls

from facade_tools.layering.language import parse
from facade_tools.layering.problem import Direction, LayerPattern, Rule

TOLERANCES = (0.02, 0.05, 0.1, 0.2, 0.4)
MOST_PARTITIONS = 200_000
MOST_STEPS = 4_000_000


class TooLarge(Exception):
    """The oracle would take too long."""


@dataclass
class Cell:
    """One letter, or one piece of it, in one column of one row."""

    letter: int
    piece: bool


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
    a, b = [], []
    for counts, known, low, high in rows:
        line = np.array([counts.get(n, 0) for n in names], float)
        a += [line, -line]
        b += [high - known, known - low]
    bounds = [(0.01 * direction.canvas, None)] * len(names)
    return linprog(np.zeros(len(names)), A_ub=a, b_ub=b, bounds=bounds).status == 0


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


def allowed(direction, words, column, before):
    """The constraints of IMAW15 5.2 as papers/README.md reads them."""
    rules = direction.rules
    letters = [[w[c.letter] for c in cells] for w, cells in zip(words, column)]
    if not any(
        row and all(rules[a.symbol].opaque and not a.transparent for a in row) for row in letters
    ):
        return False
    for i, row in enumerate(letters):
        if any(rules[a.symbol].unoccludable for a in row):
            for above in letters[:i]:
                if above and not all(a.transparent for a in above):
                    return False
    if before is not None:
        previous = [[w[c.letter] for c in cells] for w, cells in zip(words, before)]
        for left, right in zip(previous, letters):
            if left and rules[left[-1].symbol].attached and not right:
                return False
            if right and rules[right[0].symbol].attached and not left:
                return False
    return True


def least(direction, letters):
    """A lower bound on the size of letters: unsized ones at their least."""
    sizes = [direction.rules[a.symbol].size for a in letters]
    return sum(0.01 * direction.canvas if size is None else size for size in sizes)


def partitions(direction, words, split, mu, most):
    """Yield all partitions (a list of columns) that the constraints and known sizes allow.

    most: greatest Ω that known sizes may ask for.
    """
    count = 0
    canvas, slack = direction.canvas, 1e-9 * direction.canvas
    rest = [[least(direction, w[k:]) for k in range(len(w) + 2)] for w in words]
    steps = {}

    def options_of(row, state):
        if (row, state) not in steps:
            steps[row, state] = list(substrings(direction, words[row], state, split))
        return steps[row, state]

    def sums(column):
        for word, cells in zip(words, column):
            if cells and not any(c.piece for c in cells):
                sizes = [direction.rules[word[c.letter].symbol].size for c in cells]
                if None not in sizes:
                    yield sum(sizes)

    def walk(states, columns, omega, sigma):
        nonlocal count
        if all(s == (len(w), False) for s, w in zip(states, words)):
            yield columns
            return
        options = [options_of(row, state) for row, state in enumerate(states)]
        for choice in itertools.product(*options):
            column = [cells for cells, _ in choice]
            count += 1
            if count > MOST_STEPS:
                raise TooLarge
            if not any(column) or not allowed(
                direction, words, column, columns[-1] if columns else None
            ):
                continue
            values = list(sums(column))
            if not values:
                values = [0.0]
            more, wide = omega + max(values) - min(values), sigma + max(values)
            if more > most + slack:
                continue
            after = [rest[r][k + inside] for r, (_, (k, inside)) in enumerate(choice)]
            if wide + max(after) <= canvas + mu + slack:
                yield from walk([s for _, s in choice], [*columns, column], more, wide)

    yield from walk([(0, False)] * len(words), [], 0.0, 0.0)


def whole(columns):
    """Drop partitions in which a letter is 'split' into a single piece."""
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
    a, b, ae, be = [], [], [], []
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
            a += [up, down]
            b += [-known, known]
    for row, letter in pieces:
        line = np.zeros(n + 2 * k)
        for j in range(k):
            if (row, letter, j) in place:
                line[place[row, letter, j]] = 1
        symbol = words[row][letter].symbol
        size = direction.rules[symbol].size
        if size is None:
            line[place[symbol]] -= 1
        ae.append(line)
        be.append(size or 0.0)
    total = np.zeros(n + 2 * k)
    total[n : n + k] = 1
    a.append(total)
    b.append(canvas + mu + slack)
    for counts, known, low, high in eq7(direction, words, mu):
        line = np.zeros(n + 2 * k)
        for name, times in counts.items():
            line[place[name]] = times
        a += [line, -line]
        b += [high - known, known - low]
    bounds = [(0.01 * canvas, None)] * len(names) + [(0, None)] * (n - len(names) + 2 * k)
    cost = np.zeros(n + 2 * k)
    cost[n : n + k], cost[n + k :] = 1, -1
    solved = linprog(cost, A_ub=a, b_ub=b, A_eq=ae or None, b_eq=be or None, bounds=bounds)
    if solved.status != 0 or solved.fun > mu + 2 * slack:
        return None
    return max(0.0, solved.fun), float(solved.x[n : n + k].sum())


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
    ae, be = [], []
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
                ae.append(line - first)
                be.append(0.0)
    for (row, letter), places in pieces.items():
        line = np.zeros(len(place))
        line[places] = 1
        line[place[words[row][letter].symbol]] -= 1
        ae.append(line)
        be.append(0.0)
    ae.append(fill)
    be.append(1.0)
    sizes = [direction.rules[s].size for s in symbols]
    bounds = [(0.01 * s / canvas if s else 0.01, None) for s in sizes]
    bounds += [(0, None)] * (len(place) - len(symbols))
    return linprog(np.zeros(len(place)), A_eq=ae, b_eq=be, bounds=bounds).status == 0


def best(direction, words_of_layers):
    """(µ/canvas, Ω, pieces, columns, |Σ − canvas|) of the contract's answer, or None.

    words_of_layers: all words of every layer, topmost first.
    """
    for share in TOLERANCES:
        mu = share * direction.canvas
        candidates = [
            words for words in itertools.product(*words_of_layers) if admitted(direction, words, mu)
        ]
        for split in (False, True):
            for most in (0.0, mu / 16, mu / 4, mu):  # Ω from below: what is found first is least
                found = best_within(direction, candidates, split, mu, most)
                if found is not None:
                    return (share, *found)
    return None


def best_within(direction, candidates, split, mu, most):
    """(Ω, pieces, columns, |Σ − canvas|) of the best sizable partition with Ω ≤ most, or None."""
    rows = []
    number = 0
    for words in candidates:
        loose = any(direction.rules[a.symbol].size is None for word in words for a in word)
        for columns in partitions(direction, words, split, mu, most):
            pieces = whole(columns)
            if any(times < 2 for times in pieces.values()):
                continue
            number += 40 if pieces or loose else 1  # a linear programme takes a millisecond
            if number > MOST_PARTITIONS:
                raise TooLarge
            value = error(direction, words, columns, mu)
            if value is not None and value[0] <= most + 1e-9 * direction.canvas:
                omega, sigma = value
                off = round(abs(sigma - direction.canvas), 7)
                key = (round(omega, 7), sum(pieces.values()), -len(columns), off, len(rows))
                rows.append((*key, words, columns))
    for omega, pieces, columns, off, _, words, cols in sorted(rows, key=lambda r: r[:5]):
        if sizable(direction, words, cols):
            return omega, pieces, -columns, off
    return None


def cells_of(alignment):
    """The columns of a solver's alignment in this module's terms."""
    columns = []
    for j in range(alignment.count):
        column = []
        for row in range(len(alignment.candidate.words)):
            first, end = alignment.letters(row, j)
            start, stop = alignment.borders[j][row], alignment.borders[j + 1][row]
            column.append(
                [
                    Cell(k, (k == first and start.inside) or (k == end - 1 and stop.inside))
                    for k in range(first, end)
                ]
            )
        columns.append(column)
    return columns


def broken(direction, alignment):
    """What is wrong with a solver's alignment; nothing should be."""
    words, columns = alignment.candidate.words, cells_of(alignment)
    mu = alignment.tolerance * direction.canvas
    if not admitted(direction, words, mu):
        yield "eq. 7"
    for row, word in enumerate(words):
        letters = [c.letter for column in columns for c in column[row]]
        if sorted(set(letters)) != list(range(len(word))) or letters != sorted(letters):
            yield f"row {row} is not its word"
    for before, column in zip([None, *columns], columns):
        if not any(column) or not allowed(direction, words, column, before):
            yield "a constraint of 5.2"
    value = error(direction, words, columns, mu)
    if value is None or abs(value[0] - alignment.omega) > 2e-6:
        yield f"error {alignment.omega}, should be {value}"
    if not sizable(direction, words, columns):
        yield "no sizes"


def reference_sizes(direction, alignments):
    """Sizes of the sized symbols by bounded least squares, equalities as heavy rows.

    x ≥ least is shifted to x ≥ 0 and solved by Lawson and Hanson's method: nothing in common with
    the solver's.
    """
    canvas = direction.canvas
    found = [(al.candidate.words, cells_of(al)) for al in alignments]
    symbols = sorted({a.symbol for words, _ in found for w in words for a in w})
    place = {s: i for i, s in enumerate(symbols)}
    letters = {}
    for g, (_, columns) in enumerate(found):
        for j, column in enumerate(columns):
            for row, cells in enumerate(column):
                for c in cells:
                    if c.piece:
                        letters.setdefault((g, row, c.letter), []).append(len(place))
                        place[g, row, c.letter, j] = len(place)
    rows, right = [], []
    for g, (words, columns) in enumerate(found):
        total = np.zeros(len(place))
        for j, column in enumerate(columns):
            lines = []
            for row, cells in enumerate(column):
                line = np.zeros(len(place))
                for c in cells:
                    line[
                        place[(g, row, c.letter, j) if c.piece else words[row][c.letter].symbol]
                    ] += 1
                if cells:
                    lines.append(line)
            rows += [other - lines[0] for other in lines[1:]]
            right += [0.0] * (len(lines) - 1)
            total += lines[0]
        rows.append(total)
        right.append(1.0)
    for (g, row, letter), places in letters.items():
        line = np.zeros(len(place))
        line[places] = 1
        line[place[found[g][0][row][letter].symbol]] -= 1
        rows.append(line)
        right.append(0.0)
    sizes = {s: direction.rules[s].size for s in symbols}
    least = np.zeros(len(place))
    for s, size in sizes.items():
        least[place[s]] = 0.01 if size is None else 0.01 * size / canvas
    wanted = [s for s in symbols if sizes[s] is not None]
    goal = np.zeros((len(wanted), len(place)))
    for i, s in enumerate(wanted):
        goal[i, place[s]] = 1
    wish = np.array([sizes[s] / canvas for s in wanted])
    matrix, heavy = np.array(rows), 1e6
    a = np.vstack([goal, heavy * matrix])
    b = np.concatenate([wish - goal @ least, heavy * (np.array(right) - matrix @ least)])
    x = nnls(a, b, maxiter=10_000)[0] + least
    return {s: float(x[place[s]] * canvas) for s in wanted}


def words_of(direction, row):
    """Words of a pattern without counters, by the solver's own expansion (tested elsewhere)."""
    from facade_tools.layering.words import Expansion, expand

    transparent = frozenset(n for n, r in direction.rules.items() if r.transparent)
    how = Expansion({}, direction.least_sizes(), 1e9, row.reflection, transparent)
    return expand(row.node, how).words


def random_direction(rng: random.Random, *, letters=5, layers=3, unsized=0.3, splits=True):
    """A small random problem: sizes that nearly fit, all qualifiers, transparent and unsized."""
    canvas = 12.0
    rules = {}
    pool = rng.choice([[1, 2, 3, 4, 5, 6], [1, 1.5, 2, 2.5, 3]]) if letters > 5 else range(1, 7)
    for name in "ABCDE":
        rules[name] = Rule(
            size=float(rng.choice(list(pool))) + rng.choice([0, 0, 0, 0.1, -0.25]),
            opaque=rng.random() < 0.85,
            attached=rng.random() < 0.12,
            unoccludable=rng.random() < 0.12,
        )
    for name in "tu":
        free = rng.random() < unsized
        size = None if free else float(rng.choice([2, 3, 4, 5, 8]))
        rules[name] = Rule(size=size, transparent=True, attached=rng.random() < 0.08)
    rows = []
    for i in range(rng.randint(2, layers)):
        text = random_word(rng, rules, canvas, letters)
        if rng.random() < 0.25:
            text += "|" + random_word(rng, rules, canvas, letters)
        rows.append(LayerPattern(f"L{i}", f"P{i}", parse(text)))
    return Direction("x", canvas, rules, {"default": tuple(rows)})


def random_word(rng, rules, canvas, letters):
    """A word of about the canvas's size."""
    word = ""
    size = 0.0
    while len(word) < letters and size < canvas - 1:
        pool = "ABCDE" if rng.random() < 0.75 else "tu"
        name = rng.choice(pool)
        word += name
        size += rules[name].size or 3.0
    return word
