"""The alignment error of a given partition, and the unsized symbols' sizes that make it least."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from .candidates import Bounds, point_in
from .problem import SLACK, Alignment, Candidate, Direction, Span
from .words import Letter

Box = Mapping[str, tuple[float, float]]
Borders = tuple[tuple[Span, ...], ...]
Line = tuple[int, float]  # slope and height


def evaluate(
    direction: Direction, candidate: Candidate, borders: Borders, tolerance: float, box: Box
) -> Alignment:
    """Return the alignment with Ω and Σ (m): exact where `box` holds points, else lower bounds.

    Ω = Σ ω_j, ω_j = largest − smallest non-empty substring of column j (IMAW15 eq. 9); pieces of
    split letters have whatever size makes that least.
    """
    columns = _columns(direction, candidate, borders, box)
    omega = sum(max(0.0, upper - lower) for upper, lower in columns)
    sigma = sum(upper for upper, _ in columns)
    pieces = count_pieces(candidate, borders)
    return Alignment(candidate, borders, omega, sigma, pieces, tolerance)


def count_pieces(candidate: Candidate, borders: Borders) -> int:
    """Return into how many pieces letters are split; letters in one piece count nothing."""
    return sum(len(columns) for _, _, columns in split_letters(candidate, borders))


def split_letters(
    candidate: Candidate, borders: Borders
) -> Iterator[tuple[int, int, tuple[int, ...]]]:
    """Yield (row, letter, its columns) of every letter that lies in several columns."""
    for row in range(len(candidate.words)):
        inside = {line[row].letters for line in borders if line[row].inside}
        for letter in sorted(inside):
            yield row, letter, tuple(_columns_of(borders, row, letter))


def _columns_of(borders: Borders, row: int, letter: int) -> Iterator[int]:
    for column in range(len(borders) - 1):
        start, end = borders[column][row], borders[column + 1][row]
        if start.letters <= letter < end.letters + int(end.inside):
            yield column


def _columns(
    direction: Direction, candidate: Candidate, borders: Borders, box: Box
) -> list[tuple[float, float]]:
    """Return (largest, smallest) substring of every column; see kernels.search for the method."""
    sizes = {name: (rule.size, rule.size) for name, rule in direction.rules.items() if rule.size}
    spans: Mapping[str, tuple[float, float]] = {**sizes, **box}
    held = [(0.0, 0.0)] * len(candidate.words)
    out = []
    for start, end in pairwise(borders):
        asks = {}
        for row, word in enumerate(candidate.words):
            if start[row] != end[row] or start[row].inside:
                letters = [spans[a.symbol] for a in word[: end[row].letters + int(end[row].inside)]]
                asks[row] = _ask(letters, start[row], end[row], held[row])
        upper = max(ask[0] for ask in asks.values())
        lower = min(ask[1] for ask in asks.values())
        for row, (need, cap, room) in asks.items():
            held[row] = _held(start[row], end[row], held[row], (upper, lower), (need, cap, room))
        out.append((upper, lower))
    return out


def _ask(
    letters: Sequence[tuple[float, float]], start: Span, end: Span, held: tuple[float, float]
) -> tuple[float, float, float]:
    """Return what a row needs at least, bears at most, and the room of the letter it ends in."""
    room = letters[end.letters][1] if end.inside else 0.0
    if start.inside and end.letters == start.letters:
        return 0.0, room - held[1], room
    need = cap = 0.0
    first = start.letters
    if start.inside:
        need, cap = max(0.0, letters[first][0] - held[0]), letters[first][1] - held[1]
        first += 1
    need += sum(low for low, _ in letters[first : end.letters])
    cap += sum(high for _, high in letters[first : end.letters]) + room
    return need, cap, room


def _held(
    start: Span,
    end: Span,
    held: tuple[float, float],
    column: tuple[float, float],
    ask: tuple[float, float, float],
) -> tuple[float, float]:
    """Return how much of the letter that the border lies in can be, and must be, consumed."""
    if not end.inside:
        return 0.0, 0.0
    upper, lower = column
    need, cap, room = ask
    if start.inside and start.letters == end.letters:
        return min(room, held[0] + upper), held[1] + lower
    return min(room, upper - need), max(0.0, lower - (cap - room))


def least_error(
    direction: Direction,
    path: Alignment,
    bounds: Sequence[Bounds],
    tolerance: float,
    box: Box,
) -> Alignment | None:
    """Return the alignment with the unsized sizes in `box` of least Ω, or None if there are none.

    The sizes satisfy eq. 7 of every word, and Σ column sizes ≤ canvas + µ.
    """
    if not box:
        return path
    limit = direction.canvas * (1.0 + tolerance + SLACK)
    guess = point_in(bounds, box, _guess(direction, path, box))
    if guess is None:
        return None
    guessed = _at(direction, path, tolerance, guess)
    fits = len(path.candidate.parts) < 2 and guessed.sigma <= limit
    if guessed.omega <= path.omega + SLACK * direction.canvas and fits:
        return guessed
    if len(box) == 1 and not path.pieces and (scanned := _scanned(direction, path, box, limit)):
        return scanned
    solved = _Programme(direction, path, bounds, box, limit).solve()
    return None if solved is None else _at(direction, path, tolerance, solved)


def _scanned(direction: Direction, path: Alignment, box: Box, limit: float) -> Alignment | None:
    """Return the best size of the only unsized symbol: Ω is convex and linear in between.

    None where the limit of Σ cuts the least Ω off, or there is no admitted size.
    """
    ((name, (low, high)),) = box.items()
    sizes = {low, high, *(z for z in path_breakpoints(direction, path, name) if low < z < high)}
    tried = [_at(direction, path, path.tolerance, {name: size}) for size in sorted(sizes)]
    best = min(tried, key=lambda one: (one.omega, abs(one.sigma - direction.canvas)))
    return best if best.sigma <= limit else None


def path_breakpoints(direction: Direction, path: Alignment, name: str) -> set[float]:
    """Return the sizes (m) of an unsized symbol at which two substrings of a column are equal."""
    out = set()
    for column in range(path.count):
        rows = {
            substring_line(direction, letters, name)
            for row in range(len(path.candidate.words))
            if (letters := path.column(row, column))
        }
        out |= crossings(rows)
    return out


def substring_line(direction: Direction, letters: Sequence[Letter], name: str) -> Line:
    """Return (count, known): a substring is count · size(name) + known metres."""
    known = sum(direction.rules[a.symbol].size or 0.0 for a in letters)
    return sum(a.symbol == name for a in letters), round(known, 9)


def crossings(lines: Iterable[Line]) -> set[float]:
    """Return where lines of different slope meet."""
    rows = sorted(lines)
    return {
        round((b - a) / (k - n), 12) for i, (k, a) in enumerate(rows) for n, b in rows[:i] if k != n
    }


def _at(
    direction: Direction, path: Alignment, tolerance: float, sizes: Mapping[str, float]
) -> Alignment:
    point = {name: (size, size) for name, size in sizes.items()}
    exact = evaluate(direction, path.candidate, path.borders, tolerance, point)
    return replace(exact, sizes=tuple(sorted(sizes.items())))


def _guess(direction: Direction, path: Alignment, box: Box) -> dict[str, float]:
    """Return sizes of unsized symbols near which no column asks for more than its sized rows."""
    ranges = {name: list(span) for name, span in box.items()}
    point = {name: sum(span) / 2 for name, span in box.items()}
    words = path.candidate.words
    for column in range(path.count):
        sums = []
        wanting = []
        for row in range(len(words)):
            letters = path.column(row, column)
            unsized = [a.symbol for a in letters if a.symbol in box]
            known = sum(direction.rules[a.symbol].size or 0.0 for a in letters)
            if unsized:
                wanting.append((unsized, known))
            elif letters:
                sums.append(known)
        for unsized, known in wanting if sums else []:
            for name in set(unsized):
                others = known + sum(point[n] for n in unsized if n != name)
                times = unsized.count(name)
                ranges[name][0] = max(ranges[name][0], (min(sums) - others) / times)
                ranges[name][1] = min(ranges[name][1], (max(sums) - others) / times)
    return {name: (low + high) / 2 for name, (low, high) in ranges.items()}


@dataclass
class _Programme:
    """min Σ (U_j − V_j) over unsized sizes and pieces, a linear programme."""

    direction: Direction
    path: Alignment
    bounds: Sequence[Bounds]
    box: Box
    limit: float

    def solve(self) -> dict[str, float] | None:
        """Return the unsized symbols' sizes (m), or None where the programme has no solution."""
        from scipy.optimize import linprog

        names = sorted(self.box)
        columns = self.path.count
        splits = list(split_letters(self.path.candidate, self.path.borders))
        pieces = [(row, letter, j) for row, letter, js in splits for j in js]
        self.place: dict[object, int] = {name: i for i, name in enumerate(names)}
        for piece in pieces:
            self.place[piece] = len(self.place)
        first = len(self.place)
        width = first + 2 * columns
        cost = np.zeros(width)
        cost[first : first + columns], cost[first + columns :] = 1.0, -1.0
        rows, tops = self._inequalities(first, columns, width)
        equal = [self._letter_sum(row, letter, js, width) for row, letter, js in splits]
        ends = [self.box[name] for name in names]
        ends += [(0.0, self.limit)] * (len(pieces) + 2 * columns)
        result = linprog(
            cost,
            A_ub=np.array(rows),
            b_ub=np.array(tops),
            A_eq=np.array([row for row, _ in equal]) if equal else None,
            b_eq=np.array([value for _, value in equal]) if equal else None,
            bounds=ends,
        )
        if result.status != 0 or result.x is None:
            return None
        found = np.clip(result.x[: len(names)], *np.array(ends[: len(names)]).T)
        return dict(zip(names, found.tolist(), strict=True))

    def _inequalities(
        self, first: int, columns: int, width: int
    ) -> tuple[list[object], list[float]]:
        rows: list[object] = []
        tops: list[float] = []
        for column in range(columns):
            for row in range(len(self.path.candidate.words)):
                if self.path.column(row, column) or self._inside(row, column):
                    line, known = self._substring(row, column, width)
                    upper, lower = line.copy(), -line
                    upper[first + column] -= 1.0
                    lower[first + columns + column] += 1.0
                    rows += [upper, lower]
                    tops += [-known, known]
        for start, end in self._segments():
            total = np.zeros(width)
            total[first + start : first + end] = 1.0
            rows.append(total)
            tops.append(self.limit)
            if len(self.path.candidate.parts) > 1:  # each group keeps to µ
                error = total.copy()
                error[first + columns + start : first + columns + end] = -1.0
                rows.append(error)
                tops.append(self.limit - self.direction.canvas)
        for bound in self.bounds:
            line = np.zeros(width)
            for name, times in bound.counts:
                line[self.place[name]] = times
            rows += [line, -line]
            tops += [bound.greatest - bound.known, bound.known - bound.least]
        return rows, tops

    def _segments(self) -> list[tuple[int, int]]:
        counts = [self.path.part(i).count for i in range(len(self.path.candidate.parts))]
        ends = [sum(counts[: i + 1]) for i in range(len(counts))]
        return list(zip([0, *ends], ends, strict=False))

    def _inside(self, row: int, column: int) -> bool:
        return self.path.borders[column][row].inside

    def _substring(self, row: int, column: int, width: int) -> tuple[np.ndarray, float]:
        line = np.zeros(width)
        known = 0.0
        first, end = self.path.letters(row, column)
        for letter in range(first, end):
            symbol = self.path.candidate.words[row][letter].symbol
            if (row, letter, column) in self.place:
                line[self.place[row, letter, column]] += 1.0
            elif symbol in self.place:
                line[self.place[symbol]] += 1.0
            else:
                known += self.direction.rules[symbol].size or 0.0
        return line, known

    def _letter_sum(
        self, row: int, letter: int, columns: tuple[int, ...], width: int
    ) -> tuple[np.ndarray, float]:
        line = np.zeros(width)
        for column in columns:
            line[self.place[row, letter, column]] = 1.0
        symbol = self.path.candidate.words[row][letter].symbol
        if symbol in self.place:
            line[self.place[symbol]] -= 1.0
            return line, 0.0
        return line, self.direction.rules[symbol].size or 0.0
