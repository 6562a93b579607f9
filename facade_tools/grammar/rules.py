"""What holds for every split grammar, whatever it is used for."""

from __future__ import annotations

from ..artifacts.grammar import Grammar, Rule, Size
from ..errors import InvalidInput
from .expressions import parse, symbols


def check_grammar(grammar: Grammar) -> None:
    """Raise InvalidInput, with the pointer, where symbols, sizes or expressions do not fit."""
    if grammar.axiom not in grammar.rules:
        raise InvalidInput(f"{grammar.axiom!r} has no rule", pointer="/axiom")
    for name, rule in grammar.rules.items():
        if name in grammar.terminals:
            raise InvalidInput("is a terminal too", pointer=f"/rules/{name}")
        _check_rule(grammar, name, rule)


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
