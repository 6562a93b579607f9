"""Size, depth, frames and completeness of an image file, told from its bytes alone."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

from ..errors import InvalidInput
from . import sgi


@dataclass(frozen=True, slots=True)
class Header:
    """What a file says of itself; `deep`: more than 8 bits a channel."""

    format: str
    width: int
    height: int
    frames: int = 1
    deep: bool = False
    complete: bool = True


def header(data: bytes, name: str) -> Header:
    """Return the header of a picture of any kind known here. Raises InvalidInput with `name`."""
    read = next((one for magic, one in _READERS if data.startswith(magic)), None)
    if read is None:
        raise InvalidInput(
            "is no picture that can be read; expected JPEG, PNG, TIFF, BMP, WebP or a still GIF"
        ).at(name)
    try:
        info = read(data)
    except (struct.error, IndexError):
        raise InvalidInput("ends within its header; expected a picture").at(name) from None
    if info.width < 1 or info.height < 1:
        raise InvalidInput("has no pixels; expected a picture").at(name)
    return info


def _png(data: bytes) -> Header:
    width, height, depth = struct.unpack_from(">IIB", data, 16)
    frames, at = 1, 8
    complete = False
    while at + 8 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"acTL":
            frames = struct.unpack_from(">I", data, at + 8)[0]
        complete = kind == b"IEND"
        at += 12 + size
    return Header("PNG", width, height, frames, depth > 8, complete and at <= len(data))


_JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


def _jpeg(data: bytes) -> Header:
    at = 2
    while True:
        while data[at] != 0xFF:
            at += 1
        while data[at] == 0xFF:
            at += 1
        marker = data[at]
        if marker in _JPEG_FRAMES:
            height, width = struct.unpack_from(">HH", data, at + 4)
            # trailing bytes after the end marker are common; what lacks it was cut off
            return Header("JPEG", width, height, complete=b"\xff\xd9" in data[at:])
        size = struct.unpack_from(">H", data, at + 1)[0]
        at += 1 + size


def _gif(data: bytes) -> Header:
    width, height, flags = struct.unpack_from("<HHB", data, 6)
    at, frames = 13 + _gif_colours(flags), 0
    while at < len(data) and data[at] != _GIF_END and frames < 2:
        if data[at] == _GIF_IMAGE:
            frames += 1
            at += 11 + _gif_colours(data[at + 9])  # and the size of the codes
        else:
            at += 2
        while at < len(data) and data[at]:  # blocks of data, each after its length
            at += 1 + data[at]
        at += 1
    return Header("GIF", width, height, max(1, frames), complete=at < len(data))


_GIF_IMAGE, _GIF_END = 0x2C, 0x3B


def _gif_colours(flags: int) -> int:
    """Return the bytes of a table of colours."""
    return 3 << (flags & 7) + 1 if flags & 0x80 else 0


def _bmp(data: bytes) -> Header:
    width, height = struct.unpack_from("<ii", data, 18)
    declared = struct.unpack_from("<I", data, 2)[0]
    return Header("BMP", abs(width), abs(height), complete=len(data) >= declared)


def _webp(data: bytes) -> Header:
    if data[8:12] != b"WEBP":
        return Header("RIFF", 0, 0)
    complete = len(data) >= struct.unpack_from("<I", data, 4)[0] + 8
    kind = data[12:16]
    if kind == b"VP8X":
        width = 1 + int.from_bytes(data[24:27], "little")
        height = 1 + int.from_bytes(data[27:30], "little")
        return Header("WebP", width, height, 2 if data[20] & 2 else 1, complete=complete)
    if kind == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        return Header("WebP", 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF), complete=complete)
    width, height = struct.unpack_from("<HH", data, 26)
    return Header("WebP", width & 0x3FFF, height & 0x3FFF, complete=complete)


def _tiff(data: bytes) -> Header:
    order = "<" if data[:2] == b"II" else ">"
    at = struct.unpack_from(f"{order}I", data, 4)[0]
    count = struct.unpack_from(f"{order}H", data, at)[0]
    values: dict[int, int] = {}
    for i in range(count):
        row = at + 2 + 12 * i
        tag, kind, number = struct.unpack_from(f"{order}HHI", data, row)
        if tag == 258 and number > 2:  # bits of each channel, stored elsewhere
            row = struct.unpack_from(f"{order}I", data, row + 8)[0] - 8
            kind = 3
        values[tag] = struct.unpack_from(f"{order}{'H' if kind == 3 else 'I'}", data, row + 8)[0]
    more = struct.unpack_from(f"{order}I", data, at + 2 + 12 * count)[0]
    deep = values.get(258, 8) > 8
    return Header("TIFF", values.get(256, 0), values.get(257, 0), 2 if more else 1, deep)


def _sgi(data: bytes) -> Header:
    width, height, _, _ = sgi.size(data)
    return Header("SGI", width, height)


_READERS: tuple[tuple[bytes, Callable[[bytes], Header]], ...] = (
    (b"\x89PNG\r\n\x1a\n", _png),
    (b"\xff\xd8", _jpeg),
    (b"GIF8", _gif),
    (b"BM", _bmp),
    (b"RIFF", _webp),
    (b"II*\0", _tiff),
    (b"MM\0*", _tiff),
    (sgi.MAGIC, _sgi),
)
