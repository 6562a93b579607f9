"""The walk over all alignments of a candidate: what its compiled loops read, and what they find."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import kernels, kernels_labels, kernels_walk
from .bounds import Guide
from .candidates import Bounds
from .kernels_labels import FINAL, SOLID
from .paths import Path, decoded
from .problem import LEAST_SIZE, LEAST_UNSIZED, SLACK, Alignment, Candidate
from .rows import Integers, RowMaker, Rows

Floats = NDArray[np.float64]
NONE = 2**62
MOST_COLUMNS = 40
MOST_ROWS = 6
MOST_SYMBOLS = 30
MOST_LEAVES = 1_000  # that tie


class Net(NamedTuple):
    """What the walk reads of rows: see kernels.search."""

    starts: Integers
    places: Integers
    tally: Integers
    steps: Integers
    first: Integers
    rows: Integers
    stack: Integers
    limits: Integers
    guide: Guide
    order: Integers
    able: Integers
    ahead: Integers


class Sizes(NamedTuple):
    """What the walk reads of sizes, in shares of the canvas; k symbols, f unsized ones.

    least (k,). size (k,): 0 where unsized. free (k,): which unsized one, or -1. low, high (f,).
    counts (n, f), bounds (n, 2): eq. 7. total (m, k): letters of each row, if they are `fixed`.
    letter (places,): the symbol that a place lies inside of. widest (1,): greatest Σ. units (1,):
    of the canvas. table, height (2,): room for linear programmes.
    """

    least: Floats
    size: Floats
    free: Integers
    low: Floats
    high: Floats
    counts: Floats
    bounds: Floats
    total: Integers
    fixed: Integers
    letter: Integers
    widest: Floats
    units: Floats
    table: Floats
    height: Integers


class Frame(NamedTuple):
    """Where the walk stands, by column and row; see kernels_walk."""

    at: Integers
    option: Integers
    code: Integers
    taken: Integers
    now: Integers
    upper: Integers
    lower: Integers
    opaque: Integers
    cut: Integers
    low: Integers
    high: Integers
    reach: Integers
    omega: Integers
    sigma: Integers
    pieces: Integers
    rank: Integers
    held: Integers
    pivot: Integers
    basis: Floats
    lines: Floats
    form: Floats
    fill: Floats


@dataclass(slots=True)
class Walk:
    """A walk that can be gone on with; `done` when nothing is left."""

    rows: Rows
    net: Net
    sizes: Sizes
    frame: Frame
    best: Integers
    leaves: Integers
    units: float  # of a metre
    done: bool = False

    def go(self, steps: int) -> None:
        """Go on for so many steps."""
        self.done = bool(
            kernels_walk.walk(self.net, self.sizes, self.frame, self.best, self.leaves, steps)
        )

    @property
    def whole(self) -> bool:
        """Tell whether all that tie for the best are known."""
        return self.done and not self.best[kernels_walk.LOST]

    def know(self, alignment: Alignment) -> None:
        """Want nothing that is worse than an alignment."""
        omega = round(max(0.0, alignment.omega) * self.units)
        known = tuple(self.best[: kernels_walk.OFF].tolist())
        if (omega, alignment.pieces, -alignment.count) < (*known[:2], -known[2]):
            mine = omega, alignment.pieces, alignment.count, NONE
            self.best[: kernels_walk.SLACK] = mine
            self.best[kernels_walk.KEPT] = self.best[kernels_walk.LOST] = 0

    def paths(self) -> list[Path]:
        """Return the best alignments that have been found."""
        found = []
        for leaf in self.leaves[: int(self.best[kernels_walk.KEPT])]:
            count = int(np.argmax(leaf[:, 0] < 0)) if leaf[-1, 0] < 0 else len(leaf)
            found.append(decoded(self.rows, leaf[:count]))
        return found


def walk_of(
    maker: RowMaker, candidate: Candidate, bounds: tuple[Bounds, ...], rows: Rows, limits: Integers,
    guide: Guide,
) -> Walk | None:  # fmt: skip
    """Return a walk over a candidate's alignments, or None where it is not small.

    rows: not merged. limits: of kernels.search.
    """
    m = len(rows.lattices)
    order, able = kernels.row_order(m, rows.info[:, SOLID])
    ahead = kernels.letters_ahead(m, rows.starts, rows.places, rows.steps)
    columns = _most_columns(rows)
    kinds = rows.tally.shape[1]
    if m > MOST_ROWS or columns > MOST_COLUMNS or kinds > MOST_SYMBOLS:
        return None
    net = Net(
        rows.starts, rows.places, rows.tally, rows.steps, rows.first, rows.info, rows.stack, limits,
        guide, order, able, ahead,
    )  # fmt: skip
    sizes = _sizes(maker, candidate, bounds, rows, limits)
    best = np.full(kernels_walk.LOST + 1, NONE, np.int64)
    best[kernels_walk.OMEGA] = limits[kernels_labels.BUDGET]
    best[kernels_walk.COLUMNS] = 0
    slack = SLACK * maker.direction.canvas * maker.scale.units
    best[kernels_walk.SLACK] = int(slack) if len(sizes.low) else 0
    best[kernels_walk.KEPT] = best[kernels_walk.LOST] = 0
    leaves = np.full((MOST_LEAVES, columns + 1, m), -1, np.int64)
    frame = _frame(rows, columns, kinds)
    return Walk(rows, net, sizes, frame, best, leaves, maker.scale.units)


def _most_columns(rows: Rows) -> int:
    """Return how many columns there can be, one more: each has an opaque letter of its own."""
    return int(rows.info[:, SOLID].sum()) + 1


def _finals(rows: Rows, row: int) -> Integers:
    """Return the letters before each node that ends a row's words."""
    at = np.arange(rows.starts[row], rows.starts[row + 1])
    out: Integers = rows.tally[at[rows.places[at, FINAL] == 1]]
    return out


def _frame(rows: Rows, columns: int, kinds: int) -> Frame:
    m = len(rows.lattices)

    def table(*shape: int) -> Any:
        return np.zeros(shape, np.int64)

    more = columns + 1  # borders
    parts: list[Any] = [
        table(1), table(more, m), table(more + 1, m), table(more, m), table(more, m),
        *(table(more, m + 1) for _ in range(4)), table(more, m), table(more, m),
        table(more + 1, m, 2), *(table(more + 1) for _ in range(5)), table(kinds),
        np.zeros((kinds, kinds)), np.zeros((2 * m * more, kinds)), np.zeros((more + 1, m, kinds)),
        np.zeros((more + 1, kinds)),
    ]  # fmt: skip
    frame = Frame(*parts)
    frame.code[0] = 4 * rows.starts[:-1]
    frame.lower[0, 0] = NONE
    return frame


def _sizes(
    maker: RowMaker, candidate: Candidate, bounds: tuple[Bounds, ...], rows: Rows, limits: Integers
) -> Sizes:
    direction, canvas = maker.direction, maker.direction.canvas
    names = rows.names
    size = np.array([(direction.rules[n].size or 0.0) / canvas for n in names])
    box = {name: (low / canvas, high / canvas) for name, low, high in candidate.unsized}
    free = list(box)
    counts = np.zeros((len(bounds), len(free)))
    for i, row in enumerate(bounds):
        for name, times in row.counts:
            counts[i, free.index(name)] = times
    lines = [((b.least - b.known) / canvas, (b.greatest - b.known) / canvas) for b in bounds]
    m, columns = len(rows.lattices), _most_columns(rows)
    finals = [_finals(rows, row) for row in range(m)]
    height = (
        6 * m * (columns + 1) + 2 * len(bounds) + len(free) + 2 * len(names) + 8,
        2 * (m + 1) * (columns + 1) + len(free) + len(names) + 8,
    )
    return Sizes(
        np.array([LEAST_SIZE * s if s else LEAST_UNSIZED for s in size]),
        size,
        np.array([free.index(n) if n in box else -1 for n in names], np.int64),
        np.array([box[n][0] for n in free], np.float64),
        np.array([box[n][1] for n in free], np.float64),
        counts,
        np.array(lines, np.float64).reshape(-1, 2),
        np.array([tallies[0] for tallies in finals]),
        np.array([int((tallies == tallies[0]).all()) for tallies in finals], np.int64),
        rows.letters,
        np.array([limits[kernels_labels.WIDEST] / (maker.scale.units * canvas)]),
        np.array([maker.scale.units * canvas]),
        np.zeros(height),
        np.array(height, np.int64),
    )
