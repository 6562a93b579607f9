"""The best candidate and alignment of a group: growing tolerance, growing budget, any time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from ..randomness import item_generator
from .alignment import Aligner
from .bounds import size_floor
from .candidates import Generator
from .lattice import FEW_WORDS
from .problem import SLACK, TOLERANCES, Alignment, Candidate, Direction
from .rescue import GLANCE, Rescue
from .tasks import Effort, Found, Key, Task, full_key

BUDGETS = (0.0, 1 / 16, 1 / 4, 1.0)  # of µ: Ω is looked for from below
QUICK = Effort(labels=20_000, steps=400_000, nodes=32, beam=24)
PROVING = 0.65  # share of the time after which an answer goes before a proof
MAX_CANDIDATES = 100_000  # kept of one group at one tolerance


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
    now: Callable[[], float] = time.monotonic

    def over(self, ahead: float = 0.0) -> bool:
        """Tell whether the time is up, or will be in some seconds."""
        now = self.now()
        self.late = self.late or now > self.until
        return self.late or now + ahead > self.until

    def share(self, part: float) -> Clock:
        """Return a clock for a part of the time that is left."""
        now = self.now()
        left = self.until - now
        return Clock(self.until if left == float("inf") else now + part * left, now=self.now)


class GroupSearch:
    """Searches one alignment group of a direction, or several that depend on one another."""

    def __init__(
        self,
        direction: Direction,
        groups: tuple[str, ...],
        clock: Clock,
        effort: Effort | None = None,
        few: float = FEW_WORDS,
    ) -> None:
        """Search; `few`: patterns with more words are searched as lattices, not word by word."""
        self.few = few
        self.direction, self.groups, self.clock = direction, groups, clock
        self.effort = effort or Effort()
        self.aligner = Aligner(direction, lambda ahead: self.clock.over(ahead), clock.now)
        self.exhausted = False  # whether everything has been tried that may have a layout
        self._kept: dict[float, tuple[list[Candidate], Generator]] = {}
        self._alive: list[list[Candidate]] = []  # so that no two candidates have one identity
        self._refuted: dict[tuple[Stage, int], float] = {}  # no smaller Ω than this
        self._floors: dict[Stage, float] = {}  # of Ω, where a stage is not searched to its end

    def answer(self) -> Answer | None:
        """Return the best alignment at the first tolerance that has any, or None.

        What the clock cuts off is answered by a beam search, and is not optimal.
        """
        first = self.clock
        self.clock = first.share(PROVING)
        open_: list[Stage] = []  # not searched to their ends
        for stage in STAGES:
            found = self.at(stage)
            open_ += [] if found.complete else [stage]
            if found.alignment is not None:
                self.clock = first
                best, proved = self._closed(found.alignment, open_)
                return self._answered(best or found.alignment, proved)
            if self.clock.over():
                self.clock = first
                return self._rescued(stage)
        self.clock = first.share(0.5)
        best, self.exhausted = self._closed(None, open_)
        self.clock = first
        if best is not None:
            return self._answered(best, self.exhausted)
        return None if self.exhausted else self._rescued(open_[0])

    def _closed(self, best: Alignment | None, stages: list[Stage]) -> tuple[Alignment | None, bool]:
        """Search stages again with the time that is left; return the best, and if that is proved.

        best: what is known, of a stage that is not before those.
        """
        for stage in stages:
            if self.clock.over(1.0):
                return best, False
            found = self.at(stage)
            one = found.alignment
            if one is not None and (best is None or not self._before(best, one)):
                best = one
            if not found.complete:
                return best, False
            if one is not None:
                break
        return best, True

    def _answered(self, best: Alignment, proved: bool) -> Answer:
        """Return an answer with the gap between its Ω and the least that may have been missed."""
        missed = [floor for stage, floor in self._floors.items() if stage <= _stage_of(best)]
        floor = best.omega if proved else min([best.omega, *missed])
        return Answer(best, proved, max(0.0, best.omega - floor))

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
                return self._answered(best, False)
            self._floors.setdefault(stage, 0.0)
        return None if best is None else self._answered(best, False)

    def _before(self, a: Alignment, b: Alignment) -> bool:
        return self._rank(a) < self._rank(b)

    def _rank(self, a: Alignment) -> tuple[float, bool, Key]:
        return a.tolerance, a.pieces > 0, full_key(a, self.direction.canvas)

    def _beamed(self, stuck: Stage) -> Alignment | None:
        """Try beams on every candidate, each stage within its share of the time."""
        whole = self.clock
        stages = STAGES[STAGES.index(stuck) :]
        best = self._secured()
        if best is not None:
            stages = tuple(stage for stage in stages if stage <= _stage_of(best))
        for left, stage in zip(range(len(stages), 0, -1), stages, strict=True):
            share = whole.share(0.8 / left)
            for tried, clock in ((self.candidates, share.share(0.5)), (self._sampled, share)):
                self.clock = clock
                best = self._best_beam(tried(stage.tolerance), stage, best)
            if whole.over() or (best is not None and _stage_of(best) <= stage):
                break
        self.clock = whole
        return best

    def _secured(self) -> Alignment | None:
        """Return any alignment, soon: the first that beams find at the greatest tolerance.

        Where they find none, one whose words are whole.
        """
        whole = self.clock
        rescue = Rescue(
            self.direction, self.groups, lambda ahead: self.clock.over(ahead), whole.now
        )
        for stage in STAGES[-2:]:
            self.clock = whole.share(0.25)
            budget = self._budget(stage.tolerance)
            rng = item_generator(1, "layer-solve", *self.groups)
            for candidate in self._sampled(stage.tolerance):
                found = None
                if self._hopeful(candidate, stage, budget):
                    found = rescue.rounded(candidate, *stage, rng=rng)
                    found = found or self._align(candidate, stage, budget, GLANCE).alignment
                if found is not None:
                    self.clock = whole
                    return rescue.tightened(found)
        self.clock = whole.share(0.25)
        last = STAGES[-1].tolerance
        columns = (rescue.in_one_column(one, last) for one in self.candidates(last))
        found = next((one for one in columns if one is not None), None)
        self.clock = whole
        return None if found is None else rescue.tightened(found)

    def _best_beam(
        self, candidates: Iterator[Candidate], stage: Stage, best: Alignment | None
    ) -> Alignment | None:
        """Return the best of what beams find among candidates, while the clock lets them."""
        budget = self._budget(stage.tolerance)
        for candidate in candidates:
            if self.clock.over():
                break
            if self._hopeful(candidate, stage, budget if best is None else best.omega):
                found = self._align(candidate, stage, budget, QUICK).alignment
                if found is not None and (best is None or self._before(found, best)):
                    best = found
        return best

    def _sampled(self, tolerance: float) -> Iterator[Candidate]:
        """Yield candidates at random, until the clock stops them: few of very many are seen."""
        generator = Generator(self.direction, self.groups, tolerance, self.clock.over, self.few)
        yield from generator.sampled(item_generator(0, "layer-solve", *self.groups))

    def candidates(self, tolerance: float) -> Iterator[Candidate]:
        """Yield the candidates at a tolerance; the first MAX_CANDIDATES are kept."""
        if tolerance in self._kept:
            yield from self._kept[tolerance][0]
            return
        generator = Generator(self.direction, self.groups, tolerance, self.clock.over, self.few)
        kept: list[Candidate] = []
        self._alive.append(kept)
        for candidate in generator.candidates():
            kept.append(candidate)
            yield candidate
            if len(kept) >= MAX_CANDIDATES or self.clock.late:
                generator.complete = False
                return
        self._kept[tolerance] = kept, generator

    def _budget(self, tolerance: float) -> float:
        """Return the greatest Ω (m) at a tolerance: µ for each of the groups."""
        return tolerance * self.direction.canvas * len(self.groups)

    def at(self, stage: Stage) -> Found:
        """Return the best alignment at one tolerance, with or without splits."""
        complete = True
        cleared = 0.0  # no alignment has a smaller Ω
        for share in BUDGETS:
            budget = share * self._budget(stage.tolerance)
            found = self._within(stage, budget)
            complete = complete and found.complete
            cleared = max(cleared, found.bound) if complete else cleared
            self._floors[stage] = float("inf") if complete else cleared
            if found.alignment is not None or self.clock.over():
                return replace(found, complete=complete)
        return Found(None, complete)

    def _within(self, stage: Stage, budget: float) -> Found:
        best: Alignment | None = None
        complete = True
        for candidate in self.candidates(stage.tolerance):
            if self.clock.over():
                return Found(best, False, 0.0)
            limit = budget if best is None else best.omega
            if self._refuted.get((stage, id(candidate)), -1.0) >= limit:
                continue
            if not self._hopeful(candidate, stage, limit):
                self._refuted[stage, id(candidate)] = limit
                continue
            found = self._align(candidate, stage, limit, self.effort, best)
            complete = complete and found.complete
            if found.complete and found.alignment is None:
                self._refuted[stage, id(candidate)] = limit
            if found.alignment is not None and (
                best is None or self._before(found.alignment, best)
            ):
                best = found.alignment
        kept = self._kept.get(stage.tolerance)
        complete = complete and kept is not None and kept[1].complete
        return Found(best, complete, budget if complete and best is None else 0.0)

    def all_at(self, tolerance: float, splits: bool) -> Iterator[Alignment]:
        """Yield the best alignment of every candidate that has one, while there is time."""
        stage = Stage(tolerance, splits)
        for candidate in self.candidates(tolerance):
            if self.clock.over():
                return
            budget = self._budget(tolerance)
            found = self._align(candidate, stage, budget, self.effort)
            if found.alignment is not None:
                yield found.alignment

    def _hopeful(self, candidate: Candidate, stage: Stage, budget: float) -> bool:
        """Tell whether the lower bounds on Ω leave room."""
        most = budget + SLACK * self.direction.canvas
        if size_floor(self.direction, candidate, stage.tolerance) > most:
            return False
        return not self.aligner.pairs.exceed(candidate, stage.tolerance, stage.splits, budget)

    def _align(
        self,
        candidate: Candidate,
        stage: Stage,
        budget: float,
        effort: Effort,
        rival: Alignment | None = None,
    ) -> Found:
        bounds = Generator(self.direction, self.groups, stage.tolerance).bounds(candidate.words)
        task = Task(candidate, tuple(bounds), stage.tolerance, budget, stage.splits, effort, rival)
        return self.aligner.best(task)


def _stage_of(alignment: Alignment) -> Stage:
    return Stage(alignment.tolerance, alignment.pieces > 0)
