"""Our own OBJ files: the artifacts that `facade export` left in their comments."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO

from ..artifacts.documents import decode, parse_json
from ..errors import InvalidInput
from .obj import NOTE
from .reading import Built, ReadOptions, Record

MARK = f"# {NOTE} ".encode()
VERTEX = re.compile(rb"^v\s+-?[0-9.]", re.M)
LONGEST_LINE = 64 << 20


def detect(head: bytes) -> bool:
    """Tell an OBJ file by its comments or its vertices."""
    return head.startswith(MARK) or (b"\0" not in head and VERTEX.search(head) is not None)


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record an artifact; raises InvalidInput for a mesh without any."""
    number = 0
    found = False
    while line := stream.readline(LONGEST_LINE):
        number += 1
        if line.startswith(MARK):
            found = True
            yield Record(None, line=number, data=line.removeprefix(MARK))
        elif not line.startswith(b"#"):
            break
    if not found:
        message = "an OBJ mesh of another program; expected one of `facade export`"
        raise InvalidInput(f"{message} (capture-style reads meshes)")


def build(record: Record, options: ReadOptions) -> Built:
    """Return the artifact of one comment, checked like any other."""
    return Built((decode(parse_json(record.data or b""), "building", "footprint"),))
