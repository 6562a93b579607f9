"""What a shape of a split grammar needs: bounds of its size that follow from those of its parts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import reduce
from operator import add

from ..artifacts.grammar import Grammar, Size, SplitAxis
from .expressions import Automaton, automaton, parse

Extent = tuple[float, float]  # least and most, as shares of the axiom's height

FREE: Extent = (0.0, float("inf"))


def needed_sizes(grammar: Grammar) -> dict[str, dict[str, Size]]:
    """Return the sizes of each rule's parts, bounds narrowed to what the parts' own parts allow.

    The bounds are necessary, not sufficient. Where they contradict the rule's own, those stay.
    """
    extents = _Extents(grammar)
    return {name: dict(extents.narrowed(name)) for name in grammar.rules}


class _Extents:
    def __init__(self, grammar: Grammar) -> None:
        self.grammar = grammar
        self.machines = {name: automaton(parse(r.into)) for name, r in grammar.rules.items()}
        self.known: dict[tuple[str, SplitAxis], Extent] = {}

    def narrowed(self, symbol: str) -> Iterator[tuple[str, Size]]:
        """Yield the parts of a rule and their sizes."""
        rule = self.grammar.rules[symbol]
        for part in dict.fromkeys(self.machines[symbol].symbols):
            own = rule.sizes.get(part, Size())
            least, most = self.of(part, rule.split)
            low, high = max(own.min, least), min(own.max, most)
            yield part, replace(own, min=low, max=high) if low <= high else own

    def of(self, symbol: str, axis: SplitAxis) -> Extent:
        """Return the least and the most that a symbol may have along an axis, for any word."""
        key = symbol, axis
        if key not in self.known and symbol in self.grammar.rules:
            self.known[key] = FREE  # of a symbol within itself
            self.known[key] = self._of_rule(symbol, axis)
        return self.known.get(key, FREE)

    def _of_rule(self, symbol: str, axis: SplitAxis) -> Extent:
        rule, machine = self.grammar.rules[symbol], self.machines[symbol]
        lows, highs = [], []
        for name in machine.symbols:
            least, most = self.of(name, axis)
            own = rule.sizes.get(name, Size()) if rule.split == axis else Size(0.0, most)
            lows.append(max(least, own.min))
            highs.append(min(most, own.max))
        if rule.split == axis:
            return _best(machine, lows, add, min), _best(machine, highs, add, max)
        return _best(machine, lows, max, min), _best(machine, highs, min, max)


def _best(
    machine: Automaton,
    values: list[float],
    joined: Callable[[float, float], float],
    better: Callable[[float, float], float],
) -> float:
    """Return the best over all words of the joined values of a word's states.

    What still grows after as many steps as there are states grows without end.
    """
    found: Mapping[int, float] = {state: values[state] for state in machine.first}
    for _ in range(len(values) + 1):
        after = dict(found)
        for state, value in found.items():
            for following in machine.follow[state]:
                longer = joined(value, values[following])
                after[following] = better(after.get(following, longer), longer)
        if after == found:
            break
        found = after
    else:
        return float("inf")
    return reduce(better, (found[state] for state in machine.last if state in found))
