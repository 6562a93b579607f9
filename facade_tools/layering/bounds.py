"""Lower bounds on a candidate's Ω, from the sizes of its words and from pairs of its layers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import prod
from typing import NamedTuple

import numpy as np

from . import kernels, kernels_labels
from .kernels_pairs import pair_costs
from .lattice import Lattice
from .problem import SLACK, Candidate, Direction
from .rows import Box, Integers, RowMaker, TooLarge
from .words import Word

WEIGHTS = np.array([[1, 0], [2, 1], [1, 1], [1, 2], [1, 4], [0, 1]])  # of Ω and Σ
MOST_GUIDED = 6  # rows
MOST_WORK = 20_000_000  # pairs of steps
MOST_COSTS = 400_000  # pairs of places
MOST_BYTES = 100_000_000  # of all costs
FIRST_LABELS = 2_000
PAIR_LABELS = 128_000
PAIR_STEPS = 4_000_000
MOST_PAIRS = 100_000  # remembered
MOST_EDGES = 500_000  # of their lattices


class Guide(NamedTuple):
    """What kernels.search reads of pairs of rows: see kernels_pairs.hopeless."""

    pairs: Integers
    future: Integers
    weights: Integers


@dataclass(slots=True)
class _Pair:
    """Costs of two layers; of Ω what a search has found: it is no less than `floor` (units).

    costs: from each two places on, or None where they would be too many. final: nothing more will
    be found.
    """

    costs: Integers | None
    floor: int = 0
    final: bool = False


class PairBounds:
    """Least Ω of two layers of a candidate, aligned without the others.

    Whatever aligns all layers aligns each two of them, with columns that are no wider and errors
    that are no greater; only the opaque substring of a column may be another layer's. Such bounds
    are soon found, and most candidates have some pair of layers that others have, too.
    """

    def __init__(
        self,
        direction: Direction,
        maker: RowMaker,
        late: Callable[[float], bool] = lambda _: False,
    ) -> None:
        """Bound; `late(s)` tells whether the time will be up in s seconds: then nothing is."""
        self.direction, self.maker, self.late = direction, maker, late
        self._known: dict[object, _Pair] = {}
        self._held: dict[Lattice, None] = {}
        self._edges = 0  # of the lattices held
        self._bytes = 0  # of the costs

    def exceed(self, candidate: Candidate, tolerance: float, splits: bool, budget: float) -> bool:
        """Tell whether some two layers alone need a greater Ω than the budget (m)."""
        box = {name: (low, high) for name, low, high in candidate.unsized}
        most, widest = self._limits(tolerance)
        most = min(most, self.maker.scale.down(budget + SLACK * self.direction.canvas))
        for first, end in candidate.split():
            pairs = _pairs(candidate.lattices[first:end])
            if any(
                self._dear(self._pair(pair, box, tolerance, splits), most, widest) for pair in pairs
            ):
                return True
            for pair in pairs:
                if self.late(0.0):
                    return False
                if self._floor(pair, box, tolerance, splits, most) > most:
                    return True
        return False

    def _limits(self, tolerance: float) -> tuple[int, int]:
        """Return the greatest Ω and Σ in units."""
        canvas, scale = self.direction.canvas, self.maker.scale
        return scale.down(canvas * (tolerance + SLACK)), scale.down(
            canvas * (1.0 + tolerance + SLACK)
        )

    def guide(self, lattices: Sequence[Lattice], box: Box, tolerance: float, splits: bool) -> Guide:
        """Return the costs of all pairs of rows, as far as they are known."""
        pairs = np.full((len(lattices), len(lattices)), -1, np.int64)
        parts = []
        size = 0
        if len(lattices) <= MOST_GUIDED:
            for i, j in combinations(range(len(lattices)), 2):
                pair = lattices[i], lattices[j]
                costs = self._pair(pair, box, tolerance, splits).costs
                if costs is not None:
                    pairs[i, j] = size
                    size += costs.size
                    parts.append(costs.reshape(-1))
        future = np.concatenate(parts) if parts else np.zeros(0, np.int64)
        return Guide(pairs, future, WEIGHTS)

    @staticmethod
    def _dear(pair: _Pair, most: int, widest: int) -> bool:
        """Tell whether no weighting of Ω and Σ leaves a way."""
        if pair.costs is None:
            return False
        return bool(np.any(pair.costs[0, 0] > WEIGHTS @ np.array([most, widest])))

    def _pair(
        self, pair: tuple[Lattice, Lattice], box: Box, tolerance: float, splits: bool
    ) -> _Pair:
        key = self._key(pair, box, tolerance, splits)
        if key not in self._known:
            self._hold(pair)
            costs = self._costs(pair, box, tolerance, splits)
            self._bytes += 0 if costs is None else costs.nbytes
            self._known[key] = _Pair(costs)
        return self._known[key]

    @staticmethod
    def _key(pair: tuple[Lattice, Lattice], box: Box, *rest: object) -> object:
        names = sorted({e.letter.symbol for one in pair for e in one.edges} & set(box))
        ranges = tuple((name, *box[name]) for name in names)
        return tuple(one.word if one.single else one for one in pair), ranges, rest

    def _costs(
        self, pair: tuple[Lattice, Lattice], box: Box, tolerance: float, splits: bool
    ) -> Integers | None:
        try:
            graphs = [self.maker.graph(one, splits) for one in pair]
            rows = None
            if (
                prod(len(graph.steps) for graph in graphs) <= MOST_WORK
                and prod(one.size + len(g.opens) for one, g in zip(pair, graphs, strict=True))
                <= MOST_COSTS
            ):
                rows = self.maker.rows(pair, box, False, splits)
        except TooLarge:
            return None
        if rows is None:
            return None
        costs: Integers = pair_costs(
            rows.starts, rows.places, rows.steps, rows.first, WEIGHTS, *self._limits(tolerance)
        )
        return costs

    def _hold(self, pair: tuple[Lattice, Lattice]) -> None:
        """Forget everything where it becomes too large."""
        for lattice in pair:
            if not lattice.single and lattice not in self._held:
                self._held[lattice] = None
                self._edges += len(lattice.edges)
        if max(len(self._known) / MOST_PAIRS, self._edges / MOST_EDGES) > 1 or (
            self._bytes > MOST_BYTES
        ):
            self._known.clear()
            self._held.clear()
            self._edges = self._bytes = 0

    def _floor(
        self, pair: tuple[Lattice, Lattice], box: Box, tolerance: float, splits: bool, most: int
    ) -> int:
        """Return a lower bound on Ω in units: exact, or above `most`, or as far as it is known."""
        key = self._key(pair, box, tolerance, splits, "searched")
        if key not in self._known:
            self._known[key] = _Pair(None)
        entry = self._known[key]
        if not entry.final and entry.floor <= most:
            found = self._searched(pair, box, tolerance, splits, most)
            entry.final = found is None or found <= most
            entry.floor = max(entry.floor, found or 0)
        return entry.floor

    def _searched(
        self, pair: tuple[Lattice, Lattice], box: Box, tolerance: float, splits: bool, most: int
    ) -> int | None:
        """Return the least Ω of a pair, or most + 1 where it is greater; None where unknown."""
        widest = self._limits(tolerance)[1]
        try:
            rows = self.maker.rows(pair, box, False, splits)
        except TooLarge:
            return None
        limits = np.zeros(kernels_labels.MORE + 1, np.int64)
        limits[kernels_labels.BUDGET], limits[kernels_labels.WIDEST] = most, widest
        limits[kernels_labels.CANVAS] = self.maker.scale.of(self.direction.canvas)
        limits[kernels_labels.SPLITS] = splits
        limits[kernels_labels.MAX_STEPS] = PAIR_STEPS
        limits[kernels_labels.LOOSE] = kernels_labels.BARE
        limits[kernels_labels.SHORTEST] = -widest
        guide = self.guide(pair, box, tolerance, splits)
        labels = FIRST_LABELS
        while True:
            status, _ = kernels.search(
                rows.starts, rows.places, rows.tally, rows.keys, rows.steps, rows.first,
                rows.info, rows.stack, rows.spelling, np.zeros(0, np.uint64), limits, guide,
                np.array([labels, labels]),
            )  # fmt: skip
            if status[kernels_labels.COMPLETE]:
                found = status[kernels_labels.BEST] >= 0
                return int(status[kernels_labels.REACHED]) if found else most + 1
            many = labels >= PAIR_LABELS or status[kernels_labels.STEPS] > PAIR_STEPS
            if many or self.late(0.0):
                return None
            labels *= 8


def _pairs(lattices: Sequence[Lattice]) -> list[tuple[Lattice, Lattice]]:
    """Return all pairs of different layers, the smallest first."""
    distinct = {(one.word if one.single else one): one for one in lattices}.values()
    return sorted(combinations(distinct, 2), key=lambda pair: prod(len(a.edges) for a in pair))


def size_floor(direction: Direction, candidate: Candidate, tolerance: float) -> float:
    """Return a lower bound on Ω (m) from the words' sizes alone."""
    return max(
        lacking(direction, candidate, tolerance), least_omega(direction, candidate, tolerance)
    )


def least_omega(direction: Direction, candidate: Candidate, tolerance: float) -> float:
    """Return by how much words fall short of each other (m).

    A row that has no room for an empty column, because the smallest opaque letter is wider than
    what the canvas and the tolerance leave it, falls short of the widest row by at most Ω.
    """
    box = {name: (low, high) for name, low, high in candidate.unsized}
    least: list[float] = []
    most: list[float] = []
    smallest = float("inf")
    for words in _alternatives(candidate):
        spans = [[_span(direction, box, letter.symbol) for letter in word] for word in words]
        least.append(min(sum(low for low, _ in each) for each in spans))
        most.append(max(sum(high for _, high in each) for each in spans))
        for word, each in zip(words, spans, strict=True):
            opaque = [s[0] for s, a in zip(each, word, strict=True) if direction.is_opaque(a)]
            smallest = min([smallest, *opaque])
    room = direction.canvas * (1.0 + tolerance + SLACK)
    total = 0.0
    for first, end in candidate.split():
        widest = max(least[first:end])
        rows = zip(least[first:end], most[first:end], strict=True)
        total += max(0.0, *(widest - b for a, b in rows if room - a < smallest), 0.0)
    return total


def lacking(direction: Direction, candidate: Candidate, tolerance: float) -> float:
    """Return another lower bound on Ω (m): the length that no opaque letter covers.

    Every column has an opaque substring, which is at most ω narrower than the column.
    """
    floor = direction.canvas * (1.0 - tolerance - SLACK)
    opaque = [max(map(direction.opaque_size, words)) for words in _alternatives(candidate)]
    covered = [sum(opaque[first:end]) for first, end in candidate.split()]
    return floor - min(covered)


def _alternatives(candidate: Candidate) -> list[tuple[Word, ...]]:
    """Return a word for each multiset of letters that each layer may have."""
    return [lattice.words for lattice in candidate.lattices]


def _span(direction: Direction, box: Box, name: str) -> tuple[float, float]:
    size = direction.rules[name].size
    return (size, size) if size is not None else box[name]
