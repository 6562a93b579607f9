"""Random derivations of a split grammar (TSKP10 Fig. 4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..artifacts.grammar import Grammar, Node, Rule, Size
from ..errors import Infeasible
from .expressions import Automaton, automaton, parse
from .rules import check_grammar

TRIES = 24
MAX_PARTS = 400
MAX_DEPTH = 40
MAX_NODES = 200_000


@dataclass(frozen=True, slots=True)
class Word:
    """Parts of a split: states of the rule's automaton and their sizes, which fill the scope."""

    states: tuple[int, ...]
    sizes: tuple[float, ...]


def sample_derivation(
    grammar: Grammar, width: float, height: float, *, rng: np.random.Generator
) -> Node:
    """Return a random derivation of the axiom on a canvas; scopes are (x0, y0, x1, y1), y up.

    Shapes of one symbol that are derived `alike` share their parameters; sizes are drawn around
    the typical ones and adapted so that they fill the scope (any set is a valid split).
    Raises Infeasible where the grammar cannot end or no parts fit.
    """
    check_grammar(grammar)
    return _Sampler(grammar, height, rng).node(grammar.axiom, (0.0, 0.0, width, height), 0)


class _Sampler:
    def __init__(self, grammar: Grammar, unit: float, rng: np.random.Generator) -> None:
        self.grammar, self.unit, self.rng = grammar, unit, rng
        self.machines = {name: automaton(parse(r.into)) for name, r in grammar.rules.items()}
        self.words: dict[str, Word] = {}
        self.count = 0

    def node(self, symbol: str, scope: tuple[float, ...], depth: int) -> Node:
        """Derive a shape and all below it."""
        self.count += 1
        if depth > MAX_DEPTH or self.count > MAX_NODES:
            raise Infeasible(f"the derivation does not end ({symbol})")
        rule = self.grammar.rules.get(symbol)
        if rule is None:
            return Node(symbol, scope, label=self.grammar.terminals[symbol])
        axis = 0 if rule.split == "right" else 1
        low, high = scope[axis], scope[axis + 2]
        word = self._word(symbol, rule, high - low)
        ends = low + np.concatenate([[0.0], np.cumsum(word.sizes)]) * (high - low)
        names = self.machines[symbol].symbols
        children = []
        for state, a, b in zip(word.states, ends, ends[1:], strict=False):
            box = list(scope)
            box[axis], box[axis + 2] = float(a), float(b)
            children.append(self.node(names[state], tuple(box), depth + 1))
        return Node(symbol, scope, rule.split, None, tuple(children))

    def _word(self, symbol: str, rule: Rule, length: float) -> Word:
        """Return a rule's parts, sizes as shares of the scope; drawn once for shapes alike."""
        leader = rule.like or symbol
        alike = self.grammar.rules[leader].derive == "alike"
        if alike and leader in self.words:
            return self.words[leader]
        sizes = [rule.sizes.get(name, Size()) for name in self.machines[symbol].symbols]
        word = random_word(self.machines[symbol], sizes, length / self.unit, rng=self.rng)
        if alike:
            self.words[leader] = word
        return word


def random_word(
    machine: Automaton,
    sizes: list[Size],
    length: float,
    *,
    rng: np.random.Generator,
    tries: int = TRIES,
) -> Word:
    """Return a random word whose natural sizes fill `length` well; sizes are given as shares.

    Of several random words the one whose sizes need the least stretching is taken.
    Raises Infeasible where none ends.
    """
    best: Word | None = None
    least = np.inf
    for _ in range(tries):
        states, natural = _walk(machine, sizes, length, rng)
        total = sum(natural)
        if not states or total <= 0:
            continue
        stretch = abs(np.log(total / length)) + _violation(sizes, states, natural, length / total)
        if stretch < least:
            best, least = Word(tuple(states), tuple(n / total for n in natural)), stretch
    if best is None:
        raise Infeasible("no parts fill the scope of a rule")
    return best


def _violation(sizes: list[Size], states: list[int], natural: list[float], scale: float) -> float:
    """Return how far the stretched sizes lie outside their bounds, in shares of the bounds."""
    total = 0.0
    for state, size in zip(states, natural, strict=True):
        bound = sizes[state]
        total += max(0.0, bound.min - size * scale) / max(bound.min, 1e-6)
        total += max(0.0, size * scale - bound.max) / bound.max
    return total


def _walk(
    machine: Automaton, sizes: list[Size], length: float, rng: np.random.Generator
) -> tuple[list[int], list[float]]:
    """Go through the automaton at random until the scope is full and a word may end."""
    states: list[int] = []
    natural: list[float] = []
    total = 0.0
    choices = sorted(machine.first)
    while choices and len(states) < MAX_PARTS:
        state = int(choices[rng.integers(len(choices))])
        size = _draw(sizes[state], rng)
        full = states and states[-1] in machine.last
        if full and total + size / 2 > length:
            break
        states.append(state)
        natural.append(size)
        total += size
        choices = sorted(machine.follow[state])
        if state in machine.last and total >= length:
            break
    ended = bool(states) and states[-1] in machine.last
    return (states, natural) if ended else ([], [])


def _draw(size: Size, rng: np.random.Generator) -> float:
    """Return a natural size: normal around the typical one, within the bounds."""
    typical = size.typical if size.typical is not None else min(max(size.min, 0.05), size.max)
    spread = size.spread if size.spread is not None else typical / 5
    drawn = rng.normal(typical, spread)
    return float(np.clip(drawn, max(size.min, typical / 10), size.max))
