"""JSON larger than memory, value by value, of bounded depth."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, BinaryIO

import ijson
import numpy as np

from ..errors import InvalidInput

DEEPEST = 500  # the parser keeps a path for every level: its memory grows with their square
QUOTE, OPEN, CLOSE = b'"{}'
BRACE = 0x20  # the bit by which a brace differs from a bracket


def values(stream: BinaryIO, prefix: str) -> Iterator[Any]:
    """Yield the values at `prefix` from where the stream stands; raises InvalidInput."""
    yield from _explained(ijson.items(_Shallow(stream), prefix, use_float=True))


def pairs(stream: BinaryIO, prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield name and value of the members of the object at `prefix`; raises InvalidInput."""
    yield from _explained(ijson.kvitems(_Shallow(stream), prefix, use_float=True))


def _explained(found: Iterator[Any]) -> Iterator[Any]:
    try:
        yield from found
    except ijson.JSONError as error:
        reason = error.args[0] if error.args else error
        text = reason.decode("utf-8", "replace") if isinstance(reason, bytes) else str(reason)
        raise InvalidInput(f"not valid JSON: {text.splitlines()[0]}") from None


class _Shallow:
    """A stream of JSON that refuses to be read beyond a depth."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._depth = self._quotes = 0
        self._before = b""  # the first half of an escape

    def read(self, size: int = -1) -> bytes:
        """Return the next block; raises InvalidInput where it is nested too deeply."""
        block = self._stream.read(size)
        data = self._before + block
        self._before = b"\\" * ((len(data) - len(data.rstrip(b"\\"))) % 2)
        data = data[: len(data) - len(self._before)]
        plain = np.frombuffer(data.replace(rb"\\", b"").replace(rb"\"", b""), dtype=np.uint8)
        if len(plain):
            self._count(plain)
        return block

    def _count(self, plain: np.ndarray[tuple[int], np.dtype[np.uint8]]) -> None:
        quotes = np.cumsum(plain == QUOTE) + self._quotes
        sort = plain | BRACE
        steps = ((sort == OPEN).astype(np.int8) - (sort == CLOSE)) * (quotes % 2 == 0)
        depth = np.cumsum(steps) + self._depth
        if depth.max() > DEEPEST:
            raise InvalidInput(f"nested deeper than {DEEPEST} levels; expected geodata")
        self._quotes, self._depth = int(quotes[-1]) % 2, int(depth[-1])
