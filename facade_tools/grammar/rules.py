"""What holds for every split grammar, whatever it is used for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..artifacts.grammar import Grammar, Rule, Size
from ..errors import InvalidInput
from .expressions import Automaton, automaton, parse, symbols


def check_grammar(grammar: Grammar) -> None:
    """Raise InvalidInput, with the pointer, where symbols, sizes or expressions do not fit."""
    if grammar.axiom not in grammar.rules:
        raise InvalidInput(f"{grammar.axiom!r} has no rule", pointer="/axiom")
    for name, rule in grammar.rules.items():
        if name in grammar.terminals:
            raise InvalidInput("is a terminal too", pointer=f"/rules/{name}")
        _check_rule(grammar, name, rule)
    _check_ends(grammar)


def _check_ends(grammar: Grammar) -> None:
    """Raise InvalidInput where a rule that is used has no word that ends in terminals."""
    machines = {name: automaton(parse(rule.into)) for name, rule in grammar.rules.items()}
    ending = set(grammar.terminals)
    grown = True
    while grown:
        found = {name for name, machine in machines.items() if _has_word(machine, ending)}
        grown = not found <= ending
        ending |= found
    used = symbols_below(grammar, grammar.axiom)
    endless = [name for name in grammar.rules if name in used - ending]
    if endless:
        message = f"{endless[0]} never ends: each of its words holds a rule that does not end"
        raise InvalidInput(message, pointer=f"/rules/{endless[0]}/into")


def _has_word(machine: Automaton, ending: set[str]) -> bool:
    """Tell whether an automaton has a word of these symbols alone."""
    reached = {state for state in machine.first if machine.symbols[state] in ending}
    waiting = list(reached)
    while waiting:
        after = machine.follow[waiting.pop()]
        new = {s for s in after if machine.symbols[s] in ending} - reached
        reached |= new
        waiting += new
    return machine.empty or not reached.isdisjoint(machine.last)


def _check_rule(grammar: Grammar, name: str, rule: Rule) -> None:
    pointer = f"/rules/{name}"
    try:
        parts = set(symbols(parse(rule.into)))
    except InvalidInput as error:
        raise InvalidInput(error.message, pointer=f"{pointer}/into") from None
    known = grammar.rules.keys() | grammar.terminals.keys()
    for part in sorted(parts - known):
        raise InvalidInput(f"{part!r} is neither a rule nor a terminal", pointer=f"{pointer}/into")
    for part in sorted(rule.sizes.keys() - parts):
        raise InvalidInput("is not a part of the rule", pointer=f"{pointer}/sizes/{part}")
    for part, size in rule.sizes.items():
        _check_size(size, f"{pointer}/sizes/{part}")
    if rule.like is not None:
        _check_like(grammar, rule, f"{pointer}/like")


def _check_size(size: Size, pointer: str) -> None:
    if size.min > size.max:
        raise InvalidInput(f"min {size.min} is above max {size.max}", pointer=pointer)
    if size.weight and (size.typical is None or not size.spread):
        raise InvalidInput("a weight needs typical and spread", pointer=pointer)


def _check_like(grammar: Grammar, rule: Rule, pointer: str) -> None:
    other = grammar.rules.get(rule.like or "")
    if other is None or other.split != rule.split or other.like is not None:
        message = f"{rule.like!r} is no {rule.split} rule with parameters of its own"
        raise InvalidInput(message, pointer=pointer)


def symbols_below(grammar: Grammar, symbol: str) -> set[str]:
    """Return the symbols that a shape can be made of, itself among them."""
    found: set[str] = set()
    waiting = [symbol]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _parts(grammar, name)
    return found


def grammar_below(grammar: Grammar, symbol: str, share: float) -> Grammar:
    """Return the grammar of one of the shapes; share: its height over the axiom's.

    Sizes become shares of the shape's height, so that they bind as before.
    """
    names = symbols_below(grammar, symbol)
    leaders = {rule.like for name in names if (rule := grammar.rules.get(name)) and rule.like}
    kept = names.union(*(symbols_below(grammar, leader) for leader in leaders))
    rules = {name: _scaled(rule, 1 / share) for name, rule in grammar.rules.items() if name in kept}
    return replace(grammar, axiom=symbol, rules=rules)


def _parts(grammar: Grammar, symbol: str) -> Iterator[str]:
    if symbol in grammar.rules:
        yield from symbols(parse(grammar.rules[symbol].into))


def _scaled(rule: Rule, factor: float) -> Rule:
    def scaled(size: Size) -> Size:
        typical, spread = (None if v is None else v * factor for v in (size.typical, size.spread))
        return Size(size.min * factor, size.max * factor, typical, spread, size.weight)

    return replace(rule, sizes={part: scaled(size) for part, size in rule.sizes.items()})
