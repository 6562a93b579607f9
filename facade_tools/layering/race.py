"""A walk over alignments beside the label search: whichever has the proof first is believed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from .evaluation import evaluate, least_error
from .paths import Path, joined_borders
from .problem import SLACK, Alignment, Direction
from .sizing import conflict
from .tasks import Found, Task, full_key
from .walk import Walk

PATIENCE = 24  # paths that the label search may rule out on its own
FIRST_STEPS = 2_000
SLICE = 0.05  # seconds, about


class Race:
    """Gives a walk as much time as the label search has had."""

    def __init__(
        self,
        direction: Direction,
        task: Task,
        start: Callable[[], Walk | None],
        late: Callable[[float], bool],
        now: Callable[[], float],
    ) -> None:
        """Race; `start` makes the walk, None where the candidate is not small."""
        self.direction, self.task, self.late, self.now = direction, task, late, now
        self._start = start
        self._walk: Walk | None = None
        self._turns = 0
        self._began = now()
        self._spent = 0.0  # by the walk
        self._steps = FIRST_STEPS

    def turn(self, known: Alignment | None, *, alone: bool = False) -> Found | None:
        """Walk on for a while; return the answer when it is proved.

        known: the best alignment of the label search. alone: walk until the time is up.
        """
        self._turns += 1
        if self._turns < PATIENCE and not alone:
            return None
        if self._turns == PATIENCE or (alone and self._walk is None):
            self._walk = self._start()
        walk = self._walk
        if walk is None:
            return None
        if known is not None:
            walk.know(known)
        while not walk.done and not self.late(0.0):
            if not alone and 2.0 * self._spent > self.now() - self._began:
                return None
            self._go(walk)
        return self._found(known) if walk.whole else None

    def _go(self, walk: Walk) -> None:
        begun = self.now()
        walk.go(self._steps)
        seconds = self.now() - begun
        self._spent += seconds
        self._steps = max(500, int(self._steps * min(2.0, SLICE / max(seconds, 1e-9))))

    def _found(self, known: Alignment | None) -> Found | None:
        """Return the best of all; None where sizes are too near to what is just possible."""
        every = self.leaves()
        if None in every:
            self._walk = None
            return None
        best = self._best([one for one in every if one is not None], known)
        return Found(best, True, self.task.budget if best is None else best.omega)

    def best(self, known: Alignment | None) -> Alignment | None:
        """Return the best that is known so far."""
        return self._best([one for one in self.leaves() if one is not None], known)

    def _best(self, found: list[Alignment], known: Alignment | None) -> Alignment | None:
        every = [*found, *([] if known is None else [known])]
        canvas = self.direction.canvas
        return min(every, key=lambda one: full_key(one, canvas), default=None)

    def leaves(self) -> list[Alignment | None]:
        """Return what the walk has found, None for what proves to be impossible."""
        return [] if self._walk is None else [self._exact(path) for path in self._walk.paths()]

    def _exact(self, path: Path) -> Alignment | None:
        task, direction = self.task, self.direction
        candidate = replace(task.candidate, words=path.words)
        borders = joined_borders([path.borders])
        box = {name: (low, high) for name, low, high in candidate.unsized}
        rough = evaluate(direction, candidate, borders, task.tolerance, box)
        one = least_error(direction, rough, task.bounds, task.tolerance, box)
        if one is None or one.omega > task.budget + 2 * SLACK * direction.canvas:
            return None
        return None if conflict(direction, [one]) is not None else one
