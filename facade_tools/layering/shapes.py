"""The grid of shapes: outer products of the layers' letters, masks, looks, occlusion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np

from ..artifacts.design import Appearance, DesignLayer
from ..artifacts.layout import LayoutShape
from ..errors import InvalidInput
from .language import symbol_pair, symbols_of
from .stack import Stack
from .words import Letter

MOST_SHAPES = 300_000
BROWN = "#a9866a"  # of a shape that nobody has coloured


class PlacedLetter(NamedTuple):
    """A letter with its lower and upper bound (m)."""

    letter: Letter
    s: float
    t: float


Line = tuple[PlacedLetter, ...]
Lines = Mapping[str, Line]
Pair = tuple[str, str]
Looks = Mapping[Pair, Appearance]


def grid_of(stack: Stack, x: Lines, y: Lines) -> tuple[LayoutShape, ...]:
    """Return all shapes, the topmost layer first. Raises InvalidInput where they are too many."""
    count = sum(len(x[layer.name]) * len(y[layer.name]) for layer in stack.layers)
    if count > MOST_SHAPES:
        raise InvalidInput(f"{count} shapes; expected at most {MOST_SHAPES}", pointer="/layers")
    shapes = [
        shape
        for layer in stack.layers
        for shape in _layer(stack, layer, x[layer.name], y[layer.name])
    ]
    return _uncovered(stack, shapes)


def _layer(stack: Stack, layer: DesignLayer, x: Line, y: Line) -> Iterator[LayoutShape]:
    tables = [_table(table) for table in _tables(stack, layer)]
    masks = _mask(stack, layer, "x"), _mask(stack, layer, "y")
    looks: dict[Pair, Appearance] = {}
    for row in y:
        for column in x:
            pair = column.letter.symbol, row.letter.symbol
            if pair not in looks:
                looks[pair] = _look(tables, pair)
            clear = column.letter.transparent or row.letter.transparent
            hidden = pair[0] not in masks[0] or pair[1] not in masks[1]
            yield _shape(stack, layer, (column, row), looks[pair], not clear and not hidden)


def _shape(
    stack: Stack,
    layer: DesignLayer,
    cell: tuple[PlacedLetter, PlacedLetter],
    look: Appearance,
    shown: bool,
) -> LayoutShape:
    column, row = cell
    own = [stack.design.symbols[placed.letter.symbol].color for placed in cell]
    return LayoutShape(
        layer.name,
        (column.letter.name, row.letter.name),
        column.s,
        row.s,
        column.t,
        row.t,
        layer.depth if look.depth is None else look.depth,
        shown and look.visible is not False,
        look.thickness,
        look.color or own[0] or own[1] or (BROWN if shown else None),
        look.mesh,
        look.texture,
        look.element,
    )


def _tables(stack: Stack, layer: DesignLayer) -> list[Mapping[str, Appearance]]:
    """Return the tables of looks, the most specific first."""
    patterns = stack.patterns
    return [layer.shapes, patterns[layer.x].shapes, patterns[layer.y].shapes, stack.design.shapes]


def _table(table: Mapping[str, Appearance]) -> Looks:
    return {symbol_pair(key): look for key, look in table.items()}


def _look(tables: Sequence[Looks], pair: Pair) -> Appearance:
    """Merge the looks of a shape, field by field; `CP` goes before `C*`, `*P` and `**`."""
    out = Appearance()
    for table in tables:
        for key in (pair, (pair[0], "*"), ("*", pair[1]), ("*", "*")):
            if key in table:
                found = table[key]
                missing = {
                    f.name: getattr(found, f.name)
                    for f in fields(out)
                    if getattr(out, f.name) is None
                }
                out = replace(out, **missing)
    return out


def _mask(stack: Stack, layer: DesignLayer, axis: str) -> set[str]:
    """Return the symbols of one direction that the layer's and its pattern's masks let through.

    A layer's mask that names no symbol of a direction does not restrict it.
    """
    pattern = stack.patterns[getattr(layer, axis)]
    symbols = symbols_of(pattern.node)
    if pattern.visible is not None:
        symbols &= set(pattern.visible)
    if layer.visible is not None:
        named = symbols_of(pattern.node) & set(layer.visible)
        symbols = symbols & named if named or not layer.visible else symbols
    return symbols


def _uncovered(stack: Stack, shapes: list[LayoutShape]) -> tuple[LayoutShape, ...]:
    """Hide shapes that lie wholly behind opaque boxes of the layers above them."""
    x0, x1, width = _ranks(shapes, "x0", "x1")
    y0, y1, height = _ranks(shapes, "y0", "y1")
    covered = np.zeros((height, width), dtype=bool)
    out = []
    for i, shape in enumerate(shapes):
        if shape.visible:
            cells = covered[y0[i] : y1[i], x0[i] : x1[i]]
            if cells.all():
                shape = replace(shape, visible=False)
            elif _covers(stack, shape):
                cells[:] = True
        out.append(shape)
    return tuple(out)


def _ranks(shapes: Sequence[LayoutShape], low: str, high: str) -> tuple[list[int], list[int], int]:
    """Return the ranks of every shape's lower and upper border, and how many there are."""
    ends = [[getattr(shape, end) for shape in shapes] for end in (low, high)]
    values, ranks = np.unique(np.round(ends, 9), return_inverse=True)
    first, second = ranks.reshape(2, -1).tolist()
    return first, second, len(values)


def _covers(stack: Stack, shape: LayoutShape) -> bool:
    """Tell whether a shape fills its cell: a box of two opaque symbols."""
    rules = stack.design.symbols
    return shape.mesh is None and all(rules[name.lstrip("~")].opaque for name in shape.symbols)
