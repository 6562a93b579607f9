"""Samples as lines of JSON, a whole block at a time: the same bytes as one artifact at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from json import dumps
from typing import Any

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.documents import encode
from ..artifacts.model import Model
from ..artifacts.numbers import dump_line
from ..artifacts.provenance import Provenance
from .coordinates import columns_of
from .physical import storey_heights
from .row_bytes import Column, Row, joined, text_column
from .samples import Block, SampleOptions, Source, annotated, block_ids, source_of, taken_blocks
from .table_samples import table_rows

SLOT = "\x00"  # stands in a template where a row puts its own text; JSON escapes it
MARK = dumps(SLOT).encode()


@dataclass(frozen=True, slots=True)
class Lines:
    """Samples as they are written: one line after the other, ids `<prefix>-<first>` and so on."""

    prefix: str
    first: int
    count: int
    data: bytes

    def apart(self) -> Iterator[tuple[str, bytes]]:
        """Yield id and line of each sample."""
        rows = enumerate(self.data.splitlines(keepends=True), self.first)
        yield from ((f"{self.prefix}-{i}", line) for i, line in rows)


def sample_lines(
    model: Model,
    n: int,
    *,
    rng: np.random.Generator,
    given: Attributes | None,
    options: SampleOptions,
    provenance: Provenance | None,
) -> Iterator[Lines]:
    """Yield the lines of what `drawing.sample_attributes` yields, with a provenance.

    The lines of a table's model are rows of CSV, which carry none.
    """
    source = source_of(model, given, options)
    for first, block in taken_blocks(source, n, rng=rng):
        start, count = options.first + first, len(block.style)
        if source.network.layout.is_table:
            data = table_rows(source, block, first)
        elif given is None:
            data = lines(source, block, first, provenance)
        else:
            rows = (replace(a, provenance=provenance) for a in annotated(source, block, first))
            data = b"".join(dump_line(encode(a)) for a in rows)
        yield Lines(options.prefix, start, count, data)


def lines(source: Source, block: Block, first: int, provenance: Provenance | None) -> bytes:
    """Return the lines of a block that nothing was given for."""
    if not len(block.style):
        return b""
    example = next(annotated(source, block.take(np.array([0])), first))
    ids = block_ids(source, block, first)
    prefix = source.options.prefix
    head = dumps(prefix, ensure_ascii=False)[:-1]  # its quote is still open
    cells = columns(source, block)
    cells["id"] = text_column(f'{head}{name[len(prefix) :]}"' for name in ids)
    row = template(encode(replace(example, provenance=provenance)), cells)
    return joined(row, len(ids))


def columns(source: Source, block: Block) -> dict[str, Column]:
    """Return what rows differ in, under its place in the document."""
    layout, values = source.network.layout, block.readings.values
    heights = storey_heights(values, layout, source.model.storey_height)
    written = columns_of(block.readings, layout, source.options.groups)
    out: dict[str, Column] = {"storey_height": heights, "log_density": block.density}
    for name, table in written.items():
        for index in np.ndindex(table.shape[1:]):
            out["/".join((name, *map(str, index)))] = table[(slice(None), *index)]
    out["style"] = text_column(map(str, range(len(source.network.style))), block.style)
    for name, bits in zip(layout.bits, block.readings.bits.T, strict=True):
        out[name.replace(".", "/")] = text_column("01", bits)
    near = source.finder.nearest(block.readings) if source.options.neighbours else ()
    for name, nearest, _ in near:
        if nearest[0] >= 0:  # a group without training rows has no neighbour in any row
            out[f"neighbours/{name}"] = source.finder.names.at(nearest)
    return out


def template(document: Any, cells: Mapping[str, Column]) -> Row:
    """Return a document as the bytes between its columns."""
    slots: list[Column] = []

    def opened(value: Any, path: str) -> Any:
        if isinstance(value, dict):
            return {key: opened(item, f"{path}/{key}") for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [opened(item, f"{path}/{i}") for i, item in enumerate(value)]
        column = cells.get(_place(path))
        if column is None:
            return value
        slots.append(column)
        return SLOT

    pieces = dump_line(opened(document, "")).split(MARK)
    return Row(tuple(pieces), tuple(slots))


def _place(path: str) -> str:
    """Return the place of a column that belongs at a path of the document."""
    parts = path.split("/")[1:]
    if parts[0] in ("mass", "facade", "element", "sample", "tags"):
        parts = parts[1:]
    return "/".join(parts)
