"""Dormers of roofs that a parse leaves bare.

A belief in single pixels is small where dormers are pale, and sums of pixels say no; but a row of
dormers is there or it is not. If the roof has some, the odds of windows are higher by what made
the classifier doubt. So the roof alone is read again with windows favoured more and more, and a
row of dormers that comes to stand is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..artifacts.grammar import Grammar, Node
from ..errors import Infeasible
from ..grammar.derivation import leaves, nodes
from ..grammar.plan import Plan, plan
from ..grammar.rules import grammar_below, symbols_below
from ..imaging.features_context import Probabilities
from .deriving import Frame, derivation
from .dp import Solution
from .energy import Field, field_of
from .railings import WINDOW

Solve = Callable[[Field, Plan], Solution]

ROOF = "roof"
FAVOURS = (4.0, 8.0)  # factors of the odds of windows, tried in turn
ENOUGH = 0.5  # more dormers than this share of the highest floor's windows are a row
WIDEST = 1.5  # widths of the highest floor's windows; what is wider is a banner or a skylight


@dataclass(frozen=True, slots=True)
class Seen:
    """What a classifier believes of a picture at working resolution, top row first.

    belief: (classes, height, width). hidden: (height, width), where every label is as good.
    """

    belief: Probabilities
    classes: Sequence[str]
    hidden: NDArray[np.bool_]


def with_dormers(tree: Node, grammar: Grammar, seen: Seen, frame: Frame, solve: Solve) -> Node:
    """Return the derivation with dormers in roofs where it has none and the belief allows a row.

    Roofs whose windows would stand in the columns of other rows are left alone.
    """
    usual = highest_windows(tree)
    return _Roofs(grammar, seen, frame, solve, usual).visited(tree) if usual else tree


def highest_windows(tree: Node) -> list[float]:
    """Return the widths of the windows of the highest floor that has some."""
    rows = [_windows(node) for node in nodes(tree) if node.split == "right"]
    return next((row for row in reversed(rows) if row), [])


def _windows(row: Node) -> list[float]:
    """Return the widths of the tiles of a row that hold a window, pixels of the picture."""
    return [
        tile.scope[2] - tile.scope[0]
        for tile in row.children
        if any(leaf.label == WINDOW for leaf in leaves(tile))
    ]


def _is_bare(node: Node, grammar: Grammar) -> bool:
    """Return whether a shape is roof alone, but might have had windows of its own."""
    if any(leaf.label != ROOF for leaf in leaves(node)):
        return False
    names = symbols_below(grammar, node.symbol)
    if not any(grammar.terminals.get(name) == WINDOW for name in names):
        return False
    leaders = {grammar.rules[name].like for name in names & grammar.rules.keys()} - {None, *names}
    return all(grammar.rules[leader].derive == "each" for leader in leaders if leader)


@dataclass(frozen=True, slots=True)
class _Roofs:
    """What reading the roofs again needs. usual: widths of the highest floor's windows."""

    grammar: Grammar
    seen: Seen
    frame: Frame
    solve: Solve
    usual: list[float]

    def visited(self, node: Node) -> Node:
        """Return a shape with dormers in the bare roofs below it."""
        if node.children and _is_bare(node, self.grammar):
            return self.dormers(node) or node
        return replace(node, children=tuple(self.visited(child) for child in node.children))

    def dormers(self, roof: Node) -> Node | None:
        """Return the roof with the first row of dormers that stands, None where none does."""
        y0, y1 = (round(y) for y in roof.scope[1::2])
        height, width = self.frame.working
        top, foot = (round(y * height / self.frame.picture[0]) for y in (y0, y1))
        if foot <= top:
            return None
        part = plan(grammar_below(self.grammar, roof.symbol, (foot - top) / height))
        own = Frame((foot - top, width), (y1 - y0, self.frame.picture[1]))
        window = self.seen.classes.index(WINDOW)
        for favour in FAVOURS:
            belief = favoured(self.seen.belief[:, top:foot], window, favour)
            belief[:, self.seen.hidden[top:foot]] = 1
            try:
                solution = self.solve(field_of(belief, self.seen.classes, part), part)
            except Infeasible:
                return None
            tree = derivation(part, solution.layout, own)
            rows = [_windows(node) for node in nodes(tree) if node.split == "right"]
            if self.stands(max(rows, key=len, default=[])):
                return _lowered(tree, y0)
        return None

    def stands(self, dormers: list[float]) -> bool:
        """Return whether dormers of these widths are a row above the floors."""
        many = len(dormers) > ENOUGH * len(self.usual)
        return many and max(dormers) <= WIDEST * float(np.median(self.usual))


def favoured(belief: Probabilities, index: int, favour: float) -> Probabilities:
    """Return the belief with the odds of class `index` against all others times `favour`."""
    out = belief.copy()
    out[index] *= np.float32(favour)
    out /= out.sum(axis=0)
    return out


def _lowered(node: Node, by: int) -> Node:
    """Return a tree in a picture that has `by` more rows above it."""
    x0, y0, x1, y1 = node.scope
    children = tuple(_lowered(child, by) for child in node.children)
    return replace(node, scope=(x0, y0 + by, x1, y1 + by), children=children)
