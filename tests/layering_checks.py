# ruff: noqa: B905, C901
"""What any answer of `layer-solve` must satisfy, and sizes from a reference programme."""

from __future__ import annotations

import numpy as np
from layering_oracle import Cell, admitted, error, names, sizable
from scipy.optimize import nnls


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
    parts = [alignment.part(i) for i in range(len(alignment.candidate.parts))]
    groups = [(part.candidate.words, cells_of(part)) for part in parts]
    mu = alignment.tolerance * direction.canvas
    if not admitted(direction, alignment.candidate.words, mu, alignment.candidate.parts):
        yield "eq. 7"
    for words, columns in groups:
        for row, word in enumerate(words):
            letters = [c.letter for column in columns for c in column[row]]
            if sorted(set(letters)) != list(range(len(word))) or letters != sorted(letters):
                yield f"row {row} is not its word"
        for before, column in zip([None, *columns], columns):
            if not any(column) or not allowed(direction, words, column, before):
                yield "a constraint of 5.2"
    value = error(direction, groups, mu)
    if value is None or abs(value[0] - alignment.omega) > 2e-6:
        yield f"error {alignment.omega}, should be {value}"
    if not sizable(direction, groups):
        yield "no sizes"


def compared(direction, expected, found, exhausted):
    """How a search's answer relates to the brute force's: "equal", or in what it is worse.

    expected: of `best_of`, or None. found: an answer, or None. exhausted: whether none is proved.
    """
    if found is None:
        if exhausted:
            return "equal" if expected is None else "WRONG: there is a layout"
        return "not answered in time"
    one = found.alignment
    if expected is None:
        return "WRONG: there is no layout"
    if wrong := list(broken(direction, one)):
        return f"WRONG: {wrong}"
    if not found.optimal:
        return "answered, not proved"
    if found.gap:
        return "WRONG: proved, with a gap"
    share, omega, pieces, count, off, layout = expected
    if (one.tolerance, one.pieces, one.count) != (share, pieces, count):
        return "WRONG: tolerance, pieces or columns"
    if abs(one.omega - omega) > 2e-6:
        return "WRONG: error"
    parts = len(one.candidate.parts)
    if one.candidate.unsized or parts > 1:
        return "equal"
    if abs(abs(one.sigma - direction.canvas) - off) > 2e-6:
        return "WRONG: sum of the columns"
    if one.pieces == 0 and names([(one.candidate.words, cells_of(one))]) != layout:
        return "WRONG: names"
    return "equal"


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
