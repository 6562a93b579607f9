"""Learning from any mixed table: columns in groups of continuous values, columns of bits."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, NamedTuple, cast

import numpy as np

from ..artifacts.model import Model
from ..artifacts.store import RawItem
from ..errors import InvalidInput, Place
from .coordinates import Bits, Floats, Readings, join
from .evaluation import row_log_density
from .groups import ATOM_TOLERANCE, BitGroup, Coordinate
from .layout import UNBOUNDED, GroupLayout, Layout, atom_channel, merged
from .learning import LearnOptions, learn_readings
from .serialisation import network_of
from .table_groups import ID, ColumnGroup, Declaration, read_declaration
from .transforms import EDGE, TRANSFORMS

LEAST_FLOOR = 0.01  # default least standard deviation, in standard deviations of the column

Refuse = Callable[[InvalidInput], None]


@dataclass(frozen=True, slots=True)
class Table:
    """Rows with their ids and places, and columns (n,) by name, NaN where a cell is empty.

    header: the names of all columns of the file, also of those that were not read.
    """

    ids: tuple[str, ...]
    places: tuple[Place, ...]
    columns: Mapping[str, Floats]
    header: tuple[str, ...]

    def take(self, rows: Sequence[int]) -> Table:
        """Return some of the rows."""
        index = np.array(rows, dtype=np.int64)
        columns = {name: column[index] for name, column in self.columns.items()}
        ids, places = tuple(self.ids[i] for i in rows), tuple(self.places[i] for i in rows)
        return Table(ids, places, columns, self.header)


class Limit(NamedTuple):
    """What the cells of a column may hold: numbers of a range, or one of some values."""

    column: str
    least: float
    most: float
    values: tuple[float, ...]
    expected: str


def stop(error: InvalidInput) -> None:
    """Raise the error of a row: what is done with bad rows where nobody wants to skip them."""
    raise error


@dataclass(frozen=True, slots=True)
class TableRows:
    """The rows of a table to learn from: layout, readings, and the (first) file they come from."""

    layout: Layout
    readings: Readings
    source: str

    def __len__(self) -> int:
        return len(self.readings)

    def learn(
        self, rows: Sequence[int], options: LearnOptions, *, rng: np.random.Generator
    ) -> Model:
        """Return the model of some of the rows."""
        layout = merged(self.layout) if options.variant == "gmm" else self.layout
        readings = self.under(layout).take(np.array(rows, dtype=np.int64))
        try:
            return learn_readings(readings, layout, rng=rng, options=options)
        except InvalidInput as error:
            raise error.at(self.source) from None

    def foresee(self, model: Model, rows: Sequence[int]) -> Floats:
        """Return the negative log density (n,) of some of the rows, nats."""
        network = network_of(model)
        readings = self.under(network.layout).take(np.array(rows, dtype=np.int64))
        return -row_log_density(network, readings)

    def under(self, layout: Layout) -> Readings:
        """Return the readings as a layout of these columns has them: merged or by group."""
        return (
            self.readings if len(layout.groups) == len(self.layout.groups) else join(self.readings)
        )


def table_rows(items: Sequence[RawItem], groups: str, refuse: Refuse = stop) -> TableRows:
    """Return the rows of a table (CSV with a header; empty cells are unobserved).

    groups: path of the declaration. refuse: takes the errors of single rows; where it returns, the
    row is left out.
    """
    declaration = read_declaration(groups)
    table = read_table(items, declaration.columns, refuse)
    try:
        limits = declared_limits(table, declaration)
        layout, readings = table_readings(within(table, limits, refuse), declaration)
    except InvalidInput as error:
        raise error.at(groups) from None
    return TableRows(layout, readings, items[0].source)


def learn_table(
    items: Sequence[RawItem], groups: str, *, rng: np.random.Generator, options: LearnOptions
) -> Model:
    """Return the model of a table, as `table_rows` reads it."""
    rows = table_rows(items, groups)
    return rows.learn(range(len(rows)), options, rng=rng)


# --- the rows -----------------------------------------------------------------------------------


def read_table(
    items: Sequence[RawItem],
    columns: Sequence[str],
    refuse: Refuse = stop,
    *,
    needed: bool = False,
) -> Table:
    """Return rows and `columns` of CSV files with the same header; bad rows go to `refuse`.

    What other columns hold does not matter. Raises InvalidInput where the header lacks one of
    `columns` and all are `needed`.
    """
    ids: list[str] = []
    rows: list[list[float]] = []
    places: list[Place] = []
    seen: set[str] = set()
    header: list[str] | None = None
    for item in items:
        lines = _lines(item)
        _, first = next(lines, (1, None))
        if first is None or (header is not None and first != header):
            message = "has no header, or another than the first file"
            raise InvalidInput(message).at(item.source)
        header = _header(first, columns, item.source, needed=needed)
        for count, (line, cells) in enumerate(lines, start=2):
            try:
                row = _numbers(cells, header, columns)
                ids.append(_identity(cells, header, seen) if ID in header else str(count))
            except InvalidInput as error:
                refuse(error.at(item.source, line))
                continue
            rows.append(row)
            places.append(Place(item.source, line))
    names = [name for name in header or [] if name in columns]
    table = np.array(rows, dtype=np.float64).reshape(len(rows), len(names))
    read = {name: table[:, i] for i, name in enumerate(names)}
    return Table(tuple(ids), tuple(places), read, tuple(header or ()))


def _lines(item: RawItem) -> Iterator[tuple[int, list[str]]]:
    """Yield the records of a file, each with the line on which it ends; blank lines are none."""
    try:
        reader = csv.reader(io.StringIO(item.data.decode("utf-8-sig"), newline=""))
        for cells in reader:
            if cells:
                yield reader.line_num, cells
    except UnicodeDecodeError as error:
        message = f"not UTF-8 text (byte {error.start}); expected a CSV table"
        raise InvalidInput(message).at(item.source) from None
    except csv.Error as error:
        raise InvalidInput(f"no CSV: {error}").at(item.source, reader.line_num) from None


def _header(cells: list[str], columns: Sequence[str], source: str, *, needed: bool) -> list[str]:
    for name in (ID, *columns):
        if cells.count(name) > 1:
            message = f"column {name!r} stands twice; expected unique names"
            raise InvalidInput(message).at(source, 1)
        if needed and name != ID and name not in cells:
            message = f"has no column {name!r}; expected {', '.join(columns)}"
            raise InvalidInput(message).at(source, 1)
    return cells


def _identity(cells: list[str], header: list[str], seen: set[str]) -> str:
    identity = cells[header.index(ID)]
    if identity in seen:
        raise InvalidInput(f"id {identity!r} stands twice; expected unique ids")
    seen.add(identity)
    return identity


def _numbers(cells: list[str], header: list[str], columns: Sequence[str]) -> list[float]:
    if len(cells) != len(header):
        raise InvalidInput(f"{len(cells)} cells; expected {len(header)}")
    rows = zip(header, cells, strict=True)
    return [_number(cell, name) for name, cell in rows if name in columns]


def _number(cell: str, column: str) -> float:
    if not cell.strip():
        return np.nan
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not isfinite(value):
        message = f"{cell[:40]!r} in column {column!r}; expected a finite number or an empty cell"
        raise InvalidInput(message)
    return value


# --- what the cells may hold --------------------------------------------------------------------


def declared_limits(table: Table, declaration: Declaration) -> list[Limit]:
    """Return the limits of all columns. Raises InvalidInput on one that the table lacks."""
    out = []
    for group, row in declaration.groups.items():
        for name in row.columns:
            _present(table, name, f"/groups/{group}")
            out.append(column_limit(name, row.transform, row.atoms))
    for group, names in declaration.bits.items():
        for name in names:
            _present(table, name, f"/bits/{group}")
            out.append(bit_limit(name))
    return out


def layout_limits(layout: Layout) -> list[Limit]:
    """Return the limits of the columns that a model is over."""
    coordinates = [c for group in layout.groups for c in group.coordinates]
    numbers = [column_limit(c.name, c.transform, c.atoms) for c in coordinates]
    return [*numbers, *map(bit_limit, columns_of(layout)[len(numbers) :])]


def columns_of(layout: Layout) -> tuple[str, ...]:
    """Return the columns that a layout is over: numbers in the order of its groups, then bits."""
    numbers = [c.name for group in layout.groups for c in group.coordinates]
    return (*numbers, *(bit for group in layout.bit_groups for bit in group.bits))


def column_limit(name: str, transform: str, atoms: tuple[float, ...]) -> Limit:
    """Return the interval of a transform: outside it values would count as its nearest end."""
    least, most = TRANSFORMS[transform].lowest, TRANSFORMS[transform].highest
    least = least - EDGE if transform == "log-above-1" else least  # it is defined at 1 itself
    also = f" or one of {list(atoms)}" if atoms else ""
    expected = f"expected {least:g} to {most:.7g} ({transform}){also}; perhaps in another unit"
    return Limit(name, least, most, atoms, expected)


def bit_limit(name: str) -> Limit:
    """Return what a column of bits may hold."""
    return Limit(name, inf, -inf, (0.0, 1.0), "expected 0, 1 or an empty cell")


def _present(table: Table, name: str, pointer: str) -> None:
    if name not in table.columns:
        names = ", ".join(map(repr, table.header))
        message = f"the table has no column {name!r}; expected one of {names}"
        raise InvalidInput(message, pointer=pointer)


def within(table: Table, limits: Sequence[Limit], refuse: Refuse = stop) -> Table:
    """Return the rows that keep all limits; the others go to `refuse`."""
    bad: dict[int, InvalidInput] = {}
    for limit in limits:
        column = table.columns[limit.column]
        good = np.isnan(column) | ((column >= limit.least) & (column <= limit.most))
        for value in limit.values:
            good |= np.abs(column - value) <= (ATOM_TOLERANCE if limit.least < inf else 0.0)
        for i in np.flatnonzero(~good).tolist():
            message = f"{column[i]:g} in column {limit.column!r}; {limit.expected}"
            bad.setdefault(i, InvalidInput(message, table.places[i]))
    for i in sorted(bad):
        refuse(bad[i])
    return table.take([i for i in range(len(table.ids)) if i not in bad]) if bad else table


# --- to readings --------------------------------------------------------------------------------


def table_readings(table: Table, declaration: Declaration) -> tuple[Layout, Readings]:
    """Return layout and readings of a table whose columns keep the declared limits.

    Raises InvalidInput where two columns would mean one thing.
    """
    groups = tuple(
        _layout(name, row, np.stack([table.columns[c] for c in row.columns], axis=1))
        for name, row in declaration.groups.items()
    )
    bit_groups = tuple(BitGroup(name, columns) for name, columns in declaration.bits.items())
    layout = Layout(groups, bit_groups)
    repeated = [name for name, count in Counter(layout.features).items() if count > 1]
    if repeated:
        message = f"{repeated[0]!r} means two things; expected another name of a column"
        raise InvalidInput(message, pointer="/groups")
    return layout, readings_of(table, layout)


def readings_of(table: Table, layout: Layout) -> Readings:
    """Return the rows of a table as a layout of its columns sees them."""
    count = len(table.ids)
    empty = np.empty((count, 0), dtype=np.int8)
    values = tuple(
        np.stack([table.columns[c.name] for c in group.coordinates], axis=1)
        for group in layout.groups
    )
    bits = [_bits(table.columns[bit]) for group in layout.bit_groups for bit in group.bits]
    table_bits = np.stack(bits, axis=1) if bits else empty
    return Readings(table.ids, values, tuple(empty for _ in values), table_bits)


def _layout(name: str, row: ColumnGroup, table: Floats) -> GroupLayout:
    spread = _spread(table)
    coordinates = tuple(
        Coordinate(
            column,
            cast("Any", row.transform),
            float(row.floor or max(LEAST_FLOOR * spread[i], 1e-9)),
            row.atoms,
            -UNBOUNDED,
            UNBOUNDED,
        )
        for i, column in enumerate(row.columns)
    )
    channels = tuple(atom_channel(c, i) for i, c in enumerate(coordinates) if row.atoms)
    return GroupLayout(name, "table", coordinates, channels, (-1,) * len(coordinates))


def _spread(table: Floats) -> Floats:
    """Return the standard deviations (d,) of what is observed, 0 where nothing is."""
    seen = ~np.isnan(table).all(axis=0)
    spread = np.zeros(table.shape[1])
    if seen.any():
        spread = np.nanstd(np.where(seen, table, 0.0), axis=0)
    return spread


def _bits(column: Floats) -> Bits:
    return np.where(np.isnan(column), -1, column).astype(np.int8)
