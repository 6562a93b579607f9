"""What every reader of a public format promises: records in, artifacts out, refusals counted.

A format is a detector and a reader. The reader works in two steps, so that a file larger than
memory streams and the second step can run in many processes: `records` cuts the file into
pieces, `build` turns one piece into artifacts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, BinaryIO, Literal

from ..artifacts.attributes import Attributes
from ..artifacts.building import Building
from ..artifacts.footprint import Footprint
from ..errors import InvalidInput

Imported = Attributes | Building | Footprint
Kind = Literal["buildings", "attributes", "footprints"]
Front = Literal["long", "short", "unknown"]

BY_NAME = "*"  # at the start of an id: stands for the file's name without its ending
HEAD_BYTES = 1 << 16  # what a detector may look at
MAX_FILE_BYTES = 512 << 20  # of a format that must be in memory as a whole


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What the user says about a source.

    kind: what to make, None for what the source gives best. metres: GeoJSON coordinates are
    planar metres. front: which side of a rectangular plan known only by area and perimeter is
    the street front. columns: the column mapping of an assessor's table.
    """

    kind: Kind | None = None
    metres: bool = False
    front: Front = "long"
    columns: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Record:
    """One piece of a source file: what its format's `build` turns into artifacts.

    line (from 1) or pointer say where it stands; data are a line's own bytes, where it is one.
    """

    payload: Any
    line: int | None = None
    pointer: str = ""
    data: bytes | None = None


@dataclass(frozen=True, slots=True)
class Built:
    """Artifacts of one record, and the rules that clipped or left out something, counted."""

    artifacts: tuple[Imported, ...]
    notes: Counter[str] = field(default_factory=Counter)


Records = Callable[[BinaryIO, ReadOptions], Iterator[Record]]
Build = Callable[[Record, ReadOptions], Built]


def without_mark(stream: BinaryIO) -> int:
    """Skip a byte order mark at the start of a UTF-8 file; return where its content begins."""
    stream.seek(0)
    if stream.read(3) != b"\xef\xbb\xbf":
        stream.seek(0)
    return stream.tell()


def read_whole(stream: BinaryIO) -> bytes:
    """Return all bytes of a file that has to be in memory; raises InvalidInput if too large."""
    data = stream.read(MAX_FILE_BYTES + 1)
    if len(data) > MAX_FILE_BYTES:
        raise InvalidInput(f"is larger than {MAX_FILE_BYTES >> 20} MiB; split the file")
    return data
