"""The right-hand sides of split rules: regular expressions over symbols, and their automata.

`Ba? FL Wa` is a sequence, `(FL Wa)+` repeats, `|` chooses; `?`, `*`, `+` as usual.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from ..errors import InvalidInput

TOKEN = re.compile(r"\s*([A-Za-z][A-Za-z0-9_-]*|[()|?*+])")
MAX_LENGTH = 1000


@dataclass(frozen=True, slots=True)
class Symbol:
    """One symbol of the expression."""

    name: str


@dataclass(frozen=True, slots=True)
class Sequence:
    """Parts one after the other."""

    parts: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Choice:
    """One of several parts."""

    parts: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Repeat:
    """A part that may be left out (`optional`), repeated (`many`), or both."""

    part: Expression
    optional: bool
    many: bool


@dataclass(frozen=True, slots=True)
class Named:
    """An expression that stands for an instance of a symbol: the body of its rule."""

    name: str
    body: Expression


Expression = Symbol | Sequence | Choice | Repeat | Named


def parse(text: str) -> Expression:
    """Return the syntax tree of a right-hand side. Raises InvalidInput with what was found.

    >>> parse("Wa (TL Wa)*")
    Sequence(parts=(Symbol(name='Wa'), Repeat(part=Sequence(parts=(Symbol(name='TL'), \
Symbol(name='Wa'))), optional=True, many=True)))
    """
    if len(text) > MAX_LENGTH:
        raise InvalidInput(f"is longer than {MAX_LENGTH} characters")
    tokens = _tokens(text)
    tree, rest = _choice(tokens, 0)
    if rest != len(tokens):
        raise InvalidInput(f"unexpected {tokens[rest]!r} in {text!r}")
    return tree


def _tokens(text: str) -> list[str]:
    tokens, at = [], 0
    while text[at:].strip():
        match = TOKEN.match(text, at)
        if match is None:
            raise InvalidInput(f"unexpected {text[at:].strip()[0]!r} in {text!r}")
        tokens.append(match[1])
        at = match.end()
    return tokens


def _choice(tokens: list[str], at: int) -> tuple[Expression, int]:
    parts = []
    while True:
        part, at = _sequence(tokens, at)
        parts.append(part)
        if at >= len(tokens) or tokens[at] != "|":
            return (parts[0] if len(parts) == 1 else Choice(tuple(parts))), at
        at += 1


def _sequence(tokens: list[str], at: int) -> tuple[Expression, int]:
    parts = []
    while at < len(tokens) and tokens[at] not in "|)":
        part, at = _repeat(tokens, at)
        parts.append(part)
    if not parts:
        raise InvalidInput(
            f"nothing stands before {tokens[at] if at < len(tokens) else 'the end'!r}"
        )
    return (parts[0] if len(parts) == 1 else Sequence(tuple(parts))), at


def _repeat(tokens: list[str], at: int) -> tuple[Expression, int]:
    part, at = _atom(tokens, at)
    while at < len(tokens) and tokens[at] in "?*+":
        part = Repeat(part, tokens[at] in "?*", tokens[at] in "*+")
        at += 1
    return part, at


def _atom(tokens: list[str], at: int) -> tuple[Expression, int]:
    if tokens[at] == "(":
        inner, at = _choice(tokens, at + 1)
        if at >= len(tokens):
            raise InvalidInput("a parenthesis is not closed")
        return inner, at + 1
    if not tokens[at][0].isalpha():
        raise InvalidInput(f"{tokens[at]!r} follows nothing that it could repeat")
    return Symbol(tokens[at]), at + 1


def symbols(tree: Expression) -> Iterator[str]:
    """Yield the names of all symbols, in order, repeats included."""
    match tree:
        case Symbol(name):
            yield name
        case Sequence(parts) | Choice(parts):
            for part in parts:
                yield from symbols(part)
        case Repeat(part, _, _):
            yield from symbols(part)
        case Named(_, body):
            yield from symbols(body)


def replaced(tree: Expression, by: Callable[[str], Expression]) -> Expression:
    """Return the expression with every symbol replaced."""
    match tree:
        case Symbol(name):
            return by(name)
        case Sequence(parts):
            return Sequence(tuple(replaced(part, by) for part in parts))
        case Choice(parts):
            return Choice(tuple(replaced(part, by) for part in parts))
        case Repeat(part, optional, many):
            return Repeat(replaced(part, by), optional, many)
        case Named(name, body):
            return Named(name, replaced(body, by))


def shape(tree: Expression) -> str:
    """Return the expression without its names: rules that are derived alike have the same."""
    match tree:
        case Symbol():
            return "."
        case Sequence(parts):
            return "(" + " ".join(shape(part) for part in parts) + ")"
        case Choice(parts):
            return "(" + "|".join(shape(part) for part in parts) + ")"
        case Repeat(part, optional, many):
            return shape(part) + ("?" if optional else "") + ("+" if many else "")
        case Named(_, body):
            return shape(body)


@dataclass(slots=True)
class Automaton:
    """Glushkov's automaton: one state for each place of a symbol in the expression.

    symbols[i], path[i]: name of state i and the named instances around it, outermost first.
    first, last: states in which a word begins and ends. follow[i][j]: number of named instances
    that state j, coming after i, still shares with it.
    """

    symbols: list[str] = field(default_factory=list)
    path: list[tuple[str, ...]] = field(default_factory=list)
    first: frozenset[int] = frozenset()
    last: frozenset[int] = frozenset()
    follow: dict[int, dict[int, int]] = field(default_factory=dict)
    empty: bool = False


def automaton(tree: Expression) -> Automaton:
    """Return the automaton of an expression (Glushkov 1961).

    >>> a = automaton(parse("Wa (TL Wa)*"))
    >>> a.symbols, sorted(a.first), sorted(a.last), a.follow
    (['Wa', 'TL', 'Wa'], [0], [0, 2], {0: {1: 0}, 1: {2: 0}, 2: {1: 0}})
    """
    out = Automaton()
    out.empty, out.first, out.last = _build(tree, (), out)
    return out


_Ends = tuple[bool, frozenset[int], frozenset[int]]


def _build(tree: Expression, path: tuple[str, ...], out: Automaton) -> _Ends:
    match tree:
        case Symbol(name):
            out.symbols.append(name)
            out.path.append(path)
            state = len(out.symbols) - 1
            out.follow[state] = {}
            return False, frozenset([state]), frozenset([state])
        case Named(name, body):
            return _build(body, (*path, name), out)
        case Repeat(part, optional, many):
            empty, first, last = _build(part, path, out)
            if many:
                _connect(last, first, len(path), out)
            return empty or optional, first, last
        case Choice(parts):
            ends = [_build(part, path, out) for part in parts]
            firsts = frozenset[int]().union(*(e[1] for e in ends))
            lasts = frozenset[int]().union(*(e[2] for e in ends))
            return any(e[0] for e in ends), firsts, lasts
        case Sequence(parts):
            return _build_sequence(parts, path, out)


def _build_sequence(parts: tuple[Expression, ...], path: tuple[str, ...], out: Automaton) -> _Ends:
    empty, first, last = True, frozenset[int](), frozenset[int]()
    for part in parts:
        part_empty, part_first, part_last = _build(part, path, out)
        _connect(last, part_first, len(path), out)
        first = first | part_first if empty else first
        last = last | part_last if part_empty else part_last
        empty = empty and part_empty
    return empty, first, last


def _connect(last: frozenset[int], first: frozenset[int], shared: int, out: Automaton) -> None:
    for before in last:
        for after in first:
            # an inner connection has been made first, and keeps more instances open
            out.follow[before].setdefault(after, shared)
