"""The best candidate and alignment of a group: growing tolerance, growing budget, any time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from .alignment import Aligner, Effort, Found, Key, Task, full_key
from .candidates import Generator
from .problem import SLACK, TOLERANCES, Alignment, Candidate, Direction

BUDGETS = (0.0, 1 / 16, 1 / 4, 1.0)  # of µ: Ω is looked for from below
QUICK = Effort(labels=20_000, steps=400_000, nodes=64, beam=24)
MAX_CANDIDATES = 100_000  # kept of one group at one tolerance

Accept = Callable[[Alignment], bool]


class Stage(NamedTuple):
    """One step of the search: tolerance (a share of the canvas), and whether letters may split."""

    tolerance: float
    splits: bool


STAGES = tuple(Stage(tolerance, splits) for tolerance in TOLERANCES for splits in (False, True))


@dataclass(frozen=True, slots=True)
class Answer:
    """The layout of one group; `optimal` when proved, `gap` (m) what may be left in Ω."""

    alignment: Alignment
    optimal: bool
    gap: float = 0.0


@dataclass(slots=True)
class Clock:
    """When a search must end, and whether it was cut short."""

    until: float = float("inf")
    late: bool = field(default=False)

    def over(self, ahead: float = 0.0) -> bool:
        """Tell whether the time is up, or will be in some seconds."""
        self.late = self.late or time.monotonic() > self.until
        return self.late or time.monotonic() + ahead > self.until

    def share(self, part: float) -> Clock:
        """Return a clock for a part of the time that is left."""
        now = time.monotonic()
        left = self.until - now
        return Clock(self.until if left == float("inf") else now + part * left)


class GroupSearch:
    """Searches one alignment group of a direction, or several that depend on one another."""

    def __init__(
        self,
        direction: Direction,
        groups: tuple[str, ...],
        clock: Clock,
        effort: Effort | None = None,
    ) -> None:
        self.direction, self.groups, self.clock = direction, groups, clock
        self.effort = effort or Effort()
        self.aligner = Aligner(direction, lambda ahead: self.clock.over(ahead))
        self._kept: dict[float, tuple[list[Candidate], Generator]] = {}

    def answer(self) -> Answer | None:
        """Return the best alignment at the first tolerance that has any, or None.

        What the clock cuts off is answered by a beam search, and is not optimal.
        """
        proved = cleared = True
        first = self.clock
        self.clock = first.share(0.5)
        for stage in STAGES:
            found = self.at(stage)
            proved = proved and found.complete
            if found.alignment is not None:
                self.clock = first
                if not found.complete and not first.over(1.0):
                    found = self._again(stage, found)
                    proved = found.complete and cleared
                return self._finished(found, proved)
            cleared = proved
            if self.clock.over():
                break
        else:
            self.clock = first
            return None if proved else self._rescued(stage)
        self.clock = first
        return self._rescued(stage)

    def _again(self, stage: Stage, before: Found) -> Found:
        """Search a stage with the time that is left; keep what was known if it is better."""
        found = self.at(stage)
        if found.alignment is None or before.alignment is None:
            return replace(before, complete=False)
        better = self._before(before.alignment, found.alignment)
        return replace(before, complete=False) if better else found

    def _finished(self, found: Found, proved: bool) -> Answer | None:
        assert found.alignment is not None
        return Answer(found.alignment, proved, 0.0 if proved else found.alignment.omega)

    def _rescued(self, stuck: Stage) -> Answer | None:
        """Answer quickly by beams, then go on with the exact search while there is time."""
        best = self._beamed(stuck)
        for stage in STAGES[STAGES.index(stuck) :]:
            if self.clock.over():
                break
            found = self.at(stage)
            if found.alignment is not None:
                if best is None or self._before(found.alignment, best):
                    best = found.alignment
                return Answer(best, False, best.omega)
        return None if best is None else Answer(best, False, best.omega)

    def _before(self, a: Alignment, b: Alignment) -> bool:
        return self._rank(a) < self._rank(b)

    def _rank(self, a: Alignment) -> tuple[float, bool, Key]:
        return a.tolerance, a.pieces > 0, full_key(a, self.direction.canvas)

    def _beamed(self, stuck: Stage) -> Alignment | None:
        """Try beams on every candidate, each stage within its share of the time."""
        whole = self.clock
        stages = STAGES[STAGES.index(stuck) :]
        best: Alignment | None = None
        for left, stage in zip(range(len(stages), 0, -1), stages, strict=True):
            self.clock = whole.share(0.8 / left)
            for candidate in self.candidates(stage.tolerance):
                budget = stage.tolerance * self.direction.canvas
                found = self._align(candidate, stage, budget, QUICK)
                if found.alignment is not None and (
                    best is None or self._before(found.alignment, best)
                ):
                    best = found.alignment
                if self.clock.over():
                    break
            if best is not None or whole.over():
                break
        self.clock = whole
        return best

    def candidates(self, tolerance: float) -> Iterator[Candidate]:
        """Yield the candidates at a tolerance; the first MAX_CANDIDATES are kept."""
        if tolerance in self._kept:
            yield from self._kept[tolerance][0]
            return
        generator = Generator(self.direction, self.groups, tolerance, self.clock.over)
        kept: list[Candidate] = []
        for candidate in generator.candidates():
            kept.append(candidate)
            yield candidate
            if len(kept) >= MAX_CANDIDATES or self.clock.late:
                generator.complete = False
                return
        self._kept[tolerance] = kept, generator

    def at(self, stage: Stage) -> Found:
        """Return the best alignment at one tolerance, with or without splits."""
        complete = True
        for share in BUDGETS:
            budget = share * stage.tolerance * self.direction.canvas
            found = self._within(stage, budget)
            complete = complete and found.complete
            if found.alignment is not None or self.clock.over():
                return replace(found, complete=complete and found.complete)
        return Found(None, complete)

    def _within(self, stage: Stage, budget: float) -> Found:
        best: Alignment | None = None
        complete = True
        for candidate in self.candidates(stage.tolerance):
            if self.clock.over():
                return Found(best, False)
            limit = budget if best is None else best.omega
            if not self._hopeful(candidate, stage, limit):
                continue
            found = self._align(candidate, stage, limit, self.effort)
            complete = complete and found.complete
            if found.alignment is not None and (
                best is None or self._before(found.alignment, best)
            ):
                best = found.alignment
        kept = self._kept.get(stage.tolerance)
        return Found(best, complete and kept is not None and kept[1].complete)

    def all_at(self, tolerance: float, splits: bool) -> Iterator[Alignment]:
        """Yield the best alignment of every candidate that has one, while there is time."""
        stage = Stage(tolerance, splits)
        for candidate in self.candidates(tolerance):
            if self.clock.over():
                return
            budget = tolerance * self.direction.canvas
            found = self._align(candidate, stage, budget, self.effort)
            if found.alignment is not None:
                yield found.alignment

    def _hopeful(self, candidate: Candidate, stage: Stage, budget: float) -> bool:
        """Tell whether a lower bound on Ω leaves room: see `least_omega`."""
        return (
            least_omega(self.direction, candidate, stage) <= budget + SLACK * self.direction.canvas
        )

    def _align(self, candidate: Candidate, stage: Stage, budget: float, effort: Effort) -> Found:
        bounds = Generator(self.direction, self.groups, stage.tolerance).bounds(candidate.words)
        task = Task(candidate, tuple(bounds), stage.tolerance, budget, stage.splits, effort)
        return self.aligner.best(task)


def least_omega(direction: Direction, candidate: Candidate, stage: Stage) -> float:
    """Return a lower bound on Ω (m) from the words' sizes alone.

    A row that has no room for an empty column, because the smallest opaque letter is wider than
    what the canvas and the tolerance leave it, falls short of the widest row by at most Ω.
    """
    box = {name: (low, high) for name, low, high in candidate.unsized}
    least: list[float] = []
    most: list[float] = []
    smallest = float("inf")
    for word in candidate.words:
        spans = [_span(direction, box, letter.symbol) for letter in word]
        least.append(sum(low for low, _ in spans))
        most.append(sum(high for _, high in spans))
        opaque = [s[0] for s, a in zip(spans, word, strict=True) if direction.is_opaque(a)]
        smallest = min([smallest, *opaque])
    room = direction.canvas * (1.0 + stage.tolerance + SLACK)
    total = 0.0
    for first, end in candidate.split():
        widest = max(least[first:end])
        rows = zip(least[first:end], most[first:end], strict=True)
        total += max(0.0, *(widest - b for a, b in rows if room - a < smallest), 0.0)
    return total


def _span(
    direction: Direction, box: dict[str, tuple[float, float]], name: str
) -> tuple[float, float]:
    size = direction.rules[name].size
    return (size, size) if size is not None else box[name]
