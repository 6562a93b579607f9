"""Why a design has no layout: the smallest set of things in conflict that a search finds."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

from .candidates import Generator
from .language import symbols_of
from .problem import TOLERANCES, Direction, LayerPattern
from .search import Clock, GroupSearch
from .words import MAX_LETTERS, MAX_WORDS

QUALIFIERS = ("unoccludable", "attached", "opaque")


def explanation(
    direction: Direction, groups: Sequence[str], seconds: float, *, late: bool, proved: bool
) -> str:
    """Return in the words of the design what rules a layout out, within some seconds."""
    where = f"{direction.axis} ({direction.canvas:g} m)"
    if late:
        return f"{where}: no layout found in the time given; not proved that there is none"
    if not proved:
        return (
            f"{where}: no layout found; not proved that there is none: a pattern has more than "
            f"{MAX_WORDS} words that may fit, or words of more than {MAX_LETTERS} letters"
        )
    alone = (g for g in groups if _hopeless(direction, g, _deadline(seconds / 4)))
    group = groups[0] if len(groups) == 1 else next(alone, None)
    if group is None:
        names = " and ".join(groups)
        return f"{where}: groups {names} share counters or sizes that do not fit them all"
    return f"{where}: {_worded(direction, conflict_of(direction, group, seconds))}"


def conflict_of(direction: Direction, group: str, seconds: float) -> Conflict:
    """Return what rules out every layout of a group; nothing of it can be left out.

    What the seconds do not suffice for is kept in it.
    """
    return _Shrinker(direction, group, _deadline(seconds)).run()


def _deadline(seconds: float) -> float:
    return time.monotonic() + seconds


def _hopeless(direction: Direction, group: str, until: float) -> bool:
    clock = Clock(until)
    search = GroupSearch(direction, (group,), clock)
    return search.answer() is None and search.exhausted


@dataclass(frozen=True, slots=True)
class Conflict:
    """Layers that have no layout together, and the qualifiers (symbol, name) that matter."""

    rows: tuple[LayerPattern, ...]
    qualifiers: tuple[tuple[str, str], ...]


class _Shrinker:
    """Leaves out layers and qualifiers, as long as what is left still has no layout.

    A layer less can be a layout less, too: it may have covered what the others do not. So the
    attempts are gone through again until none of them succeeds.
    """

    def __init__(self, direction: Direction, group: str, until: float) -> None:
        self.direction, self.group, self.until = direction, group, until

    def run(self) -> Conflict:
        direction = self.direction
        smaller: Direction | None = direction
        while smaller is not None:
            direction = smaller
            tries = chain(self._fewer(direction), self._freer(direction))
            smaller = next((one for one in tries if self._still(one)), None)
        rows = direction.groups[self.group]
        return Conflict(rows, tuple(_qualifiers(direction, rows)))

    def _still(self, direction: Direction) -> bool:
        """Tell whether something is known to have no layout."""
        late = time.monotonic() > self.until
        return not late and _hopeless(direction, self.group, self.until)

    def _fewer(self, direction: Direction) -> Iterator[Direction]:
        """Yield the problem without one of its layers."""
        rows = direction.groups[self.group]
        for row in rows if len(rows) > 1 else ():
            fewer = tuple(other for other in rows if other is not row)
            yield replace(direction, groups={self.group: fewer})

    def _freer(self, direction: Direction) -> Iterator[Direction]:
        """Yield the problem without one of its qualifiers."""
        for symbol, name in _qualifiers(direction, direction.groups[self.group]):
            free = replace(direction.rules[symbol], **{name: name == "opaque"})
            yield replace(direction, rules={**direction.rules, symbol: free})


def _qualifiers(direction: Direction, rows: Sequence[LayerPattern]) -> Iterator[tuple[str, str]]:
    """Yield (symbol, name) of the qualifiers of some layers' symbols."""
    for symbol in sorted(set[str]().union(*(symbols_of(row.node) for row in rows))):
        for name in QUALIFIERS:
            if getattr(direction.rules[symbol], name) != (name == "opaque"):
                yield symbol, name


def _worded(direction: Direction, conflict: Conflict) -> str:
    single = direction.groups and len(conflict.rows) == 1
    if single:
        return _alone(direction, conflict)
    layers = ", ".join(f"layer {row.layer!r} (pattern {row.pattern!r})" for row in conflict.rows)
    marks = "".join(f", {_mark(mark)}" for mark in conflict.qualifiers)
    most = f"{TOLERANCES[-1]:.0%}"
    return f"no layout within {most} of the canvas: in conflict are {layers}{marks}"


def _mark(mark: tuple[str, str]) -> str:
    symbol, name = mark
    return f"symbol {symbol!r} {'not opaque' if name == 'opaque' else name}"


def _alone(direction: Direction, conflict: Conflict) -> str:
    """Explain a single layer: its words are too long or too short, or do not cover the canvas."""
    (row,) = conflict.rows
    who = f"layer {row.layer!r} (pattern {row.pattern!r})"
    alone = replace(direction, groups={"": (row,)})
    first = next(Generator(alone, ("",), TOLERANCES[-1]).candidates(), None)
    if first is None:
        most = TOLERANCES[-1] * direction.canvas
        span = f"{direction.canvas - most:g} to {direction.canvas + most:g} m"
        return f"{who} has no word that is {span} long"
    marks = "".join(f", {_mark(mark)}" for mark in conflict.qualifiers)
    clear = sorted({a.symbol for word in first.words for a in word if a.transparent})
    marks += "".join(f", symbol {name!r} transparent" for name in clear)
    return f"{who} leaves holes: a column without an opaque symbol{marks}"
