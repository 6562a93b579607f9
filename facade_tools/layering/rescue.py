"""Alignments found soon, where the exact search would take too long."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from .alignment import Aligner
from .candidates import Generator
from .evaluation import evaluate, least_error
from .problem import (
    LEAST_UNSIZED,
    SLACK,
    TOLERANCES,
    Alignment,
    Candidate,
    Direction,
    Span,
)
from .sizing import conflict
from .tasks import Effort, Task, key_of
from .words import Word

UNITS = 8  # lengths that sizes are rounded to, at most
DRAWS = 3  # of the unsized sizes, for each of them
GLANCE = Effort(labels=10_000, steps=400_000, nodes=6, beam=12)


class Rescue:
    """Looks for alignments that are exact for sizes near the preferred ones.

    Such an alignment always has a sizing, which is what most of those near Ω = µ lack, and the
    search for it is short: it need not carry any error along.
    """

    def __init__(
        self,
        direction: Direction,
        groups: tuple[str, ...],
        late: Callable[[float], bool],
        now: Callable[[], float],
    ) -> None:
        self.direction, self.groups, self.late, self.now = direction, groups, late, now

    def rounded(
        self, candidate: Candidate, tolerance: float, splits: bool, *, rng: np.random.Generator
    ) -> Alignment | None:
        """Return the best alignment that is exact for sizes rounded to some unit, or None."""
        found = []
        for unit in _units(self.direction, candidate):
            aligner = Aligner(_in_units(self.direction, unit), self.late, self.now)
            for drawn in self._drawn(candidate, unit, rng):
                if self.late(0.0):
                    break
                bounds = tuple(self._generator(tolerance).bounds(drawn.words))
                task = Task(drawn, bounds, tolerance, 0.0, splits, GLANCE)
                path = aligner.best(task).alignment
                own = None if path is None else self._preferred(path, candidate, tolerance)
                if own is not None and self.admits(own, tolerance):
                    found.append(own)
        canvas = self.direction.canvas
        return min(found, key=lambda one: key_of(one, canvas), default=None)

    def in_one_column(self, candidate: Candidate, tolerance: float) -> Alignment | None:
        """Return the alignment that leaves every word whole, or None where it may not stand."""
        words = candidate.words
        if len(candidate.parts) > 1 or not self._is_column(words):
            return None
        ends = tuple(Span(len(word)) for word in words)
        path = Alignment(candidate, ((Span(0),) * len(words), ends), 0.0, 0.0, 0, tolerance)
        found = self._preferred(path, candidate, tolerance)
        return found if found is not None and self.admits(found, tolerance) else None

    def _is_column(self, words: Sequence[Word]) -> bool:
        """Tell whether words may stand above one another (IMAW15 5.2)."""
        rules = self.direction.rules
        covered = any(word and all(map(self.direction.is_opaque, word)) for word in words)
        mixed = any(len({a.transparent for a in word}) > 1 for word in words)
        kept = [any(rules[a.symbol].unoccludable for a in word) for word in words]
        last = max((i for i, one in enumerate(kept) if one), default=0)
        clear = all(a.transparent for word in words[:last] for a in word)
        return covered and clear and not mixed

    def _generator(self, tolerance: float) -> Generator:
        return Generator(self.direction, self.groups, tolerance)

    def _drawn(
        self, candidate: Candidate, unit: float, rng: np.random.Generator
    ) -> Iterator[Candidate]:
        """Yield the candidate with unsized sizes drawn from the multiples of a unit."""
        if not candidate.unsized:
            yield candidate
            return
        least = LEAST_UNSIZED * self.direction.canvas
        for _ in range(DRAWS):
            sizes = []
            for name, low, high in candidate.unsized:
                times = rng.integers(np.floor(low / unit), np.floor(high / unit) + 1)
                size = max(least, float(times) * unit)
                sizes.append((name, size, size))
            yield replace(candidate, unsized=tuple(sizes))

    def _preferred(
        self, path: Alignment, candidate: Candidate, tolerance: float
    ) -> Alignment | None:
        """Return the alignment with its Ω and Σ for the preferred sizes, and the best unsized."""
        candidate = replace(candidate, words=path.candidate.words)
        box = {name: (low, high) for name, low, high in candidate.unsized}
        own = evaluate(self.direction, candidate, path.borders, tolerance, box)
        bounds = self._generator(tolerance).bounds(candidate.words)
        return least_error(self.direction, own, bounds, tolerance, box)

    def admits(self, found: Alignment, tolerance: float) -> bool:
        """Tell whether eq. 7, Ω, Σ and the sizing let an alignment pass at a tolerance."""
        canvas = self.direction.canvas
        most = (tolerance + SLACK) * canvas
        sizes = dict(found.sizes)
        slack = SLACK * canvas
        for row in self._generator(tolerance).bounds(found.candidate.words):
            size = row.known + sum(times * sizes[name] for name, times in row.counts)
            if not row.least - slack <= size <= row.greatest + slack:
                return False
        point = {name: (size, size) for name, size in sizes.items()}
        parts = [found.part(i) for i in range(len(found.candidate.parts))]
        for one in parts:
            own = evaluate(self.direction, one.candidate, one.borders, tolerance, point)
            if own.omega > most or abs(own.sigma - canvas) > most:
                return False
        return conflict(self.direction, parts) is None

    def tightened(self, found: Alignment) -> Alignment:
        """Return an alignment at the least tolerance that admits it."""
        for tolerance in TOLERANCES:
            if tolerance < found.tolerance and self.admits(found, tolerance):
                return replace(found, tolerance=tolerance)
        return found


def _units(direction: Direction, candidate: Candidate) -> list[float]:
    """Return lengths (m) that sizes may be rounded to multiples of, the finest first."""
    used = {a.symbol for word in candidate.words for a in word}
    sizes = [direction.rules[name].size for name in used]
    units = {round(size / part, 9) for size in sizes if size is not None for part in (1, 2)}
    return sorted(units)[:UNITS]


def _in_units(direction: Direction, unit: float) -> Direction:
    def rounded(size: float | None) -> float | None:
        return None if size is None else unit * max(1, round(size / unit))

    rules = {name: replace(rule, size=rounded(rule.size)) for name, rule in direction.rules.items()}
    return replace(direction, rules=rules)
