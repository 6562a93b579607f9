"""Reading artifacts: .json, .jsonl, .yaml, folders of them, standard input."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeVar, overload

from ..errors import InvalidInput
from .documents import Artifact, check_finite, decode, parse_json, parse_yaml
from .pointers import located
from .provenance import Source

A = TypeVar("A", bound=Artifact)
Kind = str | type[Artifact]  # of an artifact: its name on disk, or its class
Paths = str | Path | Iterable[str | Path]

MAX_DOCUMENT_BYTES = 512 << 20
MAX_LINE_BYTES = 64 << 20
SUFFIXES = (".json", ".jsonl", ".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class RawItem:
    """The bytes of one artifact and where they stand; `line` (from 1) only in a stream."""

    source: str
    line: int | None
    data: bytes
    yaml: bool = False

    def document(self, implied: str | None = None, unique: bool = False) -> Any:
        """Parse to plain data; `implied` is the kind of hand-written YAML without a schema.

        unique: also refuse JSON in which a key stands twice, as YAML always is.
        """
        try:
            if not self.yaml:
                return parse_json(self.data, unique)
            document = parse_yaml(self.data)
            check_finite(document)
        except InvalidInput as error:
            raise self._worded(error).at(self.source, self.line) from None
        if implied and isinstance(document, dict) and "schema" not in document:
            return {"schema": f"facade-tools/{implied}/1", **document}
        return document

    @overload
    def artifact(self, kind: type[A], /) -> A: ...
    @overload
    def artifact(self, *kinds: Kind) -> Any: ...
    def artifact(self, *kinds: Kind) -> Any:
        """Parse, check and decode; raises InvalidInput with file, line and pointer."""
        names = tuple(map(_kind_name, kinds))
        document = self.document(names[0] if len(names) == 1 else None)
        try:
            return decode(document, *names)
        except InvalidInput as error:
            raise self.located(error) from None

    def _worded(self, error: InvalidInput) -> InvalidInput:
        """Return the error of a file that cannot be parsed; of JSON Lines, what they are."""
        if self.line is None and not self.yaml and _is_stream(self.data):
            return InvalidInput("holds a document a line; expected one, or the ending .jsonl")
        return error

    def located(self, error: InvalidInput) -> InvalidInput:
        """Return an error with its file and line: of hand-written YAML, told by the pointer."""
        if self.yaml:
            return located(error, self.data, self.source)
        return error.at(self.source, self.line)

    def provenance(self) -> Source:
        """Return name and digest of this item."""
        return Source(_name(self.source), hashlib.sha256(self.data).hexdigest())


def read_raw(paths: Iterable[str], stdin: BinaryIO | None = None) -> Iterator[RawItem]:
    """Yield the items of files, folders and `-`, in order, one in memory at a time.

    Raises InvalidInput on what is missing, unreadable or too large.
    """
    for path in paths:
        if path == "-":
            yield from _read_stdin(stdin or sys.stdin.buffer)
        elif Path(path).is_dir():
            yield from _read_folder(Path(path))
        else:
            yield from _read_file(Path(path), path)


@overload
def read(paths: Paths, kind: type[A], /) -> Iterator[A]: ...
@overload
def read(paths: Paths, *kinds: Kind) -> Iterator[Any]: ...
def read(paths: Paths, *kinds: Kind) -> Iterator[Any]:
    """Yield the artifacts of the given kinds from one or many files, folders and `-`, in order.

    Raises InvalidInput, with file, line and pointer, at the first that is no such artifact.
    """
    several = [paths] if isinstance(paths, str | Path) else paths
    for item in read_raw(map(str, several)):
        yield item.artifact(*kinds)


@overload
def read_one(path: str | Path, kind: type[A], /) -> A: ...
@overload
def read_one(path: str | Path, *kinds: Kind) -> Any: ...
def read_one(path: str | Path, *kinds: Kind) -> Any:
    """Return the only artifact of `path`; raises InvalidInput if there is none or another."""
    return read_only(str(path)).artifact(*kinds)


def read_only(path: str) -> RawItem:
    """Return the only item of `path`; raises InvalidInput if there is none or another."""
    items = read_raw([path])
    first = next(items, None)
    if first is None or next(items, None) is not None:
        count = "none" if first is None else "several"
        raise InvalidInput(f"holds {count}; expected one artifact").at(path)
    return first


def _kind_name(kind: Kind) -> str:
    return kind if isinstance(kind, str) else kind.kind


def read_whole(path: str, stdin: BinaryIO | None = None) -> RawItem:
    """Return a whole file that is no artifact (a table), or standard input where `path` is `-`."""
    if path == "-":
        return _whole(stdin or sys.stdin.buffer, path, False)
    try:
        with Path(path).open("rb") as file:
            return _whole(file, path, False)
    except OSError as error:
        raise unreadable(path, error) from None


def digest(path: str) -> Source:
    """Return name and digest of a whole input: of a folder, over its files' names and digests."""
    place = Path(path)
    if place.is_dir():
        rows = (digest(str(entry)) for entry in _entries(place))
        text = "".join(f"{row.name}\0{row.sha256}\n" for row in rows)
        return Source(place.resolve().name, hashlib.sha256(text.encode()).hexdigest())
    try:
        with place.open("rb") as file:
            return Source(place.name, hashlib.file_digest(file, "sha256").hexdigest())
    except OSError as error:
        raise unreadable(path, error) from None


def unreadable(path: str, error: OSError) -> InvalidInput:
    """Return the typed error of a file that cannot be read."""
    return InvalidInput(f"cannot be read: {error.strerror or error}").at(path)


def _name(source: str) -> str:
    return source if source == "-" else Path(source).resolve().name


def _entries(folder: Path) -> list[Path]:
    try:
        entries = [entry for entry in folder.iterdir() if entry.suffix.lower() in SUFFIXES]
    except OSError as error:
        raise unreadable(str(folder), error) from None
    return sorted(entry for entry in entries if not entry.name.startswith("."))


def _read_folder(folder: Path) -> Iterator[RawItem]:
    entries = _entries(folder)
    if not entries:
        raise InvalidInput(f"holds no {', '.join(SUFFIXES)} file").at(str(folder))
    for entry in entries:
        yield from _read_file(entry, str(entry))


def _read_file(path: Path, name: str) -> Iterator[RawItem]:
    try:
        with path.open("rb") as file:
            if path.suffix.lower() == ".jsonl":
                yield from _lines(file, name)
            else:
                yield _whole(file, name, path.suffix.lower() in (".yaml", ".yml"))
    except OSError as error:
        raise unreadable(name, error) from None


def _whole(file: BinaryIO, name: str, yaml: bool, head: bytes = b"") -> RawItem:
    data = head + file.read(MAX_DOCUMENT_BYTES + 1 - len(head))
    if len(data) > MAX_DOCUMENT_BYTES:
        limit = f"{MAX_DOCUMENT_BYTES >> 20} MiB"
        raise InvalidInput(f"is larger than {limit}; expected a stream (.jsonl)").at(name)
    if not data.strip():
        raise InvalidInput("is empty; expected an artifact").at(name)
    return RawItem(name, None, data, yaml)


def _lines(file: BinaryIO, name: str, first: int = 1) -> Iterator[RawItem]:
    number = first - 1
    while data := file.readline(MAX_LINE_BYTES + 1):
        number += 1
        if len(data) > MAX_LINE_BYTES:
            limit = f"{MAX_LINE_BYTES >> 20} MiB"
            raise InvalidInput(f"line longer than {limit}; expected one artifact").at(name, number)
        if data.strip():
            yield RawItem(name, number, data)


def _read_stdin(stream: BinaryIO) -> Iterator[RawItem]:
    """Read JSON Lines, or one whole document when the first line is not one by itself."""
    first = stream.readline(MAX_LINE_BYTES + 1)
    if not first.strip() and not stream.peek(1):  # type: ignore[attr-defined]
        return
    if _complete(first):
        yield RawItem("-", 1, first)
        yield from _lines(stream, "-", 2)
    else:
        yield _whole(stream, "-", not first.lstrip().startswith((b"{", b"[")), first)


def _is_stream(data: bytes) -> bool:
    """Tell whether text that is not one document is JSON Lines: its first line is one."""
    first, _, rest = data.lstrip().partition(b"\n")
    try:
        parse_json(first)
    except InvalidInput:
        return False
    return bool(rest.strip())


def _complete(line: bytes) -> bool:
    try:
        parse_json(line)
    except InvalidInput:
        # A broken first line of a stream is an error of that line, not the start of a document.
        return line.lstrip().startswith(b"{") and line.rstrip().endswith(b"}")
    return True
