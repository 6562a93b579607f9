"""Assessors' tables (CSV) to attributes, by a mapping of their columns.

`docs/assessor.md` describes the mapping; one for the Ames table is built in.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO

from ..artifacts.attributes import (
    ROOF_BITS,
    Attributes,
    Bit,
    ElementAttributes,
    MassAttributes,
    Number,
    Present,
)
from ..errors import InvalidInput
from .reading import Built, ReadOptions, Record
from .xmltree import number

UNITS = {"ft2": 0.3048**2, "m2": 1.0}
LONGEST_LINE = 1 << 20
LEAST_COLUMNS = 4


@dataclass(frozen=True, slots=True)
class Choice:
    """A column and what its values mean."""

    column: str
    values: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Columns:
    """Which column of a table holds what.

    area_unit: ft2 or m2. upper_areas: columns that add up. roof: values are flat, gable, hip.
    garage: values are true (attached) and false. porches: areas of all kinds of porch.
    chimneys: a count.
    """

    id: str
    area_unit: str = "ft2"
    main_area: str | None = None
    upper_areas: tuple[str, ...] = ()
    roof: Choice | None = None
    garage: Choice | None = None
    porches: tuple[str, ...] = ()
    chimneys: str | None = None
    tags: tuple[str, ...] = ()


AMES = Columns(
    id="PID",
    main_area="1st Flr SF",
    upper_areas=("2nd Flr SF",),
    roof=Choice(
        "Roof Style",
        {
            "Gable": "gable",
            "Gambrel": "gable",
            "Shed": "gable",
            "Hip": "hip",
            "Mansard": "hip",
            "Flat": "flat",
        },
    ),
    garage=Choice(
        "Garage Type",
        {
            "Attchd": True,
            "BuiltIn": True,
            "Basment": True,
            "2Types": True,
            "Detchd": False,
            "CarPort": False,
            "": False,
        },
    ),
    porches=("Open Porch SF", "Enclosed Porch", "3Ssn Porch", "Screen Porch"),
    chimneys="Fireplaces",
    tags=("House Style", "Year Built", "Lot Area", "Garage Cars", "Garage Area"),
)


def detect(head: bytes) -> bool:
    """Tell a table by two lines of text with the same number of columns."""
    lines = head.split(b"\n")[:3]
    if len(lines) < 2 or b"\0" in head or head.lstrip()[:1] in (b"{", b"[", b"<"):
        return False
    try:
        rows = [next(csv.reader([line.decode("utf-8-sig")])) for line in lines[:2]]
    except (UnicodeDecodeError, csv.Error, StopIteration):
        return False
    return len(rows[0]) >= LEAST_COLUMNS and len(rows[0]) == len(rows[1])


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a row."""
    header = _row(stream.readline(LONGEST_LINE))
    columns = _columns(options.columns, header)
    number_ = 2
    while line := stream.readline(LONGEST_LINE):
        lines = 1
        while line.count(b'"') % 2 and (more := stream.readline(LONGEST_LINE)):
            line, lines = line + more, lines + 1
        if line.strip():
            yield Record((header, columns), line=number_, data=line)
        number_ += lines


def _row(line: bytes) -> list[str]:
    try:
        return [value.strip() for value in next(csv.reader([line.decode("utf-8-sig")]), [])]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidInput(f"is no row of a UTF-8 table: {error}") from None


def _columns(mapping: Mapping[str, Any] | None, header: Sequence[str]) -> Columns:
    if mapping is None:
        if _named(AMES) <= set(header):
            return AMES
        raise InvalidInput("a table of unknown columns; name them with --columns MAPPING.yaml")
    columns = parse_columns(mapping)
    missing = sorted(_named(columns) - set(header))
    if missing:
        raise InvalidInput(f"has no column {missing[0]!r}, which the mapping names")
    return columns


def parse_columns(mapping: Mapping[str, Any]) -> Columns:
    """Return the mapping of a --columns file; raises InvalidInput with the pointer of an error."""
    unknown = sorted(set(mapping) - set(Columns.__dataclass_fields__))
    if unknown:
        known = ", ".join(Columns.__dataclass_fields__)
        raise InvalidInput(f"expected one of {known}", pointer=f"/{unknown[0]}")
    if "id" not in mapping:
        raise InvalidInput("expected the column of the id", pointer="/id")
    if mapping.get("area_unit", "ft2") not in UNITS:
        raise InvalidInput("expected ft2 or m2", pointer="/area_unit")
    values = dict(mapping)
    for name in ("upper_areas", "porches", "tags"):
        values[name] = tuple(str(item) for item in values.get(name) or ())
    for name in ("roof", "garage"):
        if values.get(name) is not None:
            values[name] = _choice(values[name], name)
    return Columns(**values)


def _choice(value: Any, name: str) -> Choice:
    if not isinstance(value, dict) or not isinstance(value.get("values"), dict):
        raise InvalidInput("expected column and values", pointer=f"/{name}")
    allowed: tuple[Any, ...] = ROOF_BITS if name == "roof" else (True, False)
    for key, meaning in value["values"].items():
        if meaning not in allowed:
            words = ", ".join(map(str, allowed))
            raise InvalidInput(f"expected one of {words}", pointer=f"/{name}/values/{key}")
    return Choice(str(value.get("column")), {str(k): v for k, v in value["values"].items()})


def _named(columns: Columns) -> set[str]:
    choices = {choice.column for choice in (columns.roof, columns.garage) if choice is not None}
    single = {name for name in (columns.id, columns.main_area, columns.chimneys) if name}
    return single | choices | {*columns.upper_areas, *columns.porches, *columns.tags}


def build(record: Record, options: ReadOptions) -> Built:
    """Return the attributes of one row."""
    header, columns = record.payload
    values = _row((record.data or b"").replace(b"\r\n", b"\n").rstrip(b"\n"))
    if len(values) != len(header):
        raise InvalidInput(f"has {len(values)} columns; expected {len(header)}")
    row = dict(zip(header, values, strict=True))
    identity = row[columns.id]
    if not identity:
        raise InvalidInput(f"has no id in column {columns.id!r}")
    notes: Counter[str] = Counter()
    garage = _meaning(row, columns.garage)
    porch = _porch(row, columns)
    none: tuple[Number, ...] = (0.0,) * 6
    unknown: tuple[Number, ...] = (None,) * 6
    mass = MassAttributes(
        arf=_arf(row, columns, notes),
        garage=none if garage is False else unknown,
        porch=(none, none) if porch is False else (unknown, unknown),
    )
    present = Present(garage, porch, porch)
    attributes = Attributes(
        id=identity,
        mass=mass,
        element=ElementAttributes(roof=_roof(row, columns, notes), special=_special(row, columns)),
        present=None if present == Present() else present,
        tags={name: row[name] for name in columns.tags if row[name]},
    )
    return Built((attributes,), notes)


def _meaning(row: Mapping[str, str], choice: Choice | None) -> Any:
    return None if choice is None else choice.values.get(row[choice.column])


def _area(row: Mapping[str, str], columns: Columns, name: str) -> float | None:
    found = number(row[name])
    return None if found is None or found < 0.0 else found * UNITS[columns.area_unit]


def _arf(row: Mapping[str, str], columns: Columns, notes: Counter[str]) -> tuple[Number, ...]:
    """Return the floors' shares; an upper floor larger than the main one counts as large as it."""
    if columns.main_area is None or not columns.upper_areas:
        return (None,) * 3
    main = _area(row, columns, columns.main_area)
    upper = [_area(row, columns, name) for name in columns.upper_areas]
    if not main or any(value is None for value in upper):
        notes["no floor areas: arf unknown"] += 1
        return (None,) * 3
    ratio = sum(value or 0.0 for value in upper) / main
    if ratio > 1.0:
        notes["upper floor larger than the main floor: clipped"] += 1
        ratio = 1.0
    return (1.0 / (1.0 + ratio), ratio / (1.0 + ratio), 0.0)


def _porch(row: Mapping[str, str], columns: Columns) -> bool | None:
    """Return False where no porch of any kind has an area; where one has, its side is unknown."""
    areas = [_area(row, columns, name) for name in columns.porches]
    return False if areas and all(area == 0.0 for area in areas) else None


def _roof(row: Mapping[str, str], columns: Columns, notes: Counter[str]) -> dict[str, Bit]:
    kind = _meaning(row, columns.roof)
    if columns.roof is not None and kind is None:
        notes["roof style that the mapping does not know: unknown"] += 1
    return {name: None if kind is None else int(name == kind) for name in ROOF_BITS}


def _special(row: Mapping[str, str], columns: Columns) -> dict[str, Bit]:
    count = None if columns.chimneys is None else number(row[columns.chimneys])
    return {"chimney": None if count is None else int(count > 0.0), "tower": None}
