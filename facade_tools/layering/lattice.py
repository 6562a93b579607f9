"""Word lattices: all words of a pattern that have the same letters, in whatever order.

Alternations under a power make words by the million, but few multisets of letters. Words with the
same multiset have the same size, so eq. 7 (IMAW15 5.1) holds for all of them or for none, and the
alignment's search may choose among them letter by letter.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

from .language import Alternation, Node, Power, Sequence, Substituted, Symbol, symbols_of
from .words import Expansion, Letter, Word, expand, reflected

MAX_NODES = 15_000  # of the lattices of one pattern under one assignment of the counters
MAX_ALIKE = 64  # words that a symbol which stands several times may have
FEW_WORDS = 6  # a pattern with at most so many words is not worth a lattice


class Edge(NamedTuple):
    """A letter between two nodes."""

    start: int
    end: int
    letter: Letter


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """A directed graph whose paths from node 0 to a final node spell the words.

    Every node is reached by prefixes with the same multiset of letters; nodes are numbered by
    the length of their prefixes. `words`: one word of each multiset of letters; `single`: there
    is no other word at all.
    """

    words: tuple[Word, ...]
    size: int
    edges: tuple[Edge, ...]
    finals: frozenset[int]
    single: bool = True

    @property
    def word(self) -> Word:
        """Return one of the words."""
        return self.words[0]


def chain(word: Word) -> Lattice:
    """Return the lattice of a single word."""
    edges = tuple(Edge(i, i + 1, letter) for i, letter in enumerate(word))
    return Lattice((word,), len(word) + 1, edges, frozenset({len(word)}))


def most_words(node: Node, counters: Mapping[str, int]) -> int:
    """Return an upper bound on the number of words, itself at most FEW_WORDS + 1."""
    match node:
        case Symbol():
            count = 1
        case Alternation(options):
            count = sum(most_words(part, counters) for part in options)
        case Sequence(parts):
            count = _product(most_words(part, counters) for part in parts)
        case Power(base, exponent):
            times = min(abs(exponent.value(counters)), FEW_WORDS)
            count = most_words(base, counters) ** times
        case Substituted(control, contents):
            parts = (control, *(part for _, part in contents))
            count = _product(most_words(part, counters) for part in parts)
    return min(count, FEW_WORDS + 1)


def _product(numbers: Iterable[int]) -> int:
    out = 1
    for number in numbers:
        out = min(out * number, FEW_WORDS + 1)
    return out


@dataclass(slots=True, eq=False)
class _State:
    """A node under construction: the letters before it, and the edges that enter it."""

    counts: tuple[int, ...]
    size: float
    entering: list[tuple[_State, Letter]] = field(default_factory=list)
    depth: int = 0
    after: bool = False  # the letter before is attached


Key = tuple[tuple[int, ...], bool]
Front = dict[Key, _State]


class _TooMany(Exception):
    """The lattice would be too large."""


class Family:
    """The words of a pattern: a lattice for each multiset of letters, or one of them all.

    words: one of each multiset. `complete` unless a bound left words out.
    """

    def __init__(self, ends: list[list[_State]], complete: bool) -> None:
        self.complete = complete
        self.words = tuple(_any_word(states[0]) for states in ends)
        self._ends = ends

    @classmethod
    def of_words(cls, words: Iterable[Word], complete: bool) -> Family:
        """Return the family of a few words, each a lattice of its own."""
        family = cls([], complete)
        family.words = tuple(words)
        family.classes = [chain(word) for word in family.words]
        return family

    @property
    def mixed(self) -> bool:
        """Tell whether there is a lattice of all words."""
        return len(self._ends) > 1

    @cached_property
    def classes(self) -> list[Lattice]:
        """The lattices of the multisets of letters."""
        found = [_frozen(states) for states in self._ends]
        return sorted(found, key=lambda one: _names(one.word))

    @cached_property
    def whole(self) -> Lattice:
        """The lattice of all words."""
        states = [state for each in self._ends for state in each]
        return replace(_frozen(states), words=self.words)


def _any_word(state: _State) -> Word:
    letters: list[Letter] = []
    while state.entering:
        state, letter = state.entering[0]
        letters.append(letter)
    return tuple(reversed(letters))


def lattices(node: Node, how: Expansion, attached: frozenset[str]) -> Family | None:
    """Return the lattices of a pattern; None where they would be too large.

    attached: symbols that are.
    """
    builder = _Builder(how, attached, sorted(symbols_of(node)))
    try:
        ends = builder.walk(node, builder.start(), False, False)
    except _TooMany:
        return None
    classes: dict[tuple[int, ...], list[_State]] = {}
    for (counts, _), state in ends.items():
        classes.setdefault(counts, []).append(state)
    return Family(list(classes.values()), builder.complete)


def _names(word: Word) -> tuple[str, ...]:
    return tuple(letter.name for letter in word)


class _Builder:
    def __init__(self, how: Expansion, attached: frozenset[str], symbols: list[str]) -> None:
        self.how, self.attached, self.symbols = how, attached, symbols
        kinds = [(name, clear) for name in symbols for clear in (False, True)]
        self.places = {kind: at for at, kind in enumerate(kinds)}
        self.bound: dict[str, Word | Node | None] = {}
        self.nodes = 0
        self.complete = True

    def start(self) -> Front:
        """Return where every word begins."""
        none = (0,) * len(self.places)
        return {(none, False): _State(none, 0.0)}

    def walk(self, node: Node, front: Front, control: bool, back: bool) -> Front:
        """Return the nodes that a pattern leads to from some nodes; `back`: reflected."""
        match node:
            case Symbol(name):
                return self._symbol(name, front, control, back)
            case Alternation(options):
                return self._joined([self.walk(part, front, control, back) for part in options])
            case Sequence(parts):
                turned = back and self.how.reflection != "mirror"
                for part in reversed(parts) if turned else parts:
                    front = self.walk(part, front, control, back)
                return front
            case Power(base, exponent):
                count = exponent.value(self.how.counters)
                for _ in range(abs(count)):
                    before = front
                    front = self.walk(base, front, control, back != (count < 0))
                    if not front or front == before:
                        break
                return front
            case Substituted():
                return self._substituted(node, front, back)

    def _symbol(self, name: str, front: Front, control: bool, back: bool) -> Front:
        if control and name in self.bound:
            bound = self.bound[name]
            if bound is None:
                return {}
            if isinstance(bound, tuple):
                return self._word(reflected(bound, self.how.reflection) if back else bound, front)
            return self._inner(bound, front, back)
        transparent = control or name in self.how.transparent
        letter = Letter(name, back and self.how.reflection != "reverse", transparent)
        return self._letter(letter, front)

    def _word(self, word: Word, front: Front) -> Front:
        for letter in word:
            front = self._letter(letter, front)
        return front

    def _letter(self, letter: Letter, front: Front) -> Front:
        out: Front = {}
        at = self.places[letter.symbol, letter.transparent]
        more, limit = self.how.sizes[letter.symbol], self.how.limit
        after = letter.symbol in self.attached
        for state in front.values():
            size = state.size + more
            if size > limit:
                continue
            counts = state.counts
            counts = (*counts[:at], counts[at] + 1, *counts[at + 1 :])
            key = counts, after
            found = out.get(key)
            if found is None:
                found = out[key] = self._fresh(_State(counts, size, [], state.depth + 1, after))
            found.entering.append((state, letter))
        return out

    def _fresh(self, state: _State) -> _State:
        self.nodes += 1
        if self.nodes > MAX_NODES or (self.nodes % 128 == 0 and self.how.late()):
            raise _TooMany
        return state

    def _joined(self, fronts: list[Front]) -> Front:
        """Merge nodes that several ways lead to; nodes that others already leave stay as they are.

        A merged node takes over the edges that enter, so that what leaves one way's node is not
        reached by another way.
        """
        out: Front = {}
        for front in fronts:
            for key, state in front.items():
                other = out.get(key)
                if other is None or other is state:
                    out[key] = state
                    continue
                entering = [*other.entering, *state.entering]
                merged = _State(state.counts, state.size, entering, state.depth, state.after)
                out[key] = self._fresh(merged)
        return out

    def _inner(self, node: Node, front: Front, back: bool) -> Front:
        outer, self.bound = self.bound, {}
        out = self.walk(node, front, isinstance(node, Substituted), back)
        self.bound = outer
        return out

    def _substituted(self, node: Substituted, front: Front, back: bool) -> Front:
        """Every instance of a symbol is the same word; one that stands once needs no list.

        A content of which no word fits leaves the control words that do without the symbol.
        """
        choices: list[list[Word | Node | None]] = []
        for name, part in node.contents:
            if _times(node.control, name, self.how.counters) == 1:
                choices.append([part])
                continue
            choices.append([*self._alike(part)] or [None])
        outer = self.bound
        fronts = []
        for picked in product(*choices):
            self.bound = dict(zip((name for name, _ in node.contents), picked, strict=True))
            fronts.append(self.walk(node.control, front, True, back))
        self.bound = outer
        return self._joined(fronts)

    def _alike(self, part: Node) -> list[Word]:
        """Return the words of a pattern; of too many, the first of each multiset of letters."""
        found = expand(part, replace(self.how, most=MAX_ALIKE))
        if found.complete:
            return found.words
        self.complete = False
        inner = _Builder(self.how, self.attached, self.symbols)
        inner.nodes = self.nodes
        ends = inner.walk(part, inner.start(), False, False)
        self.nodes = inner.nodes
        several = map(_any_word, ends.values())
        return list(dict.fromkeys([*several, *found.words[: MAX_ALIKE // 8]]))[:MAX_ALIKE]


def _times(node: Node, name: str, counters: Mapping[str, int]) -> int:
    """Return how often a symbol can stand in a word, at most 2."""
    match node:
        case Symbol(own):
            return int(own == name)
        case Sequence(parts):
            return min(2, sum(_times(part, name, counters) for part in parts))
        case Alternation(options):
            return max(_times(part, name, counters) for part in options)
        case Power(base, exponent):
            return min(2, abs(exponent.value(counters)) * _times(base, name, counters))
        case Substituted():
            return 2


def _frozen(ends: list[_State]) -> Lattice:
    """Return the lattice of what leads to some nodes; nodes with equal futures are merged."""
    layers = _backwards(ends)
    leaving: dict[int, list[tuple[Letter, _State]]] = {}
    for state in layers:
        for before, letter in state.entering:
            leaving.setdefault(id(before), []).append((letter, state))
    merged: dict[int, int] = {}
    known: dict[object, int] = {}
    last = {id(state) for state in ends}
    edges: list[set[tuple[Letter, int]]] = []
    for state in layers:  # the deepest first
        future = frozenset((letter, merged[id(to)]) for letter, to in leaving.get(id(state), []))
        key = future, state.after, state.counts, id(state) in last
        if key not in known:
            known[key] = len(edges)
            edges.append(set(future))
        merged[id(state)] = known[key]
    count = len(edges)
    numbers = {old: count - 1 - old for old in range(count)}
    arcs = sorted(
        (
            Edge(numbers[old], numbers[to], letter)
            for old in range(count)
            for letter, to in edges[old]
        ),
        key=lambda edge: (edge.start, edge.letter.name, edge.end),
    )
    finals = frozenset(numbers[merged[id(state)]] for state in ends)
    single = len(arcs) == count - 1 and len(finals) == 1
    return Lattice((_first_word(arcs),), count, tuple(arcs), finals, single)


def _backwards(ends: list[_State]) -> list[_State]:
    """Return all nodes that lead to the ends, the deepest first."""
    seen = {id(state): state for state in ends}
    stack = list(ends)
    while stack:
        for before, _ in stack.pop().entering:
            if id(before) not in seen:
                seen[id(before)] = before
                stack.append(before)
    return sorted(seen.values(), key=lambda state: -state.depth)


def _first_word(arcs: list[Edge]) -> Word:
    """Return the word that always takes the first letter."""
    first: dict[int, Edge] = {}
    for edge in arcs:
        first.setdefault(edge.start, edge)
    word: list[Letter] = []
    at = 0
    while at in first:
        word.append(first[at].letter)
        at = first[at].end
    return tuple(word)
