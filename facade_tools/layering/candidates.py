"""Candidates: tuples of words that may fill the canvas (IMAW15 5.1, eq. 7)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod

import daqp
import numpy as np

from .language import counters_of
from .lattice import FEW_WORDS, Family, Lattice, lattices, most_words
from .problem import LEAST_UNSIZED, SLACK, Candidate, Direction, LayerPattern
from .words import Expansion, Word, expand, least_size

FEW_CLASSES = 64  # so many tuples of multisets of letters are searched one by one
FALL_BACK = 64  # words of a pattern whose lattices are too large

Ranges = Mapping[str, tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Bounds:
    """Eq. 7 of one word: least ≤ known + Σ count · size of the unsized symbols ≤ greatest."""

    known: float
    counts: tuple[tuple[str, int], ...]
    least: float
    greatest: float


class Generator:
    """Generates the candidates of groups at one tolerance, few at a time.

    Several groups stand in one candidate, one after another, where they share counters or
    unsized symbols.

    `complete` becomes False where a bound left words out.
    """

    def __init__(
        self,
        direction: Direction,
        groups: Sequence[str],
        tolerance: float,
        late: Callable[[], bool] = lambda: False,
        few: float = FEW_WORDS,
    ) -> None:
        """Prepare; `late` tells when to stop, which leaves the rest out.

        few: patterns with more words under the same counters give lattices of them.
        """
        self.late, self.few = late, few
        self.direction = direction
        self.rows = [row for group in groups for row in direction.groups[group]]
        self.parts = tuple(len(direction.groups[group]) for group in groups)
        self.tops = {sum(self.parts[:i]) for i in range(len(groups))}
        self.canvas = direction.canvas
        self.tolerance = tolerance * direction.canvas
        self.slack = SLACK * direction.canvas
        self.limit = self.canvas + self.tolerance + self.slack
        self.least = direction.least_sizes()
        self.complete = True
        self.used = [sorted(counters_of(row.node)) for row in self.rows]
        self._rows: dict[tuple[int, str, tuple[int, ...]], Family] = {}

    def candidates(self) -> Iterator[Candidate]:
        """Yield candidates, each tuple of words once, small counters first."""
        seen: set[tuple[object, ...]] = set()
        for counters in self.assignments():
            for rows in self.tuples(counters):
                key = tuple(row.word if row.single else id(row) for row in rows)
                if key not in seen:
                    seen.add(key)
                    candidate = self._candidate(rows, counters)
                    if candidate is not None:
                        yield candidate

    def sampled(self, rng: np.random.Generator) -> Iterator[Candidate]:
        """Yield candidates with random counters and words; the same one may come again."""
        names = sorted(set[str]().union(*self.used))
        while not self.late():
            ranges = {name: self.direction.counters[name] for name in names}
            for name in rng.permutation(names):
                ranges[name] = self._drawn(str(name), ranges, rng)
            counters = {name: low for name, (low, _) in ranges.items()}
            lists = self._lists(counters)
            if all(lists):
                drawn = [[each[int(rng.integers(len(each)))]] for each in lists]
                for rows in self._tuples(drawn, (), 0.0):
                    candidate = self._candidate(rows, counters)
                    if candidate is not None:
                        yield candidate

    def _candidate(
        self, rows: tuple[Lattice, ...], counters: Mapping[str, int]
    ) -> Candidate | None:
        """Return the candidate of some rows, unless eq. 7 rules it out."""
        words = tuple(row.word for row in rows)
        whole = any(len(row.words) > 1 for row in rows)
        box = () if whole else self.box(words)
        if box is None:
            return None
        return Candidate(words, tuple(sorted(counters.items())), box, self.parts, rows)

    def _drawn(self, name: str, ranges: Ranges, rng: np.random.Generator) -> tuple[int, int]:
        """Return a random value of a counter, from those that leave no layer too wide."""
        low, high = ranges[name]
        while low < high:
            middle = (low + high) // 2
            if self._possible({**ranges, name: (middle + 1, high)}):
                value = int(rng.integers(low, high + 1))
                if self._possible({**ranges, name: (value, value)}):
                    return value, value
            high = middle
        return low, low

    def assignments(self) -> Iterator[dict[str, int]]:
        """Yield values of the group's counters under which every layer may have a fitting word."""
        names = sorted(set[str]().union(*self.used))
        yield from self._assign(names, {name: self.direction.counters[name] for name in names})

    def _assign(
        self, names: list[str], ranges: dict[str, tuple[int, int]]
    ) -> Iterator[dict[str, int]]:
        if self._stopped() or not self._possible(ranges):
            return
        name = next((name for name in names if ranges[name][0] < ranges[name][1]), None)
        if name is None:
            yield {name: ranges[name][0] for name in names}
            return
        low, high = ranges[name]
        for start, end in _blocks(low, high):
            part = ranges | {name: (start, end)}
            if start == end:
                yield from self._assign(names, part)
            elif self._possible(part):
                for value in range(start, end + 1):
                    yield from self._assign(names, ranges | {name: (value, value)})

    def _stopped(self) -> bool:
        late = self.late()
        self.complete = self.complete and not late
        return late

    def _possible(self, ranges: Ranges) -> bool:
        how = Expansion({}, self.least, self.limit)
        nodes = {id(row.node): row.node for row in self.rows}.values()
        return all(least_size(node, how, ranges) <= self.limit for node in nodes)

    def rows_of(self, layer: int, counters: Mapping[str, int]) -> Family:
        """Return the words of a layer that are not too wide, or lattices of them."""
        row = self.rows[layer]
        key = (id(row.node), row.reflection, tuple(counters[name] for name in self.used[layer]))
        if key not in self._rows:
            self._rows[key] = self._expanded(row, counters)
        found = self._rows[key]
        self.complete = self.complete and found.complete
        return found

    def _expanded(self, row: LayerPattern, counters: Mapping[str, int]) -> Family:
        rules = self.direction.rules
        transparent = frozenset(n for n, rule in rules.items() if rule.transparent)
        how = Expansion(
            counters, self.least, self.limit, row.reflection, transparent, late=self.late
        )
        if most_words(row.node, counters) > self.few:
            attached = frozenset(n for n, rule in rules.items() if rule.attached)
            found = lattices(row.node, how, attached)
            if found is not None:
                return found
            how = replace(how, most=FALL_BACK)
        words = expand(row.node, how)
        return Family.of_words(words.words, words.complete)

    def tuples(self, counters: Mapping[str, int]) -> Iterator[tuple[Lattice, ...]]:
        """Yield the tuples of words of which each is long enough for its layer."""
        lists = self._lists(counters)
        if all(lists):
            yield from self._tuples(lists, (), 0.0)

    def _lists(self, counters: Mapping[str, int]) -> list[list[Lattice]]:
        families = [self.rows_of(layer, counters) for layer in range(len(self.rows))]
        together = self._together(families)
        out: list[list[Lattice]] = []
        for one in families:
            if self._stopped():
                return [[]]
            out.append([one.whole] if together and one.mixed else one.classes)
        return out

    def _together(self, families: Sequence[Family]) -> bool:
        """Tell whether one search for all multisets of letters pays, and is possible.

        Ranges of unsized sizes belong to a multiset; words in groups that stand in one candidate
        are kept apart, too.
        """
        count = prod(len(family.words) for family in families if family.mixed)
        if count < FEW_CLASSES or len(self.parts) > 1:
            return False
        rules = self.direction.rules
        letters = {a.symbol for family in families for word in family.words for a in word}
        return all(rules[name].size is not None for name in letters)

    def _tuples(
        self, lists: list[list[Lattice]], head: tuple[Lattice, ...], opaque: float
    ) -> Iterator[tuple[Lattice, ...]]:
        if len(head) == len(lists):
            yield head
            return
        if self._stopped():
            return
        opaque = 0.0 if len(head) in self.tops else opaque
        least = self.canvas - self.tolerance - opaque - self.slack
        for row in lists[len(head)]:
            if any(self.direction.rules[a.symbol].size is None for a in row.word) or (
                max(map(self.known, row.words)) >= least
            ):
                above = opaque + max(map(self.direction.opaque_size, row.words))
                yield from self._tuples(lists, (*head, row), above)

    def known(self, word: Word) -> float:
        """Return the summed size (m) of a word's sized letters."""
        return sum(self.direction.rules[letter.symbol].size or 0.0 for letter in word)

    def bounds(self, words: Sequence[Word]) -> list[Bounds]:
        """Return eq. 7 of every word; the lower bound, too, is eased by the tolerance.

        The slack admits words, but unsized symbols do without it where they can: an Ω that is
        smaller by the slack alone would go before what ties with it.
        """
        eased = self._eq7(words, self.slack)
        if not any(row.counts for row in eased):
            return eased
        exact = [
            strict if strict.counts else row
            for strict, row in zip(self._eq7(words, 0.0), eased, strict=True)
        ]
        return eased if self._box(exact) is None else exact

    def _eq7(self, words: Sequence[Word], slack: float) -> list[Bounds]:
        out = []
        opaque = 0.0
        for layer, word in enumerate(words):
            opaque = 0.0 if layer in self.tops else opaque
            counts: dict[str, int] = {}
            for letter in word:
                if self.direction.rules[letter.symbol].size is None:
                    counts[letter.symbol] = counts.get(letter.symbol, 0) + 1
            least = self.canvas - self.tolerance - opaque - slack
            most = self.canvas + self.tolerance + slack
            out.append(Bounds(self.known(word), tuple(counts.items()), least, most))
            opaque += self.direction.opaque_size(word)
        return out

    def box(self, words: Sequence[Word]) -> tuple[tuple[str, float, float], ...] | None:
        """Return the ranges of the unsized symbols' sizes; None where eq. 7 cannot hold."""
        return self._box(self.bounds(words))

    def _box(self, bounds: Sequence[Bounds]) -> tuple[tuple[str, float, float], ...] | None:
        least = LEAST_UNSIZED * self.canvas
        names = sorted({name for row in bounds for name, _ in row.counts})
        box = dict.fromkeys(names, (least, self.limit))
        for _ in range(len(names) + 1):
            for row in bounds:
                if not _tighten(row, box, self.slack):
                    return None
        if len(names) > 1 and point_in(bounds, box) is None:
            return None
        return tuple((name, *box[name]) for name in names)


def _blocks(low: int, high: int) -> Iterator[tuple[int, int]]:
    """Yield blocks that double in length, so that what lies too far is left out in a few steps."""
    length = 1
    while low <= high:
        yield low, min(low + length - 1, high)
        low, length = low + length, 2 * length


def _tighten(row: Bounds, box: dict[str, tuple[float, float]], slack: float) -> bool:
    """Shrink the box by one word's bounds; False where nothing is left."""
    low = row.known + sum(count * box[name][0] for name, count in row.counts)
    high = row.known + sum(count * box[name][1] for name, count in row.counts)
    if low > row.greatest or high < row.least:
        return False
    for name, count in row.counts:
        a, b = box[name]
        top = (row.greatest - (low - count * a)) / count
        bottom = (row.least - (high - count * b)) / count
        box[name] = max(a, bottom), min(b, top)
        if box[name][0] > box[name][1] + slack:
            return False
        box[name] = min(box[name]), max(box[name])
        low += count * (box[name][0] - a)
        high += count * (box[name][1] - b)
    return True


def point_in(
    bounds: Sequence[Bounds],
    box: Mapping[str, tuple[float, float]],
    near: Mapping[str, float] | None = None,
) -> dict[str, float] | None:
    """Return sizes of the unsized symbols, closest to `near`, that satisfy eq. 7; None if none."""
    names = sorted(box)
    goal = near or {name: sum(box[name]) / 2 for name in names}
    rows = [row for row in bounds if row.counts]
    matrix = np.zeros((len(rows), len(names)))
    for i, row in enumerate(rows):
        for name, count in row.counts:
            matrix[i, names.index(name)] = count
    upper = np.array([*(box[name][1] for name in names), *(r.greatest - r.known for r in rows)])
    lower = np.array([*(box[name][0] for name in names), *(r.least - r.known for r in rows)])
    unit = max(1e-300, float(np.max(np.abs(upper), initial=0.0)))
    linear = -np.array([goal[name] for name in names]) / unit
    x, _, flag, _ = daqp.solve(
        np.eye(len(names)), linear, matrix, upper / unit, lower / unit,
        np.zeros(len(upper), dtype=np.int32), primal_tol=1e-9,
    )  # fmt: skip
    if flag < 1:
        return None
    return dict(zip(names, (np.asarray(x) * unit).tolist(), strict=True))
