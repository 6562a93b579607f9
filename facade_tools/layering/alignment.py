"""Best alignments of a candidate: exact search, branching on what the search cannot see."""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import count, pairwise
from typing import Any

import numpy as np

from . import kernels, kernels_labels
from .bounds import PairBounds
from .evaluation import Borders, Line, crossings, evaluate, least_error
from .kernels_columns import row_hash
from .lattice import Lattice, chain
from .paths import Path, decoded, joined_borders
from .problem import SLACK, Alignment, Candidate, Direction, Rule
from .race import Race
from .rows import Integers, RowMaker, Rows, TooLarge
from .sizing import conflict
from .tasks import Found, Key, Task, full_key, key_of
from .walk import Walk, walk_of
from .words import Letter, Word

Box = Mapping[str, tuple[float, float]]

MANY_LAYERS = 5  # more than these are searched apart only where it is soon done
FEW_LABELS = 32_000
FEW_STEPS = 2_400_000
FIRST_LABELS = 4_000
FIRST_STEPS = 300_000
GROWTH = 8


@dataclass(frozen=True, slots=True)
class _Node:
    box: Box
    forbidden: tuple[tuple[int, ...], ...]  # of every group
    parent: Borders = ()  # the path that it was branched from
    leaf: bool = False  # a range of one unsized size in which every Ω is linear

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return what two nodes with the same alignments share."""
        return tuple(sorted(self.box.items())), tuple(map(frozenset, self.forbidden)), self.leaf


Entry = tuple[Key, int, Alignment, _Node | None]  # of a queue; without a node: exact


def _exact(queue: list[Entry]) -> Alignment | None:
    """Return the best of the exact alignments in a queue."""
    return min((entry[:3] for entry in queue if entry[3] is None), default=(None,))[-1]


@cache
def prepare() -> None:
    """Load or compile the search before a clock starts: the first time ever takes seconds."""
    rules = {"A": Rule(1.0), "t": Rule(1.0, transparent=True)}
    direction = Direction("x", 2.0, rules, {})
    upper = (Letter("A"), Letter("t", transparent=True))
    words = (upper, (Letter("A"), Letter("A")))
    candidate = Candidate(words, parts=(2,), lattices=tuple(map(chain, words)))
    aligner = Aligner(direction)
    aligner.pairs.exceed(candidate, 0.4, True, 1.0)
    task = Task(candidate, (), 0.4, 1.0, splits=True)
    aligner.best(task)
    if (walk := aligner.walk(task)) is not None:
        walk.go(1)


class Aligner:
    """Aligns candidates of one direction."""

    def __init__(
        self,
        direction: Direction,
        late: Callable[[float], bool] = lambda _: False,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """Align; `late(s)` tells whether the time will be up in s seconds by the clock `now`."""
        self.direction, self.late, self.now = direction, late, now
        self.maker = RowMaker(direction)
        self.pairs = PairBounds(direction, self.maker, late)
        self._known: dict[tuple[tuple[Lattice, ...], str], list[float]] = {}

    def best(self, task: Task) -> Found:
        """Return the best alignment of a candidate within its budget of Ω."""
        box = {name: (low, high) for name, low, high in task.candidate.unsized}
        root = _Node(box, ((),) * len(task.candidate.parts))
        order = count()
        race = Race(self.direction, task, lambda: self.walk(task), self.late, self.now)
        seen = {root.signature}
        queue: list[Entry] = []
        complete = self._push(queue, order, root, task)
        for _ in range(task.effort.nodes):
            node = queue[0][3] if queue else None
            if node is None and complete:
                best = _exact(queue)
                return Found(best, True, task.budget if best is None else best.omega)
            if self.late(0.0):
                break
            proved = race.turn(_exact(queue), alone=node is None)
            if proved is not None or node is None:
                return proved or self._cut(queue, race)
            path = heapq.heappop(queue)[2]
            exact, children = self._examine(path, node, task)
            if exact is not None and exact.omega <= self._most(task):
                key = full_key(exact, self.direction.canvas)
                heapq.heappush(queue, (key, next(order), exact, None))
            for child in children:
                if child.signature not in seen:
                    seen.add(child.signature)
                    complete &= self._push(queue, order, child, task)
        return self._cut(queue, race)

    def walk(self, task: Task) -> Walk | None:
        """Return a walk over all alignments of a task, or None where it would be too long."""
        candidate = task.candidate
        if len(candidate.parts) > 1 or task.effort.beam:
            return None
        box = {name: (low, high) for name, low, high in candidate.unsized}
        try:
            rows = self.maker.rows(candidate.lattices, box, False, task.splits)
        except TooLarge:
            return None
        limits = self._limits(task, False, 0.0, bool(box))
        guide = self.pairs.guide(rows.lattices, box, task.tolerance, task.splits)
        walk = walk_of(self.maker, candidate, task.bounds, rows, limits, guide)
        if walk is not None and task.rival is not None:
            walk.know(task.rival)
        return walk

    def _leaf_key(self, task: Task, node: _Node, key: Key) -> Key:
        """Return a lower bound for the sizes inside a range at whose ends the search was exact.

        There Ω falls towards the greater end, where only the limit of Σ rules alignments out: the
        search at that end, with the limit eased by all that the range can add to Σ.
        """
        ((name, (low, high)),) = node.box.items()
        times = sum(a.symbol == name for word in task.candidate.words for a in word)
        ease = times * (high - low) / self.direction.canvas
        end = replace(node, box={name: (high, high)})
        path, _ = self.search(task, end, ease)
        most = (float("inf"), *key[1:])
        return most if path is None else (key_of(path, self.direction.canvas)[0], *key[1:])

    def _cut(self, queue: list[Entry], race: Race) -> Found:
        """Return the best of what is known when a search is cut short."""
        return Found(race.best(_exact(queue)), False, queue[0][0][0] if queue else 0.0)

    def _most(self, task: Task) -> float:
        canvas = self.direction.canvas
        return (
            min(task.budget, task.tolerance * canvas * len(task.candidate.parts)) + SLACK * canvas
        )

    def _push(self, queue: list[Any], order: Iterator[int], node: _Node, task: Task) -> bool:
        path, complete = self.search(task, node)
        if path is not None:
            key = full_key(path, self.direction.canvas)
            if node.leaf:
                key = max(key, self._leaf_key(task, node, key))
            heapq.heappush(queue, (key, next(order), path, node))
        return complete

    def search(self, task: Task, node: _Node, ease: float = 0.0) -> tuple[Alignment | None, bool]:
        """Return the path of least lower bound, and whether the search was complete."""
        complete = True
        lines: list[Borders] = []
        words: list[Word] = []
        for part, (first, end) in enumerate(task.candidate.split()):
            lattices = task.candidate.lattices[first:end]
            try:
                found, whole = self._group(lattices, task, node, part, ease)
            except TooLarge:
                found, whole = None, False
            complete = complete and whole
            if found is None:
                return None, complete
            lines.append(found.borders)
            words += found.words
        joined = joined_borders(lines)
        candidate = replace(task.candidate, words=tuple(words))
        path = evaluate(self.direction, candidate, joined, task.tolerance, node.box)
        if len(lines) == 1 and node.box:
            floor = self.direction.canvas * (1.0 - task.tolerance - SLACK)
            path = replace(path, omega=path.omega + max(0.0, floor - path.sigma))
        hopeful = path.omega <= task.budget + SLACK * self.direction.canvas
        return (path if hopeful else None), complete

    def _group(
        self, lattices: tuple[Lattice, ...], task: Task, node: _Node, part: int, ease: float
    ) -> tuple[Path | None, bool]:
        strict = self._limits(task, False, ease, bool(node.box))
        merged = self.maker.rows(lattices, node.box, True, task.splits)
        twins = len(merged.lattices) < len(lattices)
        if not twins:
            return self._run(merged, task, strict, node.forbidden[part], ease > 0.0)
        if self._fills(merged, limits=strict) and not task.splits:
            loose = self._limits(task, True, ease, bool(node.box))
            path, complete = self._run(merged, task, loose, node.forbidden[part], ease > 0.0)
            if path is None or self._covered(path.words, path.borders):
                return path, complete
        rows = self.maker.rows(lattices, node.box, False, task.splits)
        if len(lattices) <= MANY_LAYERS:
            return self._run(rows, task, strict, node.forbidden[part], ease > 0.0)
        path, _ = self._run(merged, task, strict, node.forbidden[part], ease > 0.0)
        light = replace(task, effort=replace(task.effort, labels=FEW_LABELS, steps=FEW_STEPS))
        own, whole = self._run(rows, light, strict, node.forbidden[part], ease > 0.0)
        return (own, True) if whole else (path, False)

    @staticmethod
    def _fills(rows: Rows, limits: Integers) -> bool:
        """Tell whether rows that stand for several layers have no room for an empty column.

        Then those layers share their borders: the least opaque letter is wider than what the
        canvas and the tolerance leave beside such a word.
        """
        start = rows.starts[:-1]
        room = limits[kernels_labels.WIDEST] - rows.places[start, kernels_labels.REST]
        several = rows.info[:, kernels_labels.WEIGHT] > 1
        return bool(np.all(room[several] < rows.narrowest))

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

    def _limits(self, task: Task, loose: bool, ease: float, free: bool) -> Integers:
        scale, canvas = self.maker.scale, self.direction.canvas
        slack = SLACK * canvas
        widest = canvas * (1.0 + task.tolerance + ease) + slack
        budget = min(task.budget, task.tolerance * canvas) + slack
        effort = task.effort
        floor = (
            canvas * (1.0 - task.tolerance) - slack
            if free and len(task.candidate.parts) < 2
            else 0.0
        )
        whole = any(len(one.words) > 1 for one in task.candidate.lattices)
        shortest = canvas * (1.0 - task.tolerance) - slack if whole else -canvas
        return np.array(
            [
                scale.down(budget), scale.down(widest), scale.of(canvas), task.splits,
                effort.steps, effort.beam, loose, max(0, scale.down(floor)),
                scale.down(shortest), *self._rival(task, loose),
            ],
            np.int64,
        )  # fmt: skip

    def _rival(self, task: Task, loose: bool) -> tuple[int, int]:
        """Return Ω and columns of what is known; several groups are not compared with it."""
        one = task.rival
        if one is None or task.splits or loose or len(task.candidate.parts) > 1:
            return 0, 0
        return self.maker.scale.of(one.omega), one.count

    def _run(
        self, rows: Rows, task: Task, limits: Integers, forbidden: tuple[int, ...], eased: bool
    ) -> tuple[Path | None, bool]:
        labels, steps = FIRST_LABELS, FIRST_STEPS
        box = {name: (low, high) for name, low, high in task.candidate.unsized}
        guide = self.pairs.guide(() if eased else rows.lattices, box, task.tolerance, task.splits)
        while True:
            capacity = np.array([labels, labels], np.int64)
            limits[kernels_labels.MAX_STEPS] = steps
            started = self.now()
            status, codes = kernels.search(
                rows.starts, rows.places, rows.tally, rows.keys, rows.steps, rows.first,
                rows.info, rows.stack, rows.spelling, np.array(forbidden, np.uint64), limits,
                guide, capacity,
            )  # fmt: skip
            full = max(status[kernels_labels.LABELS], status[kernels_labels.STATES]) >= labels
            long = status[kernels_labels.STEPS] > steps
            most = (full and labels >= task.effort.labels) or (long and steps >= task.effort.steps)
            if not (full or long) or most or self.late(GROWTH * (self.now() - started)):
                break
            labels, steps = labels * (GROWTH if full else 1), steps * (GROWTH if long else 1)
        return (decoded(rows, codes) if len(codes) else None), bool(status[kernels_labels.COMPLETE])

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
        if len(node.box) == 1 and not task.splits and not node.leaf:
            return exact, self._ranges(node, task, exact)
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

    def _ranges(self, node: _Node, task: Task, exact: Alignment | None) -> list[_Node]:
        """Cut the range of the only unsized symbol where two substrings may be equal.

        Without such a size inside, every alignment's Ω is linear: the ends are searched exactly.
        """
        ((name, (low, high)),) = node.box.items()
        slack = SLACK * self.direction.canvas
        sizes = [
            z for z in self._breakpoints(task.candidate, name) if low + slack < z < high - slack
        ]
        if not sizes:
            ends = [replace(node, box={name: (end, end)}) for end in (low, high)]
            return [*ends, replace(node, leaf=True)] if high > low else []
        wish = dict(exact.sizes)[name] if exact is not None else (low + high) / 2
        middle = sizes[len(sizes) // 2]
        near = min(sizes, key=lambda z: abs(z - wish))
        cut = near if abs(near - wish) <= slack else middle
        return [replace(node, box={name: span}) for span in ((low, cut), (cut, high))]

    def _breakpoints(self, candidate: Candidate, name: str) -> list[float]:
        """Return all sizes at which some substrings of two of the words are equal."""
        key = candidate.lattices, name
        if key not in self._known:
            lines = set[Line]().union(*(self.maker.lines(one, name) for one in set(key[0])))
            own = {line for line in lines if line[0]}
            meets = {(b - a) / k for k, a in own for n, b in lines if not n} | crossings(own)
            self._known = {key: sorted(meets)}
        return self._known[key]

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
        both = [self.maker.grouped(path.candidate.lattices, merge) for merge in (True, False)]
        return tuple(dict.fromkeys(self._hash(groups, path, column) for groups in both))

    def _hash(self, groups: list[list[int]], path: Alignment, column: int) -> int:
        start, end = path.borders[column], path.borders[column + 1]
        total = 0
        for row, (layer, *_) in enumerate(groups):
            a, b, word = start[layer], end[layer], path.candidate.words[layer]
            if a != b or a.inside:
                keys = (self.maker.place_key(word, x.letters, x.inside) for x in (a, b))
                before, after = map(np.uint64, keys)
                total += int(row_hash(row, before, after, int(a.inside) + int(b.inside)))
        return total & (2**64 - 1)
