"""Why a design has no layout: the smallest set of things in conflict that a search finds."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from .candidates import Generator
from .language import symbols_of
from .problem import TOLERANCES, Direction, LayerPattern
from .search import Clock, GroupSearch
from .words import MAX_LETTERS, MAX_WORDS

QUALIFIERS = ("unoccludable", "attached", "opaque")
NEAREST = 3


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
    group = next((g for g in groups if _hopeless(direction, g, _deadline(seconds / 4))), None)
    if group is None:
        names = " and ".join(groups)
        return f"{where}: groups {names} share counters or sizes that do not fit them all"
    conflict = _Shrinker(direction, group, _deadline(seconds)).run()
    return f"{where}: {_worded(direction, conflict)}"


def _deadline(seconds: float) -> float:
    return time.monotonic() + seconds


def _hopeless(direction: Direction, group: str, until: float) -> bool:
    clock = Clock(until)
    search = GroupSearch(direction, (group,), clock)
    return search.answer() is None and search.exhausted


@dataclass(frozen=True, slots=True)
class _Conflict:
    """Layers that have no layout together, and the qualifiers (symbol, name) that matter."""

    rows: tuple[LayerPattern, ...]
    qualifiers: tuple[tuple[str, str], ...]


class _Shrinker:
    """Leaves out layers, then qualifiers, as long as what is left still has no layout."""

    def __init__(self, direction: Direction, group: str, until: float) -> None:
        self.direction, self.group, self.until = direction, group, until

    def run(self) -> _Conflict:
        rows = self._layers(self.direction.groups[self.group])
        return _Conflict(rows, tuple(self._qualifiers(rows)))

    def _still(self, direction: Direction, rows: Sequence[LayerPattern]) -> bool:
        """Tell whether these layers are known to have no layout."""
        if time.monotonic() > self.until:
            return False
        return _hopeless(
            replace(direction, groups={self.group: tuple(rows)}), self.group, self.until
        )

    def _layers(self, rows: tuple[LayerPattern, ...]) -> tuple[LayerPattern, ...]:
        for row in rows:
            fewer = tuple(other for other in rows if other is not row)
            if fewer and self._still(self.direction, fewer):
                rows = fewer
        return rows

    def _qualifiers(self, rows: Sequence[LayerPattern]) -> Iterable[tuple[str, str]]:
        used = sorted(set[str]().union(*(symbols_of(row.node) for row in rows)))
        direction = self.direction
        for symbol in used:
            for name in QUALIFIERS:
                rule = direction.rules[symbol]
                plain = name == "opaque"
                if getattr(rule, name) == plain:
                    continue
                free = replace(rule, **{name: plain})
                without = replace(direction, rules={**direction.rules, symbol: free})
                if self._still(without, rows):
                    direction = without
                else:
                    yield symbol, name


def _worded(direction: Direction, conflict: _Conflict) -> str:
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


def _alone(direction: Direction, conflict: _Conflict) -> str:
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
