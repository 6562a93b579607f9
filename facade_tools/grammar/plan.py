"""A split grammar made ready for solvers: an automaton of rows and automata of columns.

A facade of the grammar is a stack of rows. A row of a terminal has one label; a row that is split
to the right takes its labels from the kinds of its columns. All rows of one group share their
columns (the factorisation of TSKP10 2.3), so that labels are a table: row state × column kind.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..artifacts.grammar import Grammar, Rule, Size
from ..errors import InvalidInput
from .expressions import (
    Automaton,
    Expression,
    Named,
    Symbol,
    automaton,
    parse,
    replaced,
    shape,
)
from .rules import check_grammar

MAX_STATES = 200


@dataclass(frozen=True, slots=True)
class RowState:
    """One kind of row.

    group: of columns, None for a terminal's row. labels: one for each kind of column (one label
    where there is no group). parts: the symbol of each kind's part in this row. size: bounds of
    its height. path: instances around it, outermost first; the last is the row's own symbol.
    """

    group: int | None
    labels: tuple[str, ...]
    parts: tuple[str, ...]
    size: Size
    path: tuple[str, ...]
    band: int


@dataclass(frozen=True, slots=True)
class Columns:
    """The automaton of one group's columns; sizes[k] bounds the width of kind k."""

    leader: str
    automaton: Automaton
    sizes: tuple[Size, ...]
    each: bool


@dataclass(frozen=True, slots=True)
class Plan:
    """Rows from the bottom to the top, and the groups of columns."""

    grammar: Grammar
    rows: Automaton
    states: tuple[RowState, ...]
    groups: tuple[Columns, ...]

    @property
    def labels(self) -> list[str]:
        """All labels, in the order of first use."""
        return list(dict.fromkeys(label for state in self.states for label in state.labels))

    @property
    def per_floor(self) -> bool:
        """Whether some rows have columns of their own."""
        return any(group.each for group in self.groups)


def plan(grammar: Grammar) -> Plan:
    """Compile a grammar for the solvers.

    Raises InvalidInput, with the pointer, where a grammar is one that only sampling can handle: a
    right split inside a right split, or tiles of one row that are cut in different ways.
    """
    check_grammar(grammar)
    return _Compiler(grammar).plan()


class _Compiler:
    def __init__(self, grammar: Grammar) -> None:
        self.grammar = grammar
        self.bodies = {name: parse(rule.into) for name, rule in grammar.rules.items()}
        self.groups: dict[str, int] = {}
        self.states: list[RowState] = []

    def plan(self) -> Plan:
        """Expand the axiom until rows are left, then build their automaton.

        Raises InvalidInput on a grammar of too many kinds of rows.
        """
        axiom = self.grammar.axiom
        tree = self._expanded(axiom, Size(), (), ())
        rows = automaton(tree)
        if len(rows.symbols) > MAX_STATES:
            raise InvalidInput(f"has more than {MAX_STATES} kinds of rows", pointer="/rules")
        states = [self.states[int(name)] for name in rows.symbols]
        states = [_with_path(state, path) for state, path in zip(states, rows.path, strict=True)]
        return Plan(self.grammar, rows, tuple(states), tuple(self._columns()))

    def _expanded(
        self, name: str, size: Size, path: tuple[str, ...], around: tuple[str, ...]
    ) -> Expression:
        """Return the rows of a symbol; the names in the tree are numbers of states."""
        rule = self.grammar.rules.get(name)
        if rule is None:
            label = self.grammar.terminals[name]
            return self._state(RowState(None, (label,), (name,), size, (), 0))
        if name in around:
            raise InvalidInput(f"{name} contains itself", pointer=f"/rules/{name}/into")
        if rule.split == "right":
            return Named(name, self._row(name, rule, size))
        inside = (*around, name)

        def part(symbol: str) -> Expression:
            return self._expanded(symbol, rule.sizes.get(symbol, Size()), path, inside)

        return Named(name, replaced(self.bodies[name], part))

    def _state(self, state: RowState) -> Symbol:
        self.states.append(state)
        return Symbol(str(len(self.states) - 1))

    def _row(self, name: str, rule: Rule, size: Size) -> Expression:
        """Return the bands of a row that is split to the right: its tiles are cut alike."""
        group = self._group(name, rule)
        kinds = automaton(self.bodies[name]).symbols
        tiles = [kind for kind in dict.fromkeys(kinds) if kind in self.grammar.rules]
        for tile in tiles:
            self._check_tile(name, tile, tiles[0])
        if not tiles:
            labels = tuple(self.grammar.terminals[kind] for kind in kinds)
            return self._state(RowState(group, labels, tuple(kinds), size, (), 0))
        leader = self.grammar.rules[tiles[0]].like or tiles[0]
        cut = {*tiles, leader}
        bands = {tile: automaton(self.bodies[tile]).symbols for tile in cut}
        counter = iter(range(len(bands[tiles[0]])))

        def band(_: str) -> Expression:
            index = next(counter)
            parts = tuple(bands[kind][index] if kind in tiles else kind for kind in kinds)
            labels = tuple(self.grammar.terminals[part] for part in parts)
            bounds = self.grammar.rules[leader].sizes.get(bands[leader][index], Size())
            return self._state(RowState(group, labels, parts, bounds, (), index))

        return replaced(self.bodies[tiles[0]], band)

    def _check_tile(self, row: str, tile: str, first: str) -> None:
        rule = self.grammar.rules[tile]
        pointer = f"/rules/{tile}/into"
        if rule.split != "up":
            raise InvalidInput(f"a right split inside the right split of {row}", pointer=pointer)
        if any(s in self.grammar.rules for s in automaton(self.bodies[tile]).symbols):
            raise InvalidInput(f"holds a rule; tiles of {row} hold terminals", pointer=pointer)
        if shape(self.bodies[tile]) != shape(self.bodies[first]):
            raise InvalidInput(f"is not cut like {first}, its neighbour in {row}", pointer=pointer)

    def _group(self, name: str, rule: Rule) -> int:
        leader = rule.like or name
        own = automaton(self.bodies[name])
        if own.empty:
            raise InvalidInput("may be empty; expected parts", pointer=f"/rules/{name}/into")
        if shape(self.bodies[leader]) != shape(self.bodies[name]):
            message = f"is not cut like {leader}, which it is derived like"
            raise InvalidInput(message, pointer=f"/rules/{name}/into")
        return self.groups.setdefault(leader, len(self.groups))

    def _columns(self) -> list[Columns]:
        out = []
        for leader in self.groups:
            rule = self.grammar.rules[leader]
            machine = automaton(self.bodies[leader])
            sizes = tuple(rule.sizes.get(symbol, Size()) for symbol in machine.symbols)
            out.append(Columns(leader, machine, sizes, rule.derive == "each"))
        return out


def _with_path(state: RowState, path: tuple[str, ...]) -> RowState:
    return RowState(state.group, state.labels, state.parts, state.size, path, state.band)
