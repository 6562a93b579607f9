"""A design read: patterns parsed, names looked up, one problem a direction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from ..artifacts.design import Appearance, Design, DesignLayer, DesignSymbol
from ..artifacts.pointers import escaped
from ..errors import InvalidInput
from .language import (
    MAX_DEPTH,
    Exponent,
    Node,
    PatternError,
    Substituted,
    Symbol,
    counters_of,
    parse,
    powers_of,
    symbol_pair,
    symbols_of,
)
from .problem import TOLERANCES, Direction, LayerPattern, Rule
from .words import Reflection

Axis = Literal["x", "y"]
SETTINGS = ("pattern", "control", "reflection", "visible", "shapes")
DEFAULT_GROUP = "default"
MOST_REPEATS = 10_000
MOST_CANVAS = 1e6  # m


@dataclass(frozen=True, slots=True)
class Pattern:
    """A named pattern, parsed, with what it overrides in the layers that use it."""

    node: Node
    reflection: Reflection
    visible: tuple[str, ...] | None
    shapes: Mapping[str, Appearance]


@dataclass(frozen=True, slots=True)
class Stack:
    """A design whose names all mean something; layers have names and are enabled."""

    design: Design
    layers: tuple[DesignLayer, ...]
    patterns: Mapping[str, Pattern]

    def direction(self, axis: Axis, length: float | None = None) -> Direction:
        """Return what one direction is solved from, on a canvas of `length` (m).

        Raises InvalidInput where that is no length.
        """
        canvas = self.design.canvas
        own = canvas.width if axis == "x" else canvas.height
        groups: dict[str, list[LayerPattern]] = {}
        for layer in self.layers:
            name = getattr(layer, axis)
            row = LayerPattern(
                layer.name, name, self.patterns[name].node, self.patterns[name].reflection
            )
            groups.setdefault(group_of(layer, axis), []).append(row)
        length = own if length is None else length
        if not 0.0 < length <= MOST_CANVAS:
            what = "width" if axis == "x" else "height"
            problem = f"a canvas of {length:g} m; expected more than 0, at most {MOST_CANVAS:g} m"
            raise InvalidInput(problem, pointer=f"/canvas/{what}")
        return Direction(
            axis,
            length,
            rules_of(self.design),
            {name: tuple(rows) for name, rows in groups.items()},
            self._counters(length),
        )

    def _counters(self, canvas: float) -> dict[str, tuple[int, int]]:
        """Return the least and greatest value of every counter.

        One that the solver chooses goes so far that the narrowest symbol fills the canvas, also
        where the exponent is k - 100 or m - k.
        """
        sizes = [symbol.size for symbol in self.design.symbols.values() if symbol.size]
        repeats = int((1.0 + TOLERANCES[-1]) * canvas / min([*sizes, canvas])) + 2
        given = {name: _range(value, repeats) for name, value in self.design.counters.items()}
        most = dict.fromkeys(given, repeats)
        for pattern in self.patterns.values():
            for power in powers_of(pattern.node):
                for name in given:
                    beside = _offset(power.exponent, name, given)
                    most[name] = max(most[name], repeats + beside)
        return {
            name: _range(value, min(MOST_REPEATS, most[name]))
            for name, value in self.design.counters.items()
        }


def _offset(exponent: Exponent, name: str, given: Mapping[str, tuple[int, int]]) -> int:
    """Return how much greater a counter may have to be for what stands beside it."""
    factors = dict(exponent.terms)
    own = factors.pop(name, 0)
    if own == 0:
        return 0
    sign = -1 if own > 0 else 1
    ends = [max(sign * factor * end for end in given[n]) for n, factor in factors.items()]
    return abs(exponent.constant) + sum(max(0, end) for end in ends)


def rules_of(design: Design) -> dict[str, Rule]:
    """Return the alignment rules of a design's symbols."""
    return {
        name: Rule(s.size, s.opaque, s.attached, s.unoccludable, s.transparent)
        for name, s in design.symbols.items()
    }


def _range(value: Any, most: int) -> tuple[int, int]:
    if value == "auto":
        return 0, most
    if isinstance(value, Mapping):
        return value["min"], value["max"]
    return value, value


def group_of(layer: DesignLayer, axis: Axis) -> str:
    """Return the alignment group of a layer in one direction."""
    group = layer.group.get(axis) if isinstance(layer.group, Mapping) else layer.group
    return group or DEFAULT_GROUP


def stack_of(design: Design) -> Stack:
    """Read a design. Raises InvalidInput with the JSON pointer of what is wrong.

    Symbols that patterns use and `symbols` does not list are unsized. An unsized symbol stands in
    control patterns, or is marked transparent.
    """
    patterns = {name: _pattern(design, name) for name in design.patterns}
    layers = tuple(_layers(design))
    names = {name for p in patterns.values() for name in symbols_of(p.node)}
    symbols = {**design.symbols}
    for name in sorted(names - set(symbols)):
        symbols[name] = DesignSymbol(transparent=True)
    stack = Stack(replace(design, symbols=symbols), layers, patterns)
    _check_counters(stack)
    _check_sizes(stack, {name for name, s in design.symbols.items() if s.transparent})
    _check_shapes(stack)
    return stack


def _pattern(design: Design, name: str) -> Pattern:
    raw = design.patterns[name]
    pointer = f"/patterns/{escaped(name)}"
    settings = raw if isinstance(raw, Mapping) else {}
    shapes = {key: Appearance(**value) for key, value in settings.get("shapes", {}).items()}
    visible = settings.get("visible")
    return Pattern(
        _node(raw, pointer, 0),
        settings.get("reflection", design.reflection),
        None if visible is None else tuple(visible),
        shapes,
    )


def _node(raw: Any, pointer: str, depth: int) -> Node:
    """Return the tree of a pattern's text or object; substitutions may nest."""
    if depth > MAX_DEPTH:
        raise InvalidInput(f"nested deeper than {MAX_DEPTH}", pointer=pointer)
    if isinstance(raw, str):
        return _parsed(raw, pointer)
    lost = next((key for key in SETTINGS[2:] if depth and key in raw), None)
    if lost is not None:
        problem = f"{lost!r} means nothing in a content; expected beside the outermost `control`"
        raise InvalidInput(problem, pointer=f"{pointer}/{lost}")
    if ("pattern" in raw) == ("control" in raw):
        raise InvalidInput("expected either `pattern` or `control`", pointer=pointer)
    if "pattern" in raw:
        extra = next((key for key in raw if key not in SETTINGS), None)
        if extra is not None:
            problem = f"{extra!r} is unknown beside `pattern`; only `control` has substitutions"
            raise InvalidInput(problem, pointer=f"{pointer}/{escaped(extra)}")
        return _parsed(raw["pattern"], f"{pointer}/pattern")
    control = _parsed(raw["control"], f"{pointer}/control")
    known = symbols_of(control)
    contents = []
    for key, value in raw.items():
        if key in SETTINGS:
            continue
        if key not in known:
            problem = f"{key!r} is no symbol of the control pattern {raw['control']!r}"
            raise InvalidInput(problem, pointer=f"{pointer}/{escaped(key)}")
        contents.append((key, _node(value, f"{pointer}/{escaped(key)}", depth + 1)))
    return Substituted(control, tuple(contents))


def _parsed(text: str, pointer: str) -> Node:
    try:
        return parse(text)
    except PatternError as error:
        raise PatternError(error.text, error.offset, error.problem, pointer=pointer) from None


def _layers(design: Design) -> Iterator[DesignLayer]:
    seen: set[str] = set()
    for index, layer in enumerate(design.layers):
        name = layer.name or f"layer-{index + 1}"
        if name in seen:
            raise InvalidInput(f"{name!r} stands twice", pointer=f"/layers/{index}/name")
        seen.add(name)
        for axis in ("x", "y"):
            pattern = getattr(layer, axis)
            if pattern not in design.patterns:
                known = ", ".join(design.patterns)
                problem = f"pattern {pattern!r} does not exist; expected one of {known}"
                raise InvalidInput(problem, pointer=f"/layers/{index}/{axis}")
        if layer.enabled:
            yield replace(layer, name=name)
    if not any(layer.enabled for layer in design.layers):
        raise InvalidInput("no layer is enabled", pointer="/layers")


def _check_counters(stack: Stack) -> None:
    for name, pattern in stack.patterns.items():
        missing = sorted(counters_of(pattern.node) - set(stack.design.counters))
        if missing:
            problem = f"counter {missing[0]!r} is not in `counters`; expected a number or auto"
            raise InvalidInput(problem, pointer=f"/patterns/{escaped(name)}")
    for name, value in stack.design.counters.items():
        if isinstance(value, Mapping) and value["min"] > value["max"]:
            problem = "min is greater than max"
            raise InvalidInput(problem, pointer=f"/counters/{escaped(name)}")


def _check_sizes(stack: Stack, free: set[str]) -> None:
    for name, pattern in stack.patterns.items():
        for symbol in sorted(set(_solid(pattern.node, False))):
            rule = stack.design.symbols[symbol]
            if rule.size is None and symbol not in free:
                problem = (
                    f"symbol {symbol!r} has no size and stands outside of control patterns; "
                    f"expected symbols: {{{symbol}: {{size: …}}}}"
                )
                raise InvalidInput(problem, pointer=f"/patterns/{escaped(name)}")


def _solid(node: Node, control: bool) -> Iterator[str]:
    """Yield the symbols that a pattern uses outside of control patterns."""
    match node:
        case Symbol(name):
            if not control:
                yield name
        case Substituted(_, contents):
            for _, part in contents:
                yield from _solid(part, False)
        case _:
            for part in _children(node):
                yield from _solid(part, control)


def _children(node: Any) -> tuple[Node, ...]:
    for field in ("parts", "options"):
        if hasattr(node, field):
            return tuple(getattr(node, field))
    return (node.base,)


def shape_tables(stack: Stack) -> Iterator[tuple[str, Mapping[str, Appearance]]]:
    """Yield pointer and content of every table of shapes: the design's, of layers, of patterns."""
    yield "/shapes", stack.design.shapes
    for i, layer in enumerate(stack.design.layers):
        yield f"/layers/{i}/shapes", layer.shapes
    for name, pattern in stack.patterns.items():
        yield f"/patterns/{escaped(name)}/shapes", pattern.shapes


def _check_shapes(stack: Stack) -> None:
    known = set(stack.design.symbols)
    for pointer, table in shape_tables(stack):
        for key in table:
            place = f"{pointer}/{escaped(key)}"
            try:
                pair = symbol_pair(key)
            except PatternError as error:
                raise PatternError(error.text, error.offset, error.problem, pointer=place) from None
            for symbol in pair:
                if symbol != "*" and symbol not in known:
                    raise InvalidInput(f"symbol {symbol!r} does not exist", pointer=place)
    masks = [(f"/layers/{i}/visible", la.visible) for i, la in enumerate(stack.design.layers)]
    masks += [(f"/patterns/{escaped(n)}/visible", p.visible) for n, p in stack.patterns.items()]
    for pointer, mask in masks:
        for i, symbol in enumerate(mask or ()):
            if symbol not in known:
                raise InvalidInput(f"symbol {symbol!r} does not exist", pointer=f"{pointer}/{i}")
