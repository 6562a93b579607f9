"""Sizes and places of all letters: a constrained least-squares problem (IMAW15 5.3).

Each symbol has one size a direction, in all its letters, words and groups (its prototype), so
the unknowns are the sizes of the symbols and of the pieces of split letters; the letters' bounds
s and t follow. Solved exactly by an active-set method (daqp).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import daqp
import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible
from .evaluation import split_letters
from .problem import LEAST_SIZE, LEAST_UNSIZED, Alignment, Direction

Floats = NDArray[np.float64]
Piece = tuple[int, int, int, int]  # alignment, row, letter, column
Tag = tuple[int, int]  # alignment, column; column -1 belongs to no column

FAINT = 1e-7  # weight of what no objective term names, against 1 for a sized symbol
FIRMER = (1.0, 1e2, 1e4, 1e6)  # times FAINT, where daqp finds the problem too badly scaled
EQUAL = 5  # daqp's mark of an equality
TIGHT = 1e-10  # of the canvas: closer to its bound is on it


@dataclass(frozen=True, slots=True)
class Sizing:
    """sizes: symbol -> size (m); pieces: (alignment, row, letter, column) -> size (m)."""

    sizes: dict[str, float]
    pieces: dict[Piece, float]
    residual: float


@dataclass(frozen=True, slots=True)
class System:
    """Equalities A x = b over symbols and pieces, in shares of the canvas; x ≥ least."""

    names: tuple[str, ...]
    pieces: tuple[Piece, ...]
    matrix: Floats
    right: Floats
    tags: tuple[Tag, ...]
    least: Floats
    wish: Floats
    weight: Floats


def system(direction: Direction, alignments: Sequence[Alignment]) -> System:
    """Return the constraints that all alignments of a direction put on sizes."""
    return _Builder(direction, alignments).build()


class _Builder:
    def __init__(self, direction: Direction, alignments: Sequence[Alignment]) -> None:
        self.direction, self.alignments = direction, alignments
        used = {a.symbol for al in alignments for word in al.candidate.words for a in word}
        self.names = sorted(used)
        self.splits = [
            (i, row, letter, columns)
            for i, al in enumerate(alignments)
            for row, letter, columns in split_letters(al.candidate, al.borders)
        ]
        pieces = [(i, r, k, j) for i, r, k, columns in self.splits for j in columns]
        self.place: dict[str | Piece, int] = {}
        keys: list[str | Piece] = [*self.names, *pieces]
        self.place.update({key: at for at, key in enumerate(keys)})
        self.pieces: list[Piece] = pieces
        self.rows: dict[tuple[int, bytes], tuple[Floats, float, Tag]] = {}

    def build(self) -> System:
        for i, row, letter, columns in self.splits:
            line = np.zeros(len(self.place))
            for column in columns:
                line[self.place[i, row, letter, column]] = 1.0
            line[self.place[self.alignments[i].candidate.words[row][letter].symbol]] = -1.0
            self._add(line, 0.0, (i, -1))
        for i, alignment in enumerate(self.alignments):
            total = np.zeros(len(self.place))
            for column in range(alignment.count):
                total += self._column(i, column)
            self._add(total, 1.0, (i, -1))
        lines = [row for row, _, _ in self.rows.values()]
        return System(
            tuple(self.names),
            tuple(self.pieces),
            np.array(lines).reshape(len(lines), len(self.place)),
            np.array([right for _, right, _ in self.rows.values()]),
            tuple(tag for _, _, tag in self.rows.values()),
            *self._objective(),
        )

    def _column(self, i: int, column: int) -> Floats:
        """Add that all substrings of a column are equal; return one of them."""
        alignment = self.alignments[i]
        lines = {}
        for row in range(len(alignment.candidate.words)):
            if alignment.column(row, column):
                line = self.substring(i, row, column)
                lines[line.tobytes()] = line
        first, *others = lines.values()
        for other in others:
            self._add(other - first, 0.0, (i, column))
        return first

    def substring(self, i: int, row: int, column: int) -> Floats:
        """Return which symbols and pieces a substring is made of."""
        line = np.zeros(len(self.place))
        start, end = self.alignments[i].letters(row, column)
        word = self.alignments[i].candidate.words[row]
        for letter in range(start, end):
            piece = (i, row, letter, column)
            line[self.place[piece if piece in self.place else word[letter].symbol]] += 1.0
        return line

    def _add(self, line: Floats, right: float, tag: Tag) -> None:
        if np.any(line):
            self.rows.setdefault((tag[1], line.tobytes()), (line, right, tag))

    def _objective(self) -> tuple[Floats, Floats, Floats]:
        canvas = self.direction.canvas
        solved = {name: size for al in self.alignments for name, size in al.sizes}
        least, wish, weight = (np.zeros(len(self.place)) for _ in range(3))
        weight[:] = FAINT
        for name in self.names:
            at, size = self.place[name], self.direction.rules[name].size
            if size is None:
                least[at], wish[at] = LEAST_UNSIZED, solved.get(name, 0.0) / canvas
            else:
                least[at], wish[at], weight[at] = LEAST_SIZE * size / canvas, size / canvas, 1.0
        for i, row, letter, columns in self.splits:
            symbol = self.alignments[i].candidate.words[row][letter].symbol
            for column in columns:
                wish[self.place[i, row, letter, column]] = wish[self.place[symbol]] / len(columns)
        return least, wish, weight


def _solve(matrix: Floats, right: Floats, goal: System) -> tuple[Floats, int]:
    """Return the weighted least-squares solution and daqp's verdict (1 = solved)."""
    count = len(goal.least)
    huge = np.full(count, 1e3)
    sense = np.concatenate([np.zeros(count, np.int32), np.full(len(right), EQUAL, np.int32)])
    x, _, flag, _ = daqp.solve(
        np.diag(goal.weight),
        -goal.weight * goal.wish,
        matrix.reshape(len(right), count),
        np.concatenate([huge, right]),
        np.concatenate([goal.least, right]),
        sense,
        primal_tol=1e-12,
    )
    return np.asarray(x), int(flag)


def _reduced(matrix: Floats, right: Floats) -> tuple[Floats, Floats] | None:
    """Return equivalent equalities of full rank; None where they contradict each other."""
    table = np.column_stack([matrix, right])
    row = 0
    for column in range(matrix.shape[1]):
        if row == len(table):
            break
        pivot = row + int(np.argmax(np.abs(table[row:, column])))
        if abs(table[pivot, column]) < 1e-9:
            continue
        table[[row, pivot]] = table[[pivot, row]]
        table[row] /= table[row, column]
        others = table[:, column].copy()
        others[row] = 0.0
        table -= np.outer(others, table[row])
        row += 1
    if np.any(np.abs(table[row:, -1]) > 1e-9):
        return None
    return np.ascontiguousarray(table[:row, :-1]), np.ascontiguousarray(table[:row, -1])


def feasible(equations: System, keep: NDArray[np.bool_] | None = None) -> bool:
    """Tell whether sizes exist that satisfy the equalities (those of `keep`) and bounds."""
    rows = slice(None) if keep is None else keep
    reduced = _reduced(equations.matrix[rows], equations.right[rows])
    if reduced is None:
        return False
    goal = System(
        (), (), *reduced, (), equations.least, equations.least, np.ones(len(equations.least))
    )
    return _solve(*reduced, goal)[1] == 1


def conflict(direction: Direction, alignments: Sequence[Alignment]) -> list[Tag] | None:
    """Return None if a sizing exists; otherwise columns of which not all can be had together.

    Those are all columns where it takes them all: the groups' sums, or a letter without further
    pieces.
    """
    if all(al.omega == 0.0 and not al.sizes and not al.pieces for al in alignments[:1]) and (
        len(alignments) == 1
    ):
        return None  # the preferred sizes, all scaled alike
    equations = system(direction, alignments)
    if feasible(equations):
        return None
    equations = _anywhere(equations, direction, alignments)
    if feasible(equations):
        return [(i, j) for i, one in enumerate(alignments) for j in range(one.count)]
    tags = np.array(equations.tags)
    keep = np.ones(len(tags), dtype=bool)
    needed = []
    for tag in dict.fromkeys(tag for tag in equations.tags if tag[1] >= 0):
        without = keep & ~np.all(tags == tag, axis=1)
        if feasible(equations, without):
            needed.append(tag)
        else:
            keep = without
    return needed


def _anywhere(equations: System, direction: Direction, alignments: Sequence[Alignment]) -> System:
    """Return what columns ask for in whatever alignment of the same words they stand.

    Others may sum up to the canvas differently, and cut a letter into more pieces. Of groups, whose
    sums bind one another, no word is longer than the canvas, and opaque letters cover it.
    """
    of_columns = np.array(equations.tags)[:, 1] >= 0
    keep = of_columns | (equations.right == 0.0)
    letters = np.flatnonzero(keep & ~of_columns)
    more = np.zeros((len(keep), len(letters)))
    more[letters, np.arange(len(letters))] = 1.0
    matrix = np.hstack([equations.matrix, more])[keep]
    tags = [tag for tag, kept in zip(equations.tags, keep, strict=True) if kept]
    sums = list(_sums(equations, direction, alignments)) if len(alignments) > 1 else []
    size, count = matrix.shape[1], len(sums)
    wide = np.zeros((count, size + count))
    for row, (line, (i, counts, sign)) in enumerate(zip(wide, sums, strict=True)):
        line[: len(counts)], line[size + row] = counts, sign
        tags.append((i, -1))
    return replace(
        equations,
        matrix=np.vstack([np.hstack([matrix, np.zeros((len(matrix), count))]), wide]),
        right=np.concatenate([equations.right[keep], np.ones(count)]),
        tags=tuple(tags),
        least=np.concatenate([equations.least, np.zeros(len(letters) + count)]),
    )


def _sums(
    equations: System, direction: Direction, alignments: Sequence[Alignment]
) -> Iterator[tuple[int, Floats, float]]:
    """Yield (group, letters of each symbol, sign of what is left beside the canvas)."""
    names = equations.names
    for i, alignment in enumerate(alignments):
        opaque = np.zeros(len(names))
        for word in alignment.candidate.words:
            counts = np.zeros(len(names))
            for letter in word:
                counts[names.index(letter.symbol)] += 1.0
                opaque[names.index(letter.symbol)] += float(direction.is_opaque(letter))
            yield i, counts, 1.0
        yield i, opaque, -1.0


def solve(direction: Direction, alignments: Sequence[Alignment]) -> Sizing:
    """Return sizes closest to the preferred ones, Σ over sized symbols of squared deviation.

    Raises Infeasible where no sizing fills the canvas.
    """
    equations = system(direction, alignments)
    reduced = _reduced(equations.matrix, equations.right)
    x = None if reduced is None else _closest(*reduced, equations)
    if reduced is None or x is None:
        where = f"{direction.axis} ({direction.canvas:g} m)"
        raise Infeasible(f"{where}: no sizes of the symbols fill the canvas")
    x = _polished(*reduced, equations, x) * direction.canvas
    count = len(equations.names)
    sizes = dict(zip(equations.names, x[:count].tolist(), strict=True))
    pieces = dict(zip(equations.pieces, x[count:].tolist(), strict=True))
    return Sizing(sizes, pieces, _residual(direction, sizes))


def _closest(matrix: Floats, right: Floats, goal: System) -> Floats | None:
    for times in FIRMER:
        weight = np.where(goal.weight == 1.0, 1.0, FAINT * times)
        x, flag = _solve(matrix, right, replace(goal, weight=weight))
        if flag == 1:
            return x
    return None


def _polished(matrix: Floats, right: Floats, goal: System, x: Floats) -> Floats:
    """Solve once more with the active bounds as equalities and no faint weights."""
    held = np.flatnonzero(x - goal.least < TIGHT)
    fixed = np.eye(len(x))[held]
    both = np.vstack([matrix, fixed])
    values = np.concatenate([right, goal.least[held]])
    weight = np.where(goal.weight == 1.0, 1.0, 0.0)
    n, k = len(x), len(both)
    kkt = np.block([[np.diag(weight), both.T], [both, np.zeros((k, k))]])
    step = np.concatenate([weight * (goal.wish - x), values - both @ x])
    moved = x + np.linalg.lstsq(kkt, step, rcond=1e-12)[0][:n]
    better = np.all(moved >= goal.least - 1e-12) and np.all(np.abs(matrix @ moved - right) < 1e-11)
    return np.maximum(moved, goal.least) if better else x


def _residual(direction: Direction, sizes: Mapping[str, float]) -> float:
    rules = direction.rules
    return sum((size - (rules[name].size or size)) ** 2 for name, size in sizes.items())


def substring_sizes(
    sizing: Sizing, alignment: Alignment, index: int, row: int, column: int
) -> list[float]:
    """Return the sizes (m) of the letters, whole or pieces, that a row has in a column."""
    start, end = alignment.letters(row, column)
    word: Any = alignment.candidate.words[row]
    return [
        sizing.pieces.get((index, row, k, column), sizing.sizes[word[k].symbol])
        for k in range(start, end)
    ]
