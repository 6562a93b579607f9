"""Samples of a table's model: lines of CSV, the columns of the table again."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from typing import Any

from ..artifacts.numbers import canonical
from .layout import Layout
from .samples import Block, Source, block_ids
from .table import columns_of
from .table_groups import ID


def table_header(layout: Layout) -> bytes:
    """Return the first line: id, the columns of all groups, the bits."""
    return _written([(ID, *columns_of(layout))])


def table_rows(source: Source, block: Block, first: int) -> bytes:
    """Return a line for each row of a block, ids counted from `first`."""
    return _written(_rows(source, block, first))


def _rows(source: Source, block: Block, first: int) -> Iterator[tuple[Any, ...]]:
    layout = source.network.layout
    names = [*(c.name for group in layout.groups for c in group.coordinates), *layout.bits]
    unknown = [name in source.model.unobserved for name in names]
    groups = [values.tolist() for values in block.readings.values]
    bits = block.readings.bits.tolist()
    for i, name in enumerate(block_ids(source, block, first)):
        numbers = [number for group in groups for number in group[i]]
        cells = zip((*canonical(numbers), *bits[i]), unknown, strict=True)
        yield (name, *("" if nobody_knows else cell for cell, nobody_knows in cells))


def _written(rows: Iterable[tuple[Any, ...]]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()
