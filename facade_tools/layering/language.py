"""The pattern language: text to a syntax tree, errors with line, column and caret.

Grammar (blanks and `·` between parts mean nothing):

    alternation = sequence, {"|", sequence}
    sequence    = power, {power}
    power       = atom, ["^", exponent]
    atom        = symbol | "(", alternation, ")"
    symbol      = letter, {digit} | "{", any name, "}"
    exponent    = ["-"], (integer | symbol) | "(", sum, ")"
    sum         = ["-"], term, {("+" | "-"), term}
    term        = integer, [["*"], symbol] | symbol
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..errors import InvalidInput

MAX_TEXT = 4096  # characters of one pattern
MAX_DEPTH = 60  # nested parentheses
MAX_INTEGER = 100_000


class PatternError(InvalidInput):
    """A pattern that breaks the grammar; `line` and `column` count from 1."""

    def __init__(self, text: str, offset: int, problem: str, *, pointer: str = "") -> None:
        self.text, self.offset, self.problem = text, offset, problem
        before = text[:offset]
        self.line = before.count("\n") + 1
        self.column = offset - (before.rfind("\n") + 1) + 1
        row = text.split("\n")[self.line - 1]
        at = self.column - 1
        shown = f"{row[max(0, at - 30) : at]}‸{row[at : at + 30]}"
        super().__init__(
            f"pattern, line {self.line}, column {self.column}: {problem}: {shown}", pointer=pointer
        )

    def picture(self) -> str:
        """Return the offending line with a caret under the place."""
        return f"{self.text.split(chr(10))[self.line - 1]}\n{' ' * (self.column - 1)}^"

    def __reduce__(self) -> tuple[type[InvalidInput], tuple[str, object]]:  # type: ignore[override]
        return InvalidInput, (self.message, self.place)


@dataclass(frozen=True, slots=True)
class Exponent:
    """A linear expression in counters: `constant` + Σ coefficient · counter."""

    constant: int
    terms: tuple[tuple[str, int], ...] = ()

    def value(self, counters: Mapping[str, int]) -> int:
        """Return the number that the exponent stands for."""
        return self.constant + sum(factor * counters[name] for name, factor in self.terms)


@dataclass(frozen=True, slots=True)
class Symbol:
    """One symbol; `offset` is where it stands in the text."""

    name: str
    offset: int = 0


@dataclass(frozen=True, slots=True)
class Sequence:
    """Parts one after another; no part is the empty word."""

    parts: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class Alternation:
    """One of several."""

    options: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class Power:
    """Repetition; a negative exponent repeats the reflection of the base."""

    base: Node
    exponent: Exponent


@dataclass(frozen=True, slots=True)
class Substituted:
    """A control pattern, some of whose symbols stand for one word of a content pattern each."""

    control: Node
    contents: tuple[tuple[str, Node], ...]


Node = Symbol | Sequence | Alternation | Power | Substituted


class _Token(NamedTuple):
    kind: str  # symbol, integer, end, or the character itself
    value: str
    offset: int


def parse(text: str) -> Node:
    """Return the syntax tree of a pattern. Raises PatternError with the place of the first error.

    >>> parse("A(BA)^k").parts[1].exponent
    Exponent(constant=0, terms=(('k', 1),))
    """
    if len(text) > MAX_TEXT:
        raise PatternError(text, MAX_TEXT, f"longer than {MAX_TEXT} characters")
    return _Parser(text).pattern()


def symbol_pair(text: str) -> tuple[str, str]:
    """Return the two symbols of a shape's name such as `CP` or `C*`; `*` stands for any."""
    tokens = _tokens(text, extra="*")
    names = [t.value for t in tokens[:-1] if t.kind in ("symbol", "*")]
    if len(names) != 2 or len(tokens) != 3:
        raise PatternError(text, 0, "expected two symbols, of x and of y, or * for any")
    return names[0], names[1]


def _tokens(text: str, extra: str = "") -> list[_Token]:
    out: list[_Token] = []
    at = 0
    while at < len(text):
        char = text[at]
        if char.isspace() or char == "·":
            at += 1
            continue
        token = _token(text, at, extra)
        out.append(token)
        at = token.offset + _length(text, token)
    out.append(_Token("end", "", len(text)))
    return out


def _length(text: str, token: _Token) -> int:
    return len(token.value) + (2 if text[token.offset] == "{" else 0)


def _token(text: str, at: int, extra: str) -> _Token:
    char = text[at]
    if char == "{":
        return _braced(text, at)
    if char.isalpha():
        end = at + 1
        while end < len(text) and text[end] in "0123456789":
            end += 1
        return _Token("symbol", text[at:end], at)
    if char in "0123456789":
        end = at
        while end < len(text) and text[end] in "0123456789":
            end += 1
        return _Token("integer", text[at:end], at)
    if char in "|()^*+-" + extra:
        return _Token(char, char, at)
    if char == "−":
        return _Token("-", char, at)
    raise PatternError(text, at, f"unexpected {char!r}")


def _braced(text: str, at: int) -> _Token:
    end = text.find("}", at)
    if end < 0:
        raise PatternError(text, at, "this brace is never closed")
    name = text[at + 1 : end]
    if not name.strip() or name != name.strip() or "~" in name or "{" in name or "\n" in name:
        raise PatternError(text, at, "expected a name without ~, { or outer blanks in braces")
    return _Token("symbol", name, at)


class _Parser:
    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = _tokens(text)
        self.index = 0
        self.depth = 0

    @property
    def now(self) -> _Token:
        return self.tokens[self.index]

    def take(self) -> _Token:
        token = self.now
        self.index += 1
        return token

    def fail(self, expected: str) -> PatternError:
        token = self.now
        found = "the end" if token.kind == "end" else repr(self.text[token.offset])
        return PatternError(self.text, token.offset, f"expected {expected}, found {found}")

    def pattern(self) -> Node:
        node = self.alternation()
        if self.now.kind != "end":
            raise self.fail("a symbol, | or ^")
        return node

    def alternation(self) -> Node:
        options = [self.sequence()]
        while self.now.kind == "|":
            self.take()
            options.append(self.sequence())
        return options[0] if len(options) == 1 else Alternation(tuple(options))

    def sequence(self) -> Node:
        parts = [self.power()]
        while self.now.kind in ("symbol", "("):
            parts.append(self.power())
        return parts[0] if len(parts) == 1 else Sequence(tuple(parts))

    def power(self) -> Node:
        node = self.atom()
        while self.now.kind == "^":
            self.take()
            node = Power(node, self.exponent())
        return node

    def atom(self) -> Node:
        if self.now.kind == "symbol":
            token = self.take()
            return Symbol(token.value, token.offset)
        if self.now.kind != "(":
            raise self.fail("a symbol or (")
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise PatternError(self.text, self.now.offset, f"nested deeper than {MAX_DEPTH}")
        self.take()
        node = self.alternation()
        if self.now.kind != ")":
            raise self.fail("a symbol, | or )")
        self.take()
        self.depth -= 1
        return node

    def exponent(self) -> Exponent:
        sign = 1
        if self.now.kind == "-":
            self.take()
            sign = -1
        if self.now.kind == "integer":
            return Exponent(sign * self.integer())
        if self.now.kind == "symbol":
            return Exponent(0, ((self.take().value, sign),))
        if self.now.kind != "(":
            raise self.fail("a number, a counter or (")
        self.take()
        inner = self.sum()
        if self.now.kind != ")":
            raise self.fail("+, - or )")
        self.take()
        return Exponent(sign * inner.constant, tuple((n, sign * f) for n, f in inner.terms))

    def integer(self) -> int:
        token = self.take()
        if len(token.value) > 6 or int(token.value) > MAX_INTEGER:
            raise PatternError(self.text, token.offset, f"expected at most {MAX_INTEGER}")
        return int(token.value)

    def sum(self) -> Exponent:
        constant, terms = 0, dict[str, int]()
        sign = 1
        if self.now.kind == "-":
            self.take()
            sign = -1
        while True:
            number, name = self.term()
            if name:
                terms[name] = terms.get(name, 0) + sign * number
            else:
                constant += sign * number
            if self.now.kind not in ("+", "-"):
                return Exponent(constant, tuple(sorted(terms.items())))
            sign = 1 if self.take().kind == "+" else -1

    def term(self) -> tuple[int, str]:
        if self.now.kind == "symbol":
            return 1, self.take().value
        if self.now.kind != "integer":
            raise self.fail("a number or a counter")
        number = self.integer()
        if self.now.kind == "*":
            self.take()
            if self.now.kind != "symbol":
                raise self.fail("a counter")
        return (number, self.take().value) if self.now.kind == "symbol" else (number, "")


def counters_of(node: Node) -> set[str]:
    """Return the counters that a pattern uses."""
    match node:
        case Symbol():
            return set()
        case Power(base, exponent):
            return counters_of(base) | {name for name, _ in exponent.terms}
        case Substituted(control, contents):
            return counters_of(control).union(*(counters_of(part) for _, part in contents))
        case Sequence(parts) | Alternation(parts):
            return set[str]().union(*map(counters_of, parts))


def powers_of(node: Node) -> Iterator[Power]:
    """Yield the powers of a pattern, nested ones included."""
    match node:
        case Power(base, _):
            yield node
            yield from powers_of(base)
        case Substituted(control, contents):
            yield from powers_of(control)
            for _, part in contents:
                yield from powers_of(part)
        case Sequence(parts) | Alternation(parts):
            for part in parts:
                yield from powers_of(part)


def symbols_of(node: Node) -> set[str]:
    """Return the symbols whose letters a pattern can produce."""
    match node:
        case Symbol(name):
            return {name}
        case Power(base, _):
            return symbols_of(base)
        case Substituted(control, contents):
            kept = symbols_of(control) - {name for name, _ in contents}
            return kept.union(*(symbols_of(part) for _, part in contents))
        case Sequence(parts) | Alternation(parts):
            return set[str]().union(*map(symbols_of, parts))
