"""Pictures of Silicon Graphics (.rgb, .rgba, .sgi, .bw, .int): plain or run-length encoded."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..geometry.arrays import Integers

MAGIC = b"\x01\xda"
HEADER = 512  # bytes before the rows, or before the table of rows
Bytes = NDArray[np.uint8]


def size(data: bytes) -> tuple[int, int, int, int]:
    """Return width, height, channels and bytes a channel. Raises struct.error if cut off."""
    wide, dimension, width, height, channels = struct.unpack_from(">BHHHH", data, 3)
    if dimension < 3:
        channels = 1
    return width, (height if dimension > 1 else 1), channels, wide


def decoded_sgi(data: bytes) -> Bytes | None:
    """Return the picture (h, w) or (h, w, 3) of a file, 8 bits, RGB; None if it is damaged.

    Of one or two channels the first is grey, of more the first three are red, green, blue.
    """
    width, height, channels, wide = size(data)
    kept = 3 if channels > 2 else 1
    if wide not in (1, 2) or channels < 1:
        return None
    rows = height * kept
    raw = np.frombuffer(data, dtype=np.uint8)
    if data[2] == 0:
        planes = raw[HEADER : HEADER + rows * width * wide]
        if len(planes) < rows * width * wide:
            return None
        planes = planes.reshape(rows, width * wide)[:, ::wide]
    else:
        if len(raw) < HEADER + 8 * height * channels:
            return None
        table = raw[HEADER : HEADER + 8 * height * channels].view(">u4")
        starts, lengths = (table[k * height * channels :][:rows].astype(np.int64) for k in (0, 1))
        planes = np.zeros((rows, width), dtype=np.uint8)
        if not _unpacked(raw, starts, lengths, wide, planes):
            return None
    picture = planes.reshape(kept, height, width)[:, ::-1].transpose(1, 2, 0)
    return np.ascontiguousarray(picture[:, :, 0] if kept == 1 else picture)


@compiled
def _unpacked(data: Bytes, starts: Integers, lengths: Integers, wide: int, rows: Bytes) -> bool:
    """Fill rows from their runs, of two bytes a channel the high one; False if they don't fit."""
    for row in range(len(rows)):
        at, end, column = starts[row], starts[row] + lengths[row], 0
        if end > len(data):
            return False
        while at + wide <= end:
            code = data[at + wide - 1]
            at += wide
            count = code & 127
            if count == 0:
                break
            literal = code > 127
            if column + count > rows.shape[1] or at + wide * (count if literal else 1) > end:
                return False
            for _ in range(count):
                rows[row, column] = data[at]
                column += 1
                if literal:
                    at += wide
            if not literal:
                at += wide
        if column != rows.shape[1]:
            return False
    return True
