"""Random derivations of a split grammar (TSKP10 Fig. 4)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.grammar import Grammar, Node, Rule, Size
from ..errors import Infeasible
from .derivation import nodes
from .expressions import Automaton, automaton, parse
from .extents import needed_sizes
from .rules import check_grammar

TRIES = 24
DRAWS = 60  # of a whole derivation, until all of its sizes lie within their bounds
SLACK = 1.0  # pixels that a size may miss its bounds by
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
    the typical ones and adapted so that they fill the scope. A derivation with a part that misses
    its `min` or `max` by more than SLACK pixels is dropped and drawn again, now with regard to what
    the parts of a part need. Raises Infeasible where the grammar does not end or nothing fits.
    """
    check_grammar(grammar)
    scope = (0.0, 0.0, width, height)
    problem = ""
    for draw in range(DRAWS):
        sampler = _Sampler(grammar, height, rng, strict=draw > 0)
        try:
            tree = sampler.node(grammar.axiom, scope, 0)
        except _Unfit as error:
            problem = str(error)
            continue
        breach = _breach(grammar, tree, height)
        if breach is None:
            return tree
        problem = f"{breach} misses its min or max"
    size = f"{width:g} × {height:g} pixels"
    raise Infeasible(f"no facade of {size} keeps the grammar's sizes: {problem}")


def _breach(grammar: Grammar, tree: Node, unit: float) -> str | None:
    """Return the pointer to the size that a part of a derivation misses, None where none does."""
    for node in nodes(tree):
        if not node.children:
            continue
        axis = 0 if node.split == "right" else 1
        sizes = grammar.rules[node.symbol].sizes
        for part in node.children:
            bound, length = sizes.get(part.symbol), part.scope[axis + 2] - part.scope[axis]
            if bound and not bound.min * unit - SLACK <= length <= bound.max * unit + SLACK:
                return f"/rules/{node.symbol}/sizes/{part.symbol}"
    return None


class _Unfit(Infeasible):
    """A draw that came to a scope which no parts fill; another draw may not."""


class _Sampler:
    """Draws one derivation; a `strict` one fits sizes into their bounds, and into what is below."""

    def __init__(
        self, grammar: Grammar, unit: float, rng: np.random.Generator, *, strict: bool
    ) -> None:
        self.grammar, self.unit, self.rng, self.strict = grammar, unit, rng, strict
        self.sizes = needed_sizes(grammar) if strict else {}
        self.machines = {name: automaton(parse(r.into)) for name, r in grammar.rules.items()}
        self.words: dict[str, Word] = {}
        self.count = 0

    def node(self, symbol: str, scope: tuple[float, ...], depth: int) -> Node:
        """Derive a shape and all below it.

        Raises Infeasible where that does not end.
        """
        self.count += 1
        if depth > MAX_DEPTH or self.count > MAX_NODES:
            raise Infeasible(f"the derivation does not end: {depth} levels down at {symbol!r}")
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
        own = self.sizes.get(symbol, rule.sizes)
        sizes = [own.get(name, Size()) for name in self.machines[symbol].symbols]
        share = length / self.unit
        if alike and leader in self.words:
            word = self.words[leader]
            return _refitted(word, sizes, share, symbol) if self.strict else word
        try:
            word = random_word(
                self.machines[symbol], sizes, share, rng=self.rng, bounded=self.strict
            )
        except Infeasible as error:
            raise _Unfit(f"/rules/{symbol}: {error}") from None
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
    bounded: bool = False,
) -> Word:
    """Return a random word whose natural sizes fill `length` well; sizes are given as shares.

    Of several random words the one whose sizes need the least stretching is taken. `bounded`: only
    words whose bounds allow the length count, and sizes are stretched within their bounds.
    Raises Infeasible where none ends.
    """
    best: Word | None = None
    least = np.inf
    for _ in range(tries):
        states, natural = _walk(machine, sizes, length, rng)
        total = sum(natural)
        if not states or total <= 0:
            continue
        if bounded:
            fitted = _fitted([sizes[state] for state in states], natural, length)
            stretch = abs(np.log(total / length))
            if fitted is not None and stretch < least:
                best, least = Word(tuple(states), fitted), stretch
            continue
        stretch = abs(np.log(total / length)) + _violation(sizes, states, natural, length / total)
        if stretch < least:
            best, least = Word(tuple(states), tuple(n / total for n in natural)), stretch
    if best is None:
        raise Infeasible("no parts fill the scope of a rule")
    return best


def _refitted(word: Word, sizes: list[Size], length: float, symbol: str) -> Word:
    """Return a word that was drawn for another length, its sizes within their bounds again."""
    fitted = _fitted([sizes[s] for s in word.states], [n * length for n in word.sizes], length)
    if fitted is None:
        raise _Unfit(f"/rules/{symbol}: no parts fill the scope of a rule")
    return replace(word, sizes=fitted)


def _fitted(sizes: list[Size], natural: list[float], length: float) -> tuple[float, ...] | None:
    """Return natural sizes stretched alike, clipped to their bounds, as shares that fill `length`.

    None where the bounds do not allow that length.
    """
    least, most = (np.array([getattr(s, end) for s in sizes]) for end in ("min", "max"))
    if not least.sum() <= length <= most.sum():
        return None
    own = np.maximum(natural, 1e-9)
    low, high = 0.0, 1.0
    while np.clip(own * high, least, most).sum() < length and high < 1e12:
        high *= 2
    for _ in range(80):
        middle = (low + high) / 2
        short = np.clip(own * middle, least, most).sum() < length
        low, high = (middle, high) if short else (low, middle)
    shares = np.clip(own * high, least, most)
    return tuple((shares / shares.sum()).tolist())


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
