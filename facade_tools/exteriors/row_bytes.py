"""Rows that differ in numbers and a few texts, written in one compiled loop."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..artifacts.number_bytes import (
    LEAST,
    LONGEST,
    MOST,
    Bytes,
    plain_size,
    text_of,
    write_number,
)
from ..compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Masks = NDArray[np.bool_]

LINE_FEED = 10


class Text(NamedTuple):
    """A column (n,) of texts out of a pool: where each begins and ends."""

    pool: Bytes
    begin: Ints
    end: Ints

    def at(self, index: NDArray[np.integer]) -> Text:
        """Return the texts of an index array, out of the same pool."""
        return Text(self.pool, self.begin[index], self.end[index])


Column = Floats | Text


class Row(NamedTuple):
    """The bytes before, between and after the columns; one piece more than columns."""

    pieces: tuple[bytes, ...]
    columns: tuple[Column, ...]


def text_column(texts: Iterable[str], index: NDArray[np.integer] | None = None) -> Text:
    """Return a column of texts, each row the one that `index` (n,) names; without it, each once."""
    parts = [text.encode() for text in texts]
    end = np.cumsum([len(part) for part in parts], dtype=np.int64)
    begin = np.concatenate([np.zeros(1, dtype=np.int64), end])[:-1]
    column = Text(np.frombuffer(b"".join(parts), dtype=np.uint8), begin, end)
    return column if index is None else column.at(index)


def joined(row: Row, count: int) -> bytes:
    """Return `count` rows one after the other, numbers as canonical JSON.

    Raises ValueError on NaN and infinities.
    """
    numbers = [c for c in row.columns if not isinstance(c, Text)]
    table = np.stack(numbers, axis=1) if numbers else np.empty((count, 0))
    odd = b"".join(text_of(value) + b"\n" for value in table[~plain_size(table)])
    texts = _side_by_side([c for c in row.columns if isinstance(c, Text)], count)
    ends = np.cumsum([len(piece) for piece in row.pieces], dtype=np.int64)
    kinds = np.array([isinstance(c, Text) for c in row.columns], dtype=np.bool_)
    widest = int(ends[-1]) + LONGEST * table.shape[1]
    size = count * widest + int((texts.end - texts.begin).sum()) + len(odd)
    out = np.empty(size, dtype=np.uint8)
    used = write_rows(_bytes(b"".join(row.pieces)), ends, kinds, table, _bytes(odd), *texts, out)
    return out[:used].tobytes()


def _bytes(data: bytes) -> Bytes:
    return np.frombuffer(data, dtype=np.uint8)


def _side_by_side(texts: list[Text], count: int) -> Text:
    """Return columns (n,) of texts as one pool with begins and ends (n, columns)."""
    shifts = np.cumsum([0, *(len(text.pool) for text in texts)])
    pool = np.concatenate([np.empty(0, np.uint8), *(text.pool for text in texts)])
    begin, end = np.empty((2, count, len(texts)), dtype=np.int64)
    for t, text in enumerate(texts):
        begin[:, t], end[:, t] = text.begin + shifts[t], text.end + shifts[t]
    return Text(pool, begin, end)


@compiled
def copied(source: Bytes, begin: int, end: int, out: Bytes, at: int) -> int:
    """Copy bytes; return where they end."""
    for i in range(end - begin):
        out[at + i] = source[begin + i]
    return at + end - begin


@compiled
def write_rows(
    pieces: Bytes,
    ends: Ints,
    kinds: Masks,
    table: Floats,
    odd: Bytes,
    pool: Bytes,
    begin: Ints,
    end: Ints,
    out: Bytes,
) -> int:
    """Write all rows to `out`; return how many bytes they are.

    pieces: one after the other, up to `ends`. kinds: which columns are texts. table (n, numbers);
    odd: lines with the numbers that are not of plain size, row by row. begin, end (n, texts): in
    the pool.
    """
    at = 0
    line = 0
    for i in range(len(table)):
        at = copied(pieces, 0, ends[0], out, at)
        number = 0
        text = 0
        for c in range(len(kinds)):
            if kinds[c]:
                at = copied(pool, begin[i, text], end[i, text], out, at)
                text += 1
            else:
                size = abs(table[i, number])
                if size == 0.0 or LEAST <= size < MOST:
                    at = write_number(table[i, number], out, at)
                else:
                    while odd[line] != LINE_FEED:
                        out[at] = odd[line]
                        at += 1
                        line += 1
                    line += 1
                number += 1
            at = copied(pieces, ends[c], ends[c + 1], out, at)
    return at
