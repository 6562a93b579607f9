"""Assessors' tables (CSV) to attributes, by a mapping of their columns.

`docs/assessor.md` describes the mapping; one for the Ames table is built in.
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, BinaryIO, cast

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
from .reading import HEAD_BYTES, Built, ReadOptions, Record
from .xmltree import number

UNITS = {"ft2": 0.3048**2, "m2": 1.0}
LONGEST_LINE = 1 << 20
LEAST_COLUMNS = 4  # of a table some of whose rows have another number of columns
UTF16 = (b"\xff\xfe", b"\xfe\xff")
THOUSANDS = re.compile(r"\d{1,3}(,\d{3})+(\.\d+)?")


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
    """Tell a table by rows of text with the same number of columns, as its first line has."""
    if head.lstrip()[:1] in (b"{", b"[", b"<") or (b"\0" in head and head[:2] not in UTF16):
        return False
    return _dialect(head) is not None


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a table is written: the encoding of its text, what stands between its columns."""

    encoding: str
    delimiter: str

    def row(self, line: bytes) -> list[str]:
        """Return the values of a line; raises InvalidInput where it is none."""
        try:
            text = line.decode(self.encoding).rstrip("\r\n")
            rows = csv.reader(io.StringIO(text, newline=""), delimiter=self.delimiter, strict=True)
            return [value.strip() for value in next(rows, [])]
        except (UnicodeDecodeError, csv.Error) as error:
            raise InvalidInput(f"is no row of the table: {error}") from None

    def number(self, text: str) -> float | None:
        """Return the number of a cell, also with thousands apart; beside `;` a comma is decimal."""
        text = text.replace("\u00a0", "").replace("'", "").lstrip("$").strip()
        if self.delimiter == ";" and "," in text:
            return number(text.replace(".", "").replace(",", "."))
        return number(text.replace(",", "") if THOUSANDS.fullmatch(text) else text)


def _dialect(head: bytes) -> Dialect | None:
    """Return how a table is written by its first lines; None where they are no table."""
    for encoding in ("utf-8-sig", "cp1252"):
        text = _text(head, encoding, cut=len(head) >= HEAD_BYTES)
        if text is None:
            continue
        best = max((_columns_of(text, mark), mark) for mark in ",;\t|")
        return Dialect(encoding, best[1]) if best[0] >= 2 else None
    return None


def _text(head: bytes, encoding: str, cut: bool) -> str | None:
    if head[:2] in UTF16:
        return head.decode("utf-16", "replace")
    if cut:  # a character may be cut in two
        head = head[: head.rfind(b"\n") + 1]
    try:
        return head.decode(encoding)
    except UnicodeDecodeError:
        return None


def _columns_of(text: str, delimiter: str) -> int:
    """Return how many columns the rows of a text have; 0 where most differ from the first."""
    try:
        rows = list(islice(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter), 12))
    except csv.Error:
        return 0
    names = [name.strip() for name in rows[0]] if rows else []
    counts = [len(row) for row in rows[1:11] if row]
    alike = sum(count == len(names) for count in counts)
    if len(set(names)) < len(names) or not all(names) or 2 * alike < len(counts):
        return 0
    if len(names) >= LEAST_COLUMNS:
        return len(names)
    return len(names) if counts and alike == len(counts) else 0


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a row. Raises InvalidInput on a table that cannot be read."""
    try:
        yield from _rows(stream, options)
    except UnicodeDecodeError as error:
        raise InvalidInput(f"is no text in UTF-16: {error.reason}") from None


def _rows(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    head = stream.read(HEAD_BYTES)
    stream.seek(0)
    if head[:2] in UTF16:
        stream = cast(BinaryIO, codecs.EncodedFile(stream, "utf-8", "utf-16"))
    elif b"\r" in head and b"\n" not in head:
        raise InvalidInput("has no line feed at the end of its lines; expected one")
    dialect = _dialect(head) or Dialect("utf-8-sig", ",")
    header = dialect.row(stream.readline(LONGEST_LINE))
    columns = _columns(options.columns, header)
    number_ = 2
    while line := stream.readline(LONGEST_LINE):
        lines = 1
        while line.count(b'"') % 2 and (more := stream.readline(LONGEST_LINE)):
            line, lines = line + more, lines + 1
        if line.strip():
            yield Record((header, columns, dialect), line=number_, data=line)
        number_ += lines


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
    """Return the attributes of one row.

    Raises InvalidInput on a row of another length, and without an id.
    """
    header, columns, dialect = record.payload
    values = dialect.row(record.data or b"")
    if len(values) != len(header):
        raise InvalidInput(f"has {len(values)} columns; expected {len(header)}")
    row = dict(zip(header, values, strict=True))
    identity = row[columns.id]
    if not identity:
        raise InvalidInput(f"has no id in column {columns.id!r}")
    notes: Counter[str] = Counter()
    garage = _meaning(row, columns.garage)
    numbers = {name: dialect.number(text) for name, text in row.items()}
    porch = _porch(numbers, columns)
    none: tuple[Number, ...] = (0.0,) * 6
    unknown: tuple[Number, ...] = (None,) * 6
    mass = MassAttributes(
        arf=_arf(numbers, columns, notes),
        garage=none if garage is False else unknown,
        porch=(none, none) if porch is False else (unknown, unknown),
    )
    present = Present(garage, porch, porch)
    attributes = Attributes(
        id=identity,
        mass=mass,
        element=ElementAttributes(
            roof=_roof(row, columns, notes), special=_special(numbers, columns)
        ),
        present=None if present == Present() else present,
        tags={name: row[name] for name in columns.tags if row[name]},
    )
    return Built((attributes,), notes)


def _meaning(row: Mapping[str, str], choice: Choice | None) -> Any:
    return None if choice is None else choice.values.get(row[choice.column])


def _area(row: Mapping[str, Number], columns: Columns, name: str) -> float | None:
    found = row[name]
    return None if found is None or found < 0.0 else found * UNITS[columns.area_unit]


def _arf(row: Mapping[str, Number], columns: Columns, notes: Counter[str]) -> tuple[Number, ...]:
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


def _porch(row: Mapping[str, Number], columns: Columns) -> bool | None:
    """Return False where no porch of any kind has an area; where one has, its side is unknown."""
    areas = [_area(row, columns, name) for name in columns.porches]
    return False if areas and all(area == 0.0 for area in areas) else None


def _roof(row: Mapping[str, str], columns: Columns, notes: Counter[str]) -> dict[str, Bit]:
    kind = _meaning(row, columns.roof)
    if columns.roof is not None and kind is None:
        notes["roof style that the mapping does not know: unknown"] += 1
    return {name: None if kind is None else int(name == kind) for name in ROOF_BITS}


def _special(row: Mapping[str, Number], columns: Columns) -> dict[str, Bit]:
    count = None if columns.chimneys is None else row[columns.chimneys]
    return {"chimney": None if count is None else int(count > 0.0), "tower": None}
