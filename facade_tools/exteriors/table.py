"""Learning from any mixed table: columns in groups of continuous values, columns of bits."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..artifacts.documents import parse_yaml
from ..artifacts.model import Model
from ..artifacts.store import unreadable
from ..errors import InvalidInput
from .coordinates import Bits, Floats, Readings
from .groups import BitGroup, Coordinate
from .layout import GroupLayout, Layout, atom_channel, merged
from .learning import LearnOptions, learn_readings
from .transforms import TRANSFORMS

MAX_CELLS = 50_000_000
LEAST_FLOOR = 0.01  # default least standard deviation, in standard deviations of the column
KEYS = {"columns", "transform", "floor", "atoms"}


@dataclass(frozen=True, slots=True)
class Declaration:
    """groups.yaml.

    `groups: {name: [columns] or {columns, transform, floor, atoms}}, bits: {name: [columns]}`.
    """

    groups: Mapping[str, Mapping[str, Any]]
    bits: Mapping[str, Sequence[str]]


def learn_table(
    paths: Sequence[str], groups: str, *, rng: np.random.Generator, options: LearnOptions
) -> Model:
    """Return the model of a table (CSV with a header; empty cells are unobserved)."""
    declaration = read_declaration(groups)
    ids, columns = read_table(paths)
    layout, readings = table_readings(ids, columns, declaration)
    if options.variant == "gmm":
        layout, readings = merged(layout), _joined(readings)
    return learn_readings(readings, layout, rng=rng, options=options)


def read_declaration(path: str) -> Declaration:
    """Return groups.yaml. Raises InvalidInput with the pointer of what is wrong."""
    try:
        document = parse_yaml(Path(path).read_bytes())
    except OSError as error:
        raise unreadable(path, error) from None
    except InvalidInput as error:
        raise error.at(path) from None
    if not isinstance(document, dict) or set(document) - {"groups", "bits"}:
        raise InvalidInput("expected an object with groups and bits", pointer="/").at(path)
    groups, bits = document.get("groups") or {}, document.get("bits") or {}
    if not isinstance(groups, dict) or not isinstance(bits, dict):
        raise InvalidInput("expected names with lists of columns", pointer="/groups").at(path)
    try:
        return Declaration({n: _group(n, g) for n, g in groups.items()}, bits)
    except InvalidInput as error:
        raise error.at(path) from None


def _group(name: str, value: Any) -> Mapping[str, Any]:
    row = {"columns": value} if isinstance(value, list) else value
    pointer = f"/groups/{name}"
    if not isinstance(row, dict) or set(row) - KEYS or not isinstance(row.get("columns"), list):
        raise InvalidInput(f"expected columns, or an object of {sorted(KEYS)}", pointer=pointer)
    if row.get("transform", "identity") not in TRANSFORMS:
        raise InvalidInput(f"expected one of {sorted(TRANSFORMS)}", pointer=f"{pointer}/transform")
    return row


def read_table(paths: Sequence[str]) -> tuple[tuple[str, ...], dict[str, Floats]]:
    """Return row ids and columns (NaN where a cell is empty) of CSV files with the same header."""
    ids: list[str] = []
    rows: list[list[float]] = []
    header: list[str] | None = None
    for path in paths:
        try:
            with Path(path).open(newline="", encoding="utf-8-sig") as file:
                reader = csv.reader(file)
                first = next(reader, None)
                if first is None or (header is not None and first != header):
                    raise InvalidInput("has no header, or another than the first file").at(path)
                header = first
                for line, cells in enumerate(reader, start=2):
                    ids.append(_identity(cells, header, line))
                    rows.append(_numbers(cells, header, path, line))
        except OSError as error:
            raise unreadable(path, error) from None
    table = np.array(rows, dtype=np.float64).reshape(len(rows), len(header or []))
    return tuple(ids), {name: table[:, i] for i, name in enumerate(header or [])}


def _identity(cells: list[str], header: list[str], line: int) -> str:
    return cells[header.index("id")] if "id" in header and cells else str(line)


def _numbers(cells: list[str], header: list[str], path: str, line: int) -> list[float]:
    if len(cells) != len(header):
        raise InvalidInput(f"{len(cells)} cells; expected {len(header)}").at(path, line)
    try:
        return [
            np.nan if name == "id" or not cell.strip() else float(cell)
            for name, cell in zip(header, cells, strict=True)
        ]
    except ValueError as error:
        raise InvalidInput(f"{error}; expected numbers").at(path, line) from None


def table_readings(
    ids: tuple[str, ...], columns: Mapping[str, Floats], declaration: Declaration
) -> tuple[Layout, Readings]:
    """Return layout and readings of a table. Raises InvalidInput on a column that is not there."""
    groups, values = [], []
    for name, row in declaration.groups.items():
        table = np.stack([_column(columns, c, name) for c in row["columns"]], axis=1)
        groups.append(_layout(name, row, table))
        values.append(table)
    bit_groups = tuple(BitGroup(n, tuple(map(str, c))) for n, c in declaration.bits.items())
    bits = [_bits(columns, str(c), n) for n, cs in declaration.bits.items() for c in cs]
    layout = Layout(tuple(groups), bit_groups)
    empty = np.empty((len(ids), 0), dtype=np.int8)
    table_bits = np.stack(bits, axis=1) if bits else empty
    return layout, Readings(ids, tuple(values), tuple(empty for _ in values), table_bits)


def _column(columns: Mapping[str, Floats], name: Any, group: str) -> Floats:
    if str(name) not in columns:
        raise InvalidInput(f"the table has no column {name!r}", pointer=f"/groups/{group}")
    return columns[str(name)]


def _layout(name: str, row: Mapping[str, Any], table: Floats) -> GroupLayout:
    spread = np.nan_to_num(np.nanstd(np.where(np.isfinite(table), table, np.nan), axis=0))
    atoms = tuple(map(float, row.get("atoms", ())))
    coordinates = tuple(
        Coordinate(
            str(column),
            cast("Any", row.get("transform", "identity")),
            float(row.get("floor", max(LEAST_FLOOR * spread[i], 1e-9))),
            atoms,
            -1e300,
            1e300,
        )
        for i, column in enumerate(row["columns"])
    )
    channels = tuple(atom_channel(c, i) for i, c in enumerate(coordinates) if atoms)
    return GroupLayout(name, "table", coordinates, channels, (-1,) * len(coordinates))


def _bits(columns: Mapping[str, Floats], name: str, group: str) -> Bits:
    column = _column(columns, name, group)
    if not np.isin(column[~np.isnan(column)], (0.0, 1.0)).all():
        raise InvalidInput(f"column {name!r} holds more than 0 and 1", pointer=f"/bits/{group}")
    return np.where(np.isnan(column), -1, column).astype(np.int8)


def _joined(readings: Readings) -> Readings:
    values = np.concatenate(readings.values, axis=1)
    return Readings(readings.ids, (values,), (readings.parts[0],), readings.bits)
