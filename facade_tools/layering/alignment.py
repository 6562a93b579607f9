"""Best alignments of a candidate: exact search, branching on what the search cannot see."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count, pairwise
from typing import Any

import numpy as np

from . import kernels
from .candidates import Bounds
from .evaluation import Borders, evaluate, least_error
from .problem import SLACK, Alignment, Candidate, Direction, Span
from .rows import Integers, RowMaker, Rows
from .sizing import conflict
from .words import Word

Box = Mapping[str, tuple[float, float]]
Key = tuple[float, int, int, float, tuple[Any, ...]]

FIRST_LABELS = 2_000
MOST_LABELS = 500_000
MOST_STEPS = 60_000_000
MOST_NODES = 4000


@dataclass(frozen=True, slots=True)
class Effort:
    """Bounds on one search: labels kept, rows tried, nodes branched; `beam` 0 for none."""

    labels: int = MOST_LABELS
    steps: int = MOST_STEPS
    nodes: int = MOST_NODES
    beam: int = 0


@dataclass(frozen=True, slots=True)
class Task:
    """One candidate at one tolerance (a share of the canvas) with a budget of Ω (m)."""

    candidate: Candidate
    bounds: tuple[Bounds, ...]
    tolerance: float
    budget: float
    splits: bool = False
    effort: Effort = field(default_factory=Effort)


@dataclass(frozen=True, slots=True)
class Found:
    """The best alignment of a task, or none; `complete` unless a bound cut the search short."""

    alignment: Alignment | None
    complete: bool
    bound: float = 0.0  # no alignment that was left out has a smaller Ω (m)


@dataclass(frozen=True, slots=True)
class _Node:
    box: Box
    forbidden: tuple[tuple[int, ...], ...]  # of every group
    parent: Borders = ()  # the path that it was branched from

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return what two nodes with the same alignments share."""
        return tuple(sorted(self.box.items())), tuple(map(frozenset, self.forbidden))


def key_of(alignment: Alignment, canvas: float) -> Key:
    """Return what alignments are ordered by: Ω, pieces, columns, |Σ − canvas|, names."""
    step = SLACK * canvas
    return (
        round(alignment.omega / step) * step,
        alignment.pieces,
        -alignment.count,
        round(abs(alignment.sigma - canvas) / step) * step,
        (),
    )


def names_of(alignment: Alignment) -> tuple[Any, ...]:
    """Return words and columns as names, for the last tie."""
    words = alignment.candidate.words
    named = tuple(tuple(letter.name for letter in word) for word in words)
    columns = tuple(
        tuple(
            tuple(a.name for a in alignment.column(row, column))
            for column in range(alignment.count)
        )
        for row in range(len(words))
    )
    return named, columns


def full_key(alignment: Alignment, canvas: float) -> Key:
    """Return the whole order, names included."""
    return (*key_of(alignment, canvas)[:4], names_of(alignment))


class Aligner:
    """Aligns candidates of one direction."""

    def __init__(self, direction: Direction, late: Callable[[], bool] = lambda: False) -> None:
        """Align until `late` says that the time is up."""
        self.direction, self.late = direction, late
        self.maker = RowMaker(direction)

    def best(self, task: Task) -> Found:
        """Return the best alignment of a candidate within its budget of Ω."""
        box = {name: (low, high) for name, low, high in task.candidate.unsized}
        root = _Node(box, ((),) * len(task.candidate.parts))
        order = count()
        seen = {root.signature}
        queue: list[tuple[Key, int, Alignment, _Node | None]] = []
        complete = self._push(queue, order, root, task)
        for _ in range(task.effort.nodes):
            if not queue:
                return Found(None, complete, task.budget)
            if self.late():
                break
            _, _, path, node = heapq.heappop(queue)
            if node is None:
                return Found(path, complete, path.omega)
            exact, children = self._examine(path, node, task)
            if exact is not None and exact.omega <= self._most(task):
                key = full_key(exact, self.direction.canvas)
                heapq.heappush(queue, (key, next(order), exact, None))
            for child in children:
                if child.signature not in seen:
                    seen.add(child.signature)
                    complete &= self._push(queue, order, child, task)
        return self._cut(queue)

    def _cut(self, queue: list[tuple[Key, int, Alignment, _Node | None]]) -> Found:
        """Return the best of what is known when a search is cut short."""
        known = [entry for entry in queue if entry[3] is None]
        best = min(known)[2] if known else None
        return Found(best, False, queue[0][0][0] if queue else 0.0)

    def _most(self, task: Task) -> float:
        canvas = self.direction.canvas
        return (
            min(task.budget, task.tolerance * canvas * len(task.candidate.parts)) + SLACK * canvas
        )

    def _push(self, queue: list[Any], order: Iterator[int], node: _Node, task: Task) -> bool:
        path, complete = self.search(task, node)
        if path is not None:
            key = full_key(path, self.direction.canvas)
            heapq.heappush(queue, (key, next(order), path, node))
        return complete

    def search(self, task: Task, node: _Node) -> tuple[Alignment | None, bool]:
        """Return the path of least lower bound, and whether the search was complete."""
        complete = True
        lines: list[Borders] = []
        for part, (first, end) in enumerate(task.candidate.split()):
            borders, whole = self._group(task.candidate.words[first:end], task, node, part)
            complete = complete and whole
            if borders is None:
                return None, complete
            lines.append(borders)
        joined = _joined(lines)
        path = evaluate(self.direction, task.candidate, joined, task.tolerance, node.box)
        hopeful = path.omega <= task.budget + SLACK * self.direction.canvas
        return (path if hopeful else None), complete

    def _group(
        self, words: tuple[Word, ...], task: Task, node: _Node, part: int
    ) -> tuple[Borders | None, bool]:
        merged = self.maker.rows(words, node.box, True)
        twins = len(merged.words) < len(words)
        limits = self._limits(task, twins and not task.splits)
        borders, complete = self._run(merged, task, limits, node.forbidden[part])
        if borders is None or not twins or self._covered(words, borders):
            return borders, complete
        rows = self.maker.rows(words, node.box, False)
        return self._run(rows, task, self._limits(task, False), node.forbidden[part])

    def _covered(self, words: tuple[Word, ...], borders: Borders) -> bool:
        """Tell whether every column has a substring that is opaque throughout."""
        return all(
            any(
                b.letters > a.letters
                and all(self.direction.is_opaque(x) for x in word[a.letters : b.letters])
                for word, a, b in zip(words, start, end, strict=True)
            )
            for start, end in pairwise(borders)
        )

    def _limits(self, task: Task, loose: bool) -> Integers:
        scale, canvas = self.maker.scale, self.direction.canvas
        slack = SLACK * canvas
        widest = canvas * (1.0 + task.tolerance) + slack
        budget = min(task.budget, task.tolerance * canvas) + slack
        effort = task.effort
        return np.array(
            [
                scale.down(budget), scale.down(widest), scale.of(canvas), task.splits,
                effort.steps, effort.beam, loose,
            ],
            np.int64,
        )  # fmt: skip

    def _run(
        self, rows: Rows, task: Task, limits: Integers, forbidden: tuple[int, ...]
    ) -> tuple[Borders | None, bool]:
        labels = FIRST_LABELS
        while True:
            capacity = np.array([labels, labels], np.int64)
            status, codes = kernels.search(
                rows.starts, rows.low, rows.high, rows.flags, rows.tally, rows.keys,
                np.array(forbidden, np.uint64), limits, capacity,
            )  # fmt: skip
            full = max(status[kernels.LABELS], status[kernels.STATES]) >= labels
            if not full or labels >= task.effort.labels:
                break
            labels *= 8
        borders = _decoded(rows, codes) if len(codes) else None
        return borders, bool(status[kernels.COMPLETE])

    def _examine(
        self, path: Alignment, node: _Node, task: Task
    ) -> tuple[Alignment | None, list[_Node]]:
        """Return the path with its best sizes if they exist, and how to branch for better ones."""
        exact = least_error(self.direction, path, task.bounds, task.tolerance, node.box)
        tight = exact is not None and exact.omega <= path.omega + SLACK * self.direction.canvas
        whole = path if exact is None else exact
        parts = [whole.part(i) for i in range(len(path.candidate.parts))]
        columns = conflict(self.direction, parts) if exact is not None else None
        if columns is not None:
            return None, self._without(node, parts, columns)
        if tight:
            return exact, []
        if node.parent != path.borders and (halves := self._halves(node, path, exact)):
            return exact, halves
        every = [(i, j) for i, part in enumerate(parts) for j in range(part.count)]
        return exact, self._without(node, parts, every)

    def _without(
        self, node: _Node, parts: list[Alignment], columns: list[tuple[int, int]]
    ) -> list[_Node]:
        """Forbid each of the columns in turn."""
        hashes = dict.fromkeys((i, self.column_hashes(parts[i], j)) for i, j in columns)
        out = []
        for part, pair in hashes:
            forbidden = list(node.forbidden)
            forbidden[part] = (*forbidden[part], *pair)
            out.append(replace(node, forbidden=tuple(forbidden)))
        return out

    def _halves(self, node: _Node, path: Alignment, exact: Alignment | None) -> list[_Node]:
        """Cut the widest range of an unsized symbol, where the path's own optimum lies."""
        name = max(node.box, key=lambda n: node.box[n][1] - node.box[n][0])
        low, high = node.box[name]
        if high - low <= 1e-6 * self.direction.canvas:
            return []
        middle = (low + high) / 2
        wish = dict(exact.sizes).get(name, middle) if exact is not None else middle
        cut = wish if low + 0.02 * (high - low) < wish < high - 0.02 * (high - low) else middle
        return [
            replace(node, box={**node.box, name: (low, cut)}, parent=path.borders),
            replace(node, box={**node.box, name: (cut, high)}, parent=path.borders),
        ]

    def column_hashes(self, path: Alignment, column: int) -> tuple[int, ...]:
        """Return the hashes by which the search recognises a column, rows merged and not."""
        words = path.candidate.words
        box = {name: (0.0, 0.0) for name, *_ in path.candidate.unsized}
        both = [self.maker.rows(words, box, merge) for merge in (True, False)]
        return tuple(dict.fromkeys(self._hash(rows, path, column) for rows in both))

    @staticmethod
    def _hash(rows: Rows, path: Alignment, column: int) -> int:
        start, end = path.borders[column], path.borders[column + 1]
        layers = [layers[0] for layers in rows.layers]
        code = np.array([4 * start[i].letters + 2 * start[i].inside for i in layers], np.int64)
        ends = np.array([end[i].letters for i in layers], np.int64)
        opens = np.array([int(end[i].inside) for i in layers], np.int64)
        return int(kernels.column_hash(len(layers), rows.starts, code, ends, opens, rows.keys))


def _decoded(rows: Rows, codes: Any) -> Borders:
    owner = {layer: row for row, layers in enumerate(rows.layers) for layer in layers}
    spans = [[Span(int(c) >> 2, bool((int(c) >> 1) & 1)) for c in line] for line in codes]
    return tuple(tuple(line[owner[layer]] for layer in sorted(owner)) for line in spans)


def _joined(parts: list[Borders]) -> Borders:
    """Put the columns of groups one after another: the rows of the others stand still."""
    ends = [part[-1] for part in parts]
    begins = [part[0] for part in parts]
    out: list[tuple[Span, ...]] = []
    for i, part in enumerate(parts):
        head = [span for end in ends[:i] for span in end]
        tail = [span for begin in begins[i + 1 :] for span in begin]
        out += [(*head, *line, *tail) for line in (part if i == 0 else part[1:])]
    return tuple(out)
