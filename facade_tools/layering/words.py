"""Words of a pattern: bounded expansion under given counters (IMAW15 3.2, 3.3)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Literal, NamedTuple

from .language import Alternation, Exponent, Node, Power, Sequence, Substituted, Symbol

Reflection = Literal["reverse", "mirror", "reverse-mirror"]
MAX_WORDS = 4096  # of one pattern under one assignment of the counters
MAX_LETTERS = 2000  # of one word
MAX_TRIED = 4_000_000  # words put together from two lists


class Letter(NamedTuple):
    """An instance of a symbol in a word."""

    symbol: str
    mirrored: bool = False
    transparent: bool = False

    @property
    def name(self) -> str:
        """Return the symbol's name, prefixed with `~` where the letter is mirrored."""
        return f"~{self.symbol}" if self.mirrored else self.symbol


Word = tuple[Letter, ...]


@dataclass(frozen=True, slots=True)
class Expansion:
    """How far to expand: words whose least size is at most `limit` (m).

    sizes: least size of every symbol (m, > 0). `transparent`: symbols that are always so.
    most: words of one pattern. `late` tells when to stop, which leaves the rest out.
    """

    counters: Mapping[str, int]
    sizes: Mapping[str, float]
    limit: float
    reflection: Reflection = "reverse-mirror"
    transparent: frozenset[str] = frozenset()
    most: int = MAX_WORDS
    late: Callable[[], bool] = lambda: False


class WordList(NamedTuple):
    """Words in order of the text's alternatives; `complete` unless some were left out."""

    words: list[Word]
    complete: bool


def reflected(word: Word, mode: Reflection) -> Word:
    """Return the reflection of a word.

    `reverse` turns the order of the letters round, `mirror` each letter where it stands,
    `reverse-mirror` does both, as a mirror would.
    """
    letters = word if mode == "reverse" else tuple(_mirrored(letter) for letter in word)
    return letters if mode == "mirror" else letters[::-1]


def _mirrored(letter: Letter) -> Letter:
    return letter._replace(mirrored=not letter.mirrored)


def expand(node: Node, how: Expansion) -> WordList:
    """Return the words of a pattern that may fit, each once (IMAW15 3.2).

    At most MAX_WORDS words of MAX_LETTERS letters, so that no pattern fills the memory.
    """
    return _Expander(how).words(node, False)


class _Expander:
    def __init__(self, how: Expansion) -> None:
        self.how = how
        self.complete = True
        self.bound: dict[str, Word | None] = {}

    def words(self, node: Node, control: bool) -> WordList:
        found = self._node(node, control)
        return WordList(found, self.complete)

    def size(self, word: Word) -> float:
        return sum(self.how.sizes[letter.symbol] for letter in word)

    def _node(self, node: Node, control: bool) -> list[Word]:
        match node:
            case Symbol(name):
                return self._symbol(name, control)
            case Alternation(options):
                return self._unique([w for part in options for w in self._node(part, control)])
            case Sequence(parts):
                return self._sequence(parts, control)
            case Power(base, exponent):
                return self._power(base, exponent, control)
            case Substituted(inner, contents):
                return self._substituted(inner, contents)

    def _symbol(self, name: str, control: bool) -> list[Word]:
        if control and name in self.bound:
            bound = self.bound[name]
            return [] if bound is None else [bound]
        transparent = control or name in self.how.transparent
        word = (Letter(name, False, transparent),)
        return [word] if self.size(word) <= self.how.limit else []

    def _unique(self, words: list[Word]) -> list[Word]:
        kept = list(dict.fromkeys(words))
        if len(kept) > self.how.most:
            self.complete = False
        return kept[: self.how.most]

    def _sequence(self, parts: tuple[Node, ...], control: bool) -> list[Word]:
        words: list[Word] = [()]
        for part in parts:
            words = self._joined(words, self._node(part, control))
        return words

    def _joined(self, heads: list[Word], tails: list[Word]) -> list[Word]:
        out: dict[Word, None] = {}
        known = [(tail, self.size(tail)) for tail in tails]
        least = min((size for _, size in known), default=0.0)
        tried = 0
        for head in heads:
            room = self.how.limit - self.size(head)
            if least > room:
                continue
            for tail, size in known:
                if size <= room and self._short(head, tail):
                    out[head + tail] = None
            tried += len(known)
            if len(out) > self.how.most or tried > MAX_TRIED or self.how.late():
                self.complete = False
                break
        return list(out)[: self.how.most]

    def _short(self, head: Word, tail: Word) -> bool:
        short = len(head) + len(tail) <= MAX_LETTERS
        self.complete = self.complete and short
        return short

    def _power(self, base: Node, exponent: Exponent, control: bool) -> list[Word]:
        count = exponent.value(self.how.counters)
        if count == 0:
            return [()]
        words = self._node(base, control)
        if count < 0:
            words = [reflected(word, self.how.reflection) for word in words]
        out: list[Word] = [()]
        for digit in f"{abs(count):b}":  # by squaring: a long word is not built letter by letter
            out = self._joined(out, out)
            if digit == "1":
                out = self._joined(out, words)
            if not out:
                break
        return out

    def _substituted(self, inner: Node, contents: tuple[tuple[str, Node], ...]) -> list[Word]:
        """Every instance of a substituted symbol is the same word of its content pattern.

        A content of which no word fits leaves the control words that do without the symbol.
        """
        outer = self.bound
        choices: list[Iterable[Word | None]] = [
            self._node(part, isinstance(part, Substituted)) or [None] for _, part in contents
        ]
        out: dict[Word, None] = {}
        for picked in product(*choices):
            self.bound = dict(zip((name for name, _ in contents), picked, strict=True))
            out.update(dict.fromkeys(self._node(inner, True)))
            if len(out) > self.how.most or self.how.late():
                self.complete = False
                break
        self.bound = outer
        return list(out)[: self.how.most]


def least_size(node: Node, how: Expansion, ranges: Mapping[str, tuple[int, int]]) -> float:
    """Return a lower bound on the size (m) of any word, counters anywhere in their `ranges`."""
    match node:
        case Symbol(name):
            return how.sizes[name]
        case Sequence(parts):
            return sum(least_size(part, how, ranges) for part in parts)
        case Alternation(options):
            return min(least_size(part, how, ranges) for part in options)
        case Power(base, exponent):
            return _least_count(exponent, ranges) * least_size(base, how, ranges)
        case Substituted(control, contents):
            sizes = dict(how.sizes)
            sizes.update({name: least_size(part, how, ranges) for name, part in contents})
            inner = Expansion(how.counters, sizes, how.limit)
            return least_size(control, inner, ranges)


def _least_count(exponent: Exponent, ranges: Mapping[str, tuple[int, int]]) -> int:
    low = high = exponent.constant
    for name, factor in exponent.terms:
        ends = sorted(factor * end for end in ranges[name])
        low, high = low + ends[0], high + ends[1]
    return 0 if low <= 0 <= high else min(abs(low), abs(high))
