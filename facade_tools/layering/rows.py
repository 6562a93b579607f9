"""A candidate as the integer arrays that the compiled search reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .kernels_labels import (
    AFTER,
    ASKS,
    BEFORE,
    COVER,
    DEPTH,
    FINAL,
    HAS_GRIPS,
    HIGH,
    IS_BARE,
    IS_CLEAR,
    IS_SOLID,
    LEAST,
    LOW,
    MOST,
    OPEN,
    REST,
    SPELLING,
    SPELT,
    TO_PLACE,
)
from .kernels_segments import (
    AHEAD,
    ATTACHED,
    BARE_STEP,
    BEHIND,
    CLEAR,
    CLEAR_STEP,
    END,
    FROM,
    GRIPS_STEP,
    HEAD,
    RANK,
    SEGMENT,
    SOLID_STEP,
    SOURCE,
    START,
    TAIL,
    TARGET,
    TO,
    column_steps,
    whole_segments,
)
from .lattice import Lattice
from .problem import Direction
from .scale import scale_of
from .words import Letter, Word

Integers = NDArray[np.int64]
Keys = NDArray[np.uint64]
Box = Mapping[str, tuple[float, float]]
FIRST_SEGMENTS = 2_000
MOST_GRAPHS = 2_000  # remembered
MOST_SEGMENTS = 3_000_000
INSIDE = np.uint64(0xBF58476D1CE4E5B9)


class TooLarge(Exception):
    """A row has more places or segments than the search can hold."""


class Graph(NamedTuple):
    """A lattice's arrays without sizes: see kernels_segments for the columns.

    tally (nodes, symbols): letters before each node. keys: their hash. opens: edges whose insides
    are places after the nodes.
    """

    edges: Integers
    segments: Integers
    steps: Integers
    tally: Integers
    keys: Keys
    after: Integers  # 1 where the letter before a node is attached
    opens: Integers
    finals: Integers
    opaque: int  # opaque letters of a word, at most
    cover: Integers  # (nodes, symbols) opaque letters before each node


@dataclass(frozen=True, slots=True)
class Rows:
    """The flat arrays of a candidate; see kernels.search.

    layers[row] are the layers whose word the row is: equal words that hold nothing unoccludable
    are one row. names: the symbols that tally counts; letters (places,): which of them a place
    lies inside of, or -1.
    """

    starts: Integers
    places: Integers
    tally: Integers
    keys: Keys
    steps: Integers
    first: Integers
    info: Integers
    stack: Integers
    spelling: tuple[Integers, Integers, Integers, Integers]
    lattices: tuple[Lattice, ...]
    layers: tuple[tuple[int, ...], ...]
    names: tuple[str, ...]
    letters: Integers

    @property
    def narrowest(self) -> int:
        """Return the least size of an opaque letter."""
        sizes = self.steps[self.steps[:, IS_SOLID] == 1, LOW]
        return int(sizes.min(initial=2**62))


class RowMaker:
    """Makes rows of candidates of one direction; lattices seen before are looked up."""

    def __init__(self, direction: Direction) -> None:
        self.direction = direction
        self.scale = scale_of(direction)
        self.names = sorted(direction.rules)
        self.index = {name: i for i, name in enumerate(self.names)}
        signs = sorted([*self.names, *(f"~{name}" for name in self.names)])
        self.ranks = {name: i for i, name in enumerate(signs)}
        self.hashes = np.array([_key(name) for name in self.names], np.uint64)
        self._graphs: dict[tuple[object, bool], Graph] = {}

    def rows(self, lattices: Sequence[Lattice], box: Box, merge: bool, splits: bool) -> Rows:
        """Return the arrays of the lattices; `box` holds the range of every unsized symbol (m)."""
        grouped = self.grouped(lattices, merge)
        distinct = [lattices[layers[0]] for layers in grouped]
        graphs = [self.graph(lattice, splits) for lattice in distinct]
        used = sorted({self.index[e.letter.symbol] for one in distinct for e in one.edges})
        ranges = [self._range(self.names[i], box) for i in used]
        ends = np.array(ranges, np.int64).reshape(-1, 2)
        parts = [
            _part(graph, lattice, used, ends)
            for graph, lattice in zip(graphs, distinct, strict=True)
        ]
        counts = np.cumsum([0, *(len(part.places) for part in parts)], dtype=np.int64)
        offsets = np.cumsum([0, *(len(part.steps) for part in parts)], dtype=np.int64)
        spelt = np.cumsum([0, *(len(graph.segments) for graph in graphs)], dtype=np.int64)
        edges = np.cumsum([0, *(len(graph.edges) for graph in graphs)], dtype=np.int64)
        for i, part in enumerate(parts):
            part.steps[:, TO_PLACE] += counts[i]
            part.steps[:, SPELLING] += np.where(part.steps[:, SPELLING] < 0, 0, spelt[i])
            part.places[:, SPELT] += np.where(part.places[:, SPELT] < 0, 0, edges[i])
        heads = [g.segments[:, HEAD] + e for g, e in zip(graphs, edges, strict=False)]
        tails = [
            g.segments[:, TAIL] + np.where(g.segments[:, TAIL] < 0, 0, s)
            for g, s in zip(graphs, spelt, strict=False)
        ]
        return Rows(
            counts,
            np.concatenate([part.places for part in parts]),
            np.ascontiguousarray(np.concatenate([part.tally for part in parts])),
            np.concatenate([part.keys for part in parts]),
            np.concatenate([part.steps for part in parts]),
            np.concatenate(
                [[0], *(part.first[1:] + o for part, o in zip(parts, offsets, strict=False))]
            ),
            self._info(distinct, graphs, grouped),
            _stack(grouped),
            (
                np.concatenate([graph.edges[:, RANK] for graph in graphs]),
                np.concatenate(heads),
                np.concatenate(tails),
                np.array([not lattice.single for lattice in distinct], np.int64),
            ),
            tuple(distinct),
            tuple(map(tuple, grouped)),
            tuple(self.names[i] for i in used),
            self._letters(distinct, graphs, used),
        )

    def _letters(
        self, lattices: Sequence[Lattice], graphs: Sequence[Graph], used: list[int]
    ) -> Integers:
        """Return which of the symbols each place lies inside of; -1 for nodes."""
        out = []
        for lattice, graph in zip(lattices, graphs, strict=True):
            out += [-1] * lattice.size
            for at in graph.opens:
                out.append(used.index(self.index[lattice.edges[at].letter.symbol]))
        return np.array(out, np.int64)

    def _info(
        self, lattices: Sequence[Lattice], graphs: Sequence[Graph], grouped: list[list[int]]
    ) -> Integers:
        """Return opaque letters, layers, and whether a row must be empty in some column.

        A word whose letters are a part of another's is shorter in every sizing, so that both fill
        the canvas only with the shorter one empty somewhere.
        """
        totals = np.array([graph.tally[-1] for graph in graphs])
        part = (totals[:, None] <= totals[None]).all(axis=2)
        known = np.array([len(lattice.words) == 1 for lattice in lattices])
        needs = (part & ~part.T & known[:, None] & known[None]).any(axis=1)
        rows = zip(graphs, grouped, needs, strict=True)
        return np.array([(graph.opaque, len(layers), gap) for graph, layers, gap in rows], np.int64)

    def grouped(self, lattices: Sequence[Lattice], merge: bool) -> list[list[int]]:
        """Return the layers of each row: equal words are one, if they may `merge`."""
        groups: list[list[int]] = []
        known: dict[Word, list[int]] = {}
        for layer, lattice in enumerate(lattices):
            word = lattice.word
            if merge and lattice.single and word in known:
                known[word].append(layer)
                continue
            groups.append([layer])
            if lattice.single and not any(
                self.direction.rules[a.symbol].unoccludable for a in word
            ):
                known[word] = groups[-1]
        return groups

    def _range(self, name: str, box: Box) -> tuple[int, int]:
        size = self.direction.rules[name].size
        if size is not None:
            return self.scale.of(size), self.scale.of(size)
        return self.scale.down(box[name][0]), self.scale.up(box[name][1])

    def graph(self, lattice: Lattice, splits: bool) -> Graph:
        """Return the arrays of a lattice. Raises TooLarge."""
        key = (lattice.word if lattice.single else lattice), splits
        if key not in self._graphs:
            if len(self._graphs) > MOST_GRAPHS:
                self._graphs.clear()
            self._graphs[key] = self._graph(lattice, splits)
        return self._graphs[key]

    def _graph(self, lattice: Lattice, splits: bool) -> Graph:
        edges = np.array([self._edge(*edge) for edge in lattice.edges], np.int64).reshape(-1, 7)
        symbols = [self.index[edge.letter.symbol] for edge in lattice.edges]
        tally = np.zeros((lattice.size, len(self.names)), np.int64)
        after = np.zeros(lattice.size, np.int64)
        for (start, end, _), symbol in zip(lattice.edges, symbols, strict=True):
            tally[end] = tally[start]
            tally[end, symbol] += 1
        after[edges[:, TO]] = edges[:, ATTACHED]
        segments = _grown(lambda most: whole_segments(lattice.size, edges, most))
        steps = _grown(lambda most: column_steps(lattice.size, edges, segments, splits, most))
        opens = np.flatnonzero(edges[:, CLEAR]) if splits else np.zeros(0, np.int64)
        finals = np.zeros(lattice.size, np.int64)
        finals[list(lattice.finals)] = 1
        cover = np.zeros((lattice.size, len(self.names)), np.int64)
        for (start, end, letter), symbol in zip(lattice.edges, symbols, strict=True):
            cover[end] = cover[start]
            cover[end, symbol] += self.direction.is_opaque(letter)
        opaque = int(cover.sum(axis=1).max())
        keys = _hashes(tally, self.hashes)
        return Graph(edges, segments, steps, tally, keys, after, opens, finals, opaque, cover)

    def _edge(self, start: int, end: int, letter: Letter) -> tuple[int, ...]:
        rule = self.direction.rules[letter.symbol]
        return (
            start, end, self.ranks[letter.name], letter.transparent,
            self.direction.is_opaque(letter), rule.unoccludable, rule.attached,
        )  # fmt: skip

    def lines(self, lattice: Lattice, name: str) -> set[tuple[int, float]]:
        """Return (count, known) of all segments: each is count · size(name) + known metres."""
        graph = self.graph(lattice, False)
        span = graph.tally[graph.segments[:, END]] - graph.tally[graph.segments[:, START]]
        known = np.round(span @ [self.direction.rules[n].size or 0.0 for n in self.names], 9)
        return set(zip(span[:, self.index[name]].tolist(), known.tolist(), strict=True))

    def place_key(self, word: Word, letters: int, inside: bool) -> int:
        """Return the hash of a place: of the letters before it, and of the one it lies inside."""
        value = sum(int(self.hashes[self.index[a.symbol]]) for a in word[:letters])
        if inside:
            value += int(self.hashes[self.index[word[letters].symbol]]) * int(INSIDE)
        return value & (2**64 - 1)


class _Part(NamedTuple):
    places: Integers
    tally: Integers
    keys: Keys
    steps: Integers
    first: Integers


def _part(graph: Graph, lattice: Lattice, used: list[int], ends: Integers) -> _Part:
    """Return a row's places and steps with sizes: `ends` (symbols, 2), in units."""
    tally = graph.tally[:, used]
    low, high = (tally @ ends).T
    edges, opens = graph.edges[graph.opens], graph.opens
    size = lattice.size
    places = np.zeros((size + len(opens), 11), np.int64)
    places[:size, REST] = _rest(graph, low)
    places[:size, BEFORE] = low
    places[:size, COVER] = graph.cover[:, used] @ ends[:, 0]
    places[:size, DEPTH] = 2 * tally.sum(axis=1)
    places[:size, AFTER] = graph.after
    np.maximum.at(places[:, ASKS], graph.edges[:, FROM], graph.edges[:, ATTACHED])
    places[:size, FINAL] = graph.finals
    places[:, SPELT] = -1
    inside = places[size:]
    inside[:, REST] = places[edges[:, FROM], REST]
    inside[:, BEFORE] = low[edges[:, FROM]]
    inside[:, DEPTH] = places[edges[:, FROM], DEPTH] + 1
    inside[:, OPEN] = 1
    inside[:, LEAST] = low[edges[:, TO]] - low[edges[:, FROM]]
    inside[:, MOST] = high[edges[:, TO]] - high[edges[:, FROM]]
    inside[:, SPELT] = opens
    steps = graph.steps
    span = low[steps[:, AHEAD]] - low[steps[:, BEHIND]]
    order = np.lexsort((span, steps[:, SOURCE]))
    steps, span = steps[order], span[order]
    out = np.empty((len(steps), 8), np.int64)
    out[:, TO_PLACE], out[:, LOW] = steps[:, TARGET], span
    out[:, HIGH] = high[steps[:, AHEAD]] - high[steps[:, BEHIND]]
    out[:, IS_CLEAR], out[:, IS_SOLID] = steps[:, CLEAR_STEP], steps[:, SOLID_STEP]
    out[:, IS_BARE], out[:, HAS_GRIPS] = steps[:, BARE_STEP], steps[:, GRIPS_STEP]
    out[:, SPELLING] = np.where(lattice.single, -1, steps[:, SEGMENT])
    first = np.searchsorted(steps[:, SOURCE], np.arange(len(places) + 1))
    letters = _letter_keys(graph, edges)
    keys = np.concatenate([graph.keys, graph.keys[edges[:, FROM]] + letters * INSIDE])
    counts = np.concatenate([tally, tally[edges[:, FROM]]])
    return _Part(places, counts, keys, out, first.astype(np.int64))


def _rest(graph: Graph, low: Integers) -> Integers:
    """Return the least size that follows each node."""
    if graph.finals.sum() == 1 or len({*low[graph.finals == 1].tolist()}) == 1:
        out: Integers = low.max() - low
        return out
    rest = np.where(graph.finals == 1, 0, 2**62)
    for start, end in graph.edges[::-1, [FROM, TO]]:
        rest[start] = min(rest[start], rest[end] + low[end] - low[start])
    return rest


def _stack(grouped: list[list[int]]) -> Integers:
    """Return the row of each layer."""
    rows = {layer: row for row, layers in enumerate(grouped) for layer in layers}
    return np.array([rows[layer] for layer in sorted(rows)], np.int64)


def _letter_keys(graph: Graph, edges: Integers) -> Keys:
    keys: Keys = graph.keys[edges[:, TO]] - graph.keys[edges[:, FROM]]
    return keys


def _hashes(tally: Integers, hashes: Keys) -> Keys:
    """Return the hash of each row of counts; overflow is meant."""
    out: Keys = (tally.astype(np.uint64) * hashes).sum(axis=1, dtype=np.uint64)
    return out


def _grown(make: Callable[[int], tuple[Integers, int]]) -> Integers:
    """Return a table of whatever length it needs. Raises TooLarge."""
    most = FIRST_SEGMENTS
    while True:
        table, count = make(most)
        if count <= most:
            kept: Integers = table[:count]
            return kept
        if most >= MOST_SEGMENTS:
            raise TooLarge
        most *= 8


def _key(name: str) -> int:
    return int.from_bytes(blake2b(name.encode(), digest_size=8).digest(), "little")
