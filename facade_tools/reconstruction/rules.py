"""What holds for every shape grammar, whatever it is derived on."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from ..artifacts.shape_grammar import Operation, ShapeGrammar
from ..errors import InvalidInput
from .expressions import names_in

CUTS = ("split", "repeat", "mirror", "faces", "roof")
STEEPEST = 88  # degrees of a roof
WINDOW_STYLES = ("sash", "sliding", "casement", "bay", "fixed", "unknown")
OTHERWISE = "otherwise"  # the condition of a rule that stands in where no other applies
SCOPE_NAMES = (
    "width", "depth", "height", "area", "side", "index", "count", "z", "lot_height",
)  # fmt: skip


def check_shape_grammar(grammar: ShapeGrammar) -> None:
    """Raise InvalidInput, with the pointer, where symbols, operations or expressions do not fit."""
    defined = {rule.symbol for rule in grammar.rules}
    if grammar.axiom not in defined:
        raise InvalidInput(f"{grammar.axiom!r} has no rule", pointer="/axiom")
    for name in grammar.parameters:
        if name in SCOPE_NAMES:
            pointer = f"/parameters/{name}"
            raise InvalidInput("names a measure of the scope; take another name", pointer=pointer)
    _check_styles(grammar)
    names = {*grammar.parameters, *SCOPE_NAMES}
    known = defined | grammar.terminals.keys()
    for i, rule in enumerate(grammar.rules):
        pointer = f"/rules/{i}"
        if rule.when != OTHERWISE:
            _check_expression(rule.when, names, f"{pointer}/when")
        if rule.symbol in grammar.terminals:
            raise InvalidInput(f"{rule.symbol!r} is a terminal too", pointer=f"{pointer}/symbol")
        for j, operation in enumerate(rule.do):
            place = f"{pointer}/do/{j}"
            _check_operation(operation, place)
            _check_roof(operation, place)
            for symbol in symbols_of(operation):
                if symbol not in known:
                    message = f"{symbol!r} is neither a rule nor a terminal"
                    raise InvalidInput(message, pointer=place)
            for amount in _amounts(operation):
                _check_expression(amount, names, place)


def _check_styles(grammar: ShapeGrammar) -> None:
    for name, terminal in grammar.terminals.items():
        if terminal.label == "window" and terminal.style not in ("", *WINDOW_STYLES):
            message = f"{terminal.style!r} is no style of a window ({', '.join(WINDOW_STYLES)})"
            raise InvalidInput(message, pointer=f"/terminals/{name}/style")


def grammar_problems(grammar: ShapeGrammar) -> Iterator[tuple[str, str]]:
    """Yield the first thing that is wrong with a grammar: pointer and message."""
    try:
        check_shape_grammar(grammar)
    except InvalidInput as error:
        yield error.place.pointer, error.message


def _check_operation(operation: Operation, pointer: str) -> None:
    cuts = [name for name in CUTS if getattr(operation, name)]
    if len(cuts) > 1:
        message = f"{' and '.join(cuts)} at once; expected one of {', '.join(CUTS)}"
        raise InvalidInput(message, pointer=pointer)
    what, fits = "one symbol", isinstance(operation.into, str)
    if operation.split:
        what, fits = "a list of parts", isinstance(operation.into, tuple | list)
    elif operation.roof:
        what, fits = "symbols by selector", isinstance(operation.into, dict)
    if cuts != ["faces"] and not fits:
        raise InvalidInput(f"needs {what}", pointer=f"{pointer}/into")
    if operation.repeat and operation.each is None:
        raise InvalidInput("repeat needs the size of a part", pointer=f"{pointer}/each")


def _check_roof(operation: Operation, pointer: str) -> None:
    """Raise InvalidInput on numbers that no roof has; what is drawn or computed is clipped."""
    for name, most in (("pitch", STEEPEST), ("rise", inf)):
        amounts = getattr(operation, name)
        for amount in amounts if isinstance(amounts, tuple | list) else [amounts]:
            if isinstance(amount, int | float) and not 0 <= amount <= most:
                span = f"from 0 to {STEEPEST}°" if name == "pitch" else "of at least 0 m"
                raise InvalidInput(f"{amount} is no {name} {span}", pointer=f"{pointer}/{name}")


def symbols_of(operation: Operation) -> Iterator[str]:
    """Yield the symbols that an operation makes."""
    yield from operation.faces.values()
    into = operation.into
    if isinstance(into, str):
        yield into
    elif isinstance(into, dict):
        yield from into.values()
    elif isinstance(into, tuple | list):
        for part in into:
            yield from part


def _amounts(operation: Operation) -> Iterator[object]:
    for group in (operation.translate, operation.rotate, operation.scale, operation.weights):
        yield from group.values()
    for value in (operation.pitch, operation.rise):
        yield from value if isinstance(value, tuple | list) else [value]
    yield from (operation.extrude, operation.each)
    if isinstance(operation.into, tuple | list):
        for part in operation.into:
            yield from part.values()


def _check_expression(amount: object, names: set[str], pointer: str) -> None:
    if not isinstance(amount, str) or not amount:
        return
    text = amount.strip().removeprefix("~").removesuffix("%")
    try:
        unknown = sorted(names_in(text) - names)
    except InvalidInput as error:
        raise InvalidInput(error.message, pointer=pointer) from None
    if unknown:
        raise InvalidInput(f"{unknown[0]!r} is no parameter", pointer=pointer)
