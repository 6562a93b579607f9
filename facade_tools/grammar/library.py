"""Grammars that ship with the tool, and the user's own."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from ..artifacts.documents import decode, parse_yaml
from ..artifacts.grammar import Grammar
from ..artifacts.store import read_only
from ..errors import InvalidInput
from .rules import check_grammar

DEFAULT = "haussmann-floors"


def builtin_names() -> list[str]:
    """Return the names of the shipped grammars."""
    entries = resources.files("facade_tools.grammar").joinpath("builtin").iterdir()
    return sorted(e.name.removesuffix(".yaml") for e in entries if e.name.endswith(".yaml"))


def builtin(name: str) -> Grammar:
    """Return the shipped grammar called `name`."""
    path = resources.files("facade_tools.grammar").joinpath("builtin", f"{name}.yaml")
    grammar: Grammar = decode(parse_yaml(path.read_bytes()), "grammar")
    check_grammar(grammar)
    return grammar


def load(name: str) -> Grammar:
    """Return a shipped grammar by its name, or the grammar of a file (.yaml or .json).

    Raises InvalidInput on what is neither, and on a grammar whose symbols do not fit.
    """
    if name in builtin_names():
        return builtin(name)
    if not Path(name).exists():
        shipped = ", ".join(builtin_names())
        raise InvalidInput(f"is neither a file nor a shipped grammar ({shipped})").at(name)
    item = read_only(name)
    grammar = item.artifact(Grammar)
    try:
        check_grammar(grammar)
    except InvalidInput as error:
        raise item.located(error) from None
    return grammar
