"""From a solver's cuttings to the derivation tree, regions and floors of a parse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ..artifacts.grammar import Node
from ..artifacts.parse import Floor, Region
from ..grammar.derivation import leaves, nodes
from ..grammar.expressions import automaton, parse
from ..grammar.plan import Plan
from ..grammar.segments import Cut
from .energy import Layout


@dataclass(frozen=True, slots=True)
class Frame:
    """From working pixels (rows from the bottom) to pixels of the picture (y down).

    working, picture: (height, width).
    """

    working: tuple[int, int]
    picture: tuple[int, int]

    def x(self, at: int) -> int:
        """Return a column's border in the picture."""
        return round(at * self.picture[1] / self.working[1])

    def y(self, at: int) -> int:
        """Return a row's border in the picture; `at` counts from the bottom."""
        return round((self.working[0] - at) * self.picture[0] / self.working[0])


@dataclass(slots=True)
class _Open:
    """An instance whose rows are still coming."""

    symbol: str
    low: int
    children: list[Node] = field(default_factory=list)
    bands: list[tuple[int, int, int]] = field(default_factory=list)
    columns: Cut | None = None


def derivation(plan: Plan, layout: Layout, frame: Frame) -> Node:
    """Return the tree of a layout, scopes in pixels of the picture."""
    return _Builder(plan, layout, frame).tree()


class _Builder:
    def __init__(self, plan: Plan, layout: Layout, frame: Frame) -> None:
        self.plan, self.layout, self.frame = plan, layout, frame
        self.open: list[_Open] = [_Open(plan.grammar.axiom, 0)]
        self.roots: list[Node] = []

    def tree(self) -> Node:
        """Open and close instances along the rows."""
        rows = self.layout.rows
        before = -1
        for i, number in enumerate(rows.states):
            state = self.plan.states[number]
            shared = self.plan.rows.follow[before][number] if before >= 0 else 1
            self._close(shared, rows.bounds[i])
            self.open += [_Open(name, rows.bounds[i]) for name in state.path[len(self.open) :]]
            row = (number, rows.bounds[i], rows.bounds[i + 1])
            if state.group is None:
                scope = self._scope(0, row[1], self.frame.working[1], row[2])
                leaf = Node(state.parts[0], scope, label=state.labels[0])
                self.open[-1].children.append(leaf)
            else:
                self.open[-1].bands.append(row)
                self.open[-1].columns = self.layout.columns[self.layout.owner[i]]
            before = number
        self._close(0, rows.bounds[-1])
        return self.roots[0]

    def _scope(self, x0: int, low: int, x1: int, high: int) -> tuple[float, ...]:
        frame = self.frame
        return (frame.x(x0), frame.y(high), frame.x(x1), frame.y(low))

    def _close(self, depth: int, high: int) -> None:
        while len(self.open) > depth:
            done = self.open.pop()
            children = self._tiles(done) if done.bands else done.children
            rule = self.plan.grammar.rules[done.symbol]
            scope = self._scope(0, done.low, self.frame.working[1], high)
            node = Node(done.symbol, scope, rule.split, None, tuple(children))
            (self.open[-1].children if self.open else self.roots).append(node)

    def _tiles(self, row: _Open) -> list[Node]:
        """Return the parts of a row that is split to the right."""
        assert row.columns is not None
        out = []
        low, high = row.bands[0][1], row.bands[-1][2]
        cut = row.columns
        names = self.plan.groups[self._group(row)].automaton.symbols
        own = self._names(row.symbol, names)
        for kind, x0, x1 in zip(cut.states, cut.bounds, cut.bounds[1:], strict=False):
            scope = self._scope(x0, low, x1, high)
            if own[kind] in self.plan.grammar.terminals:
                label = self.plan.grammar.terminals[own[kind]]
                out.append(Node(own[kind], scope, label=label))
                continue
            bands = tuple(self._band(number, kind, (x0, a, x1, b)) for number, a, b in row.bands)
            out.append(Node(own[kind], scope, "up", None, bands))
        return out

    def _group(self, row: _Open) -> int:
        group = self.plan.states[row.bands[0][0]].group
        assert group is not None
        return group

    def _names(self, symbol: str, leader: list[str]) -> list[str]:
        """Return the parts of the row's own rule, in the places of its leader's."""
        own = automaton(parse(self.plan.grammar.rules[symbol].into)).symbols
        assert len(own) == len(leader)
        return own

    def _band(self, number: int, kind: int, box: tuple[int, int, int, int]) -> Node:
        state = self.plan.states[number]
        return Node(state.parts[kind], self._scope(*box), label=state.labels[kind])


def regions_of(tree: Node) -> tuple[Region, ...]:
    """Return the leaves as regions, those without pixels left out.

    Parts of one label that lie on each other in a tile are one region: a door is cut where its
    neighbours are cut, but stays a door.
    """
    return tuple(_parts(tree))


def _parts(node: Node) -> Iterator[Region]:
    if not node.children:
        x0, y0, x1, y1 = (round(v) for v in node.scope)
        if x1 > x0 and y1 > y0:
            yield Region(node.label or "", x0, y0, x1, y1)
        return
    parts = [part for child in node.children for part in _parts(child)]
    tile = node.split == "up" and not any(child.children for child in node.children)
    yield from _joined(parts) if tile else parts


def _joined(parts: Sequence[Region]) -> Iterator[Region]:
    """Yield the parts of a tile from the bottom, those of one label that touch as one."""
    for label, run in groupby(parts, key=lambda part: part.label):
        own = list(run)
        yield Region(label, own[0].x0, own[-1].y0, own[0].x1, own[0].y1)


def with_confidence(
    regions: tuple[Region, ...], probability: dict[str, NDArray[np.float32]], frame: Frame
) -> tuple[Region, ...]:
    """Return regions with the mean probability of their label, (height, width) planes, y down."""
    sums = {name: _summed(plane) for name, plane in probability.items()}
    across, down = (frame.working[1] / frame.picture[1], frame.working[0] / frame.picture[0])
    out = []
    for region in regions:
        x0, x1 = _pixels(region.x0 * across, region.x1 * across)
        y0, y1 = _pixels(region.y0 * down, region.y1 * down)
        table = sums[region.label]
        total = table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0]
        mean = float(total) / ((y1 - y0) * (x1 - x0))
        out.append(replace(region, confidence=min(max(mean, 0.0), 1.0)))
    return tuple(out)


def _pixels(low: float, high: float) -> tuple[int, int]:
    start = int(low + 0.5)
    stop = int(high + 0.5)
    return (start, stop) if stop > start else (max(0, stop - 1), max(0, stop - 1) + 1)


def _summed(plane: NDArray[np.float32]) -> NDArray[np.float64]:
    out = np.zeros((plane.shape[0] + 1, plane.shape[1] + 1))
    np.cumsum(np.cumsum(plane, axis=0, dtype=np.float64), axis=1, out=out[1:, 1:])
    return out


def floors_of(tree: Node) -> tuple[Floor, ...]:
    """Return the storeys of a derivation from the bottom: right splits that hold windows in tiles.

    What shares no columns with others (a ground floor) counts where it has windows.
    """
    out = []
    for node in nodes(tree):
        if node.split != "right" or not any(leaf.label == "window" for leaf in leaves(node)):
            continue
        borders = [node.scope[0], *(child.scope[2] for child in node.children)]
        x = tuple(round(at) for at in borders)
        out.append(Floor(node.symbol, round(node.scope[1]), round(node.scope[3]), x))
    return tuple(out)
