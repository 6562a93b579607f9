"""From files of any public format to artifacts, one record at a time."""

from __future__ import annotations

import hashlib
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO

from ..artifacts.documents import encode
from ..artifacts.numbers import dump_line
from ..artifacts.provenance import Provenance, Source
from ..artifacts.store import unreadable
from ..errors import InvalidInput, Place
from .detect import Format, detect
from .reading import BY_NAME, HEAD_BYTES, Built, Imported, ReadOptions, Record

SPOOL_BYTES = 64 << 20  # of standard input in memory; what is longer waits on disk

KIND_OF = {"buildings": "building", "attributes": "attributes", "footprints": "footprint"}


@dataclass(frozen=True, slots=True)
class Item:
    """A record of the file at `path`, and its format; or the error of a file that has none."""

    path: str
    source: Source
    format: Format | None
    record: Record | None
    error: InvalidInput | None = None


@dataclass(frozen=True, slots=True)
class Written:
    """The artifacts of one item, encoded, and where it stands; the rules applied, counted."""

    rows: tuple[tuple[str, bytes], ...]
    place: Place
    kinds: Counter[str] = field(default_factory=Counter)
    notes: Counter[str] = field(default_factory=Counter)


def imported(
    paths: str | Path | Iterable[str | Path], options: ReadOptions | None = None
) -> Iterator[Imported]:
    """Yield what one or many files, or folders of them, of any public format give, in order.

    Of rules that clipped or left out something nothing is told; `built` counts them. Raises
    InvalidInput, with file, line and pointer, at the first record that cannot be read.
    """
    options = options or ReadOptions()
    several = [paths] if isinstance(paths, str | Path) else paths
    for item in items(map(str, several), options):
        yield from built(item, options).artifacts


def items(paths: Iterable[str], options: ReadOptions) -> Iterator[Item]:
    """Yield the records of files, folders and `-`, in order, in bounded memory.

    What cannot be read becomes an item with its error, and the next file follows.
    """
    for path in paths:
        files = _files(path)
        if not files:
            error = InvalidInput("holds no file to import; folders in it are not searched")
            yield Item(path, Source(_name(path), ""), None, None, error.at(path))
        for file in files:
            try:
                with _opened(file) as stream:
                    yield from _records(stream, file, options)
            except InvalidInput as error:
                yield Item(file, Source(_name(file), ""), None, None, error.at(file))


def _name(path: str) -> str:
    return path if path == "-" else Path(path).name


PROSE = (".md", ".txt", ".html", ".pdf")  # what tells about the data in the same folder


def _files(path: str) -> list[str]:
    place = Path(path)
    if path == "-" or not place.is_dir():
        return [path]
    return [
        str(entry)
        for entry in sorted(place.iterdir())
        if entry.is_file() and not entry.name.startswith(".") and entry.suffix not in PROSE
    ]


@contextmanager
def _opened(path: str) -> Iterator[BinaryIO]:
    """Open a file for reading from any place in it; standard input is spooled first."""
    if path == "-":
        with tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
            shutil.copyfileobj(sys.stdin.buffer, spool)
            spool.seek(0)
            yield spool  # type: ignore[misc]
        return
    try:
        with Path(path).open("rb") as stream:
            yield stream
    except OSError as error:
        raise unreadable(path, error) from None


def _records(stream: BinaryIO, path: str, options: ReadOptions) -> Iterator[Item]:
    found = detect(stream.read(HEAD_BYTES))
    stream.seek(0)
    whole: Source | None = None
    for record in found.records(stream, options):
        if record.data is not None:
            digest = hashlib.sha256(record.data).hexdigest()
            yield Item(path, Source(_name(path), digest), found, record)
            continue
        if whole is None:
            whole = Source(_name(path), _digest(stream))
        yield Item(path, whole, found, record)


def _digest(stream: BinaryIO) -> str:
    """Return the digest of the whole file; the reading place stays where it is."""
    place = stream.tell()
    stream.seek(0)
    running = hashlib.sha256()
    while block := stream.read(1 << 20):
        running.update(block)
    stream.seek(place)
    return running.hexdigest()


def built(item: Item, options: ReadOptions) -> Built:
    """Return what one record gives, named after its file where it has no name of its own.

    Raises InvalidInput with file, line and pointer.
    """
    if item.error is not None or item.format is None or item.record is None:
        raise item.error or InvalidInput("cannot be read").at(item.path)
    try:
        made = item.format.build(item.record, options)
    except InvalidInput as error:
        raise InvalidInput(error.message, _place(item, error.place.pointer)) from None
    stem = item.source.name.split(".")[0] or "stdin"
    return replace(made, artifacts=tuple(_identified(row, stem) for row in made.artifacts))


def _place(item: Item, pointer: str = "") -> Place:
    if item.record is None:
        return Place(item.path)
    return Place(item.path, item.record.line, item.record.pointer or pointer)


@dataclass(frozen=True, slots=True)
class Importer:
    """Turns an item into encoded artifacts, in any process.

    recorded: the options that the provenance names. convert: what to make of a building where
    attributes are asked for.
    """

    options: ReadOptions
    recorded: Mapping[str, Any]
    convert: Callable[[Any], Imported] | None = None

    def __call__(self, item: Item) -> Written:
        """Return the artifacts of `item`; raises InvalidInput with file, line and pointer."""
        made, place = built(item, self.options), _place(item)
        try:
            artifacts = [self._asked(artifact) for artifact in made.artifacts]
        except InvalidInput as error:
            raise InvalidInput(error.message, _place(item, error.place.pointer)) from None
        provenance = Provenance("import", None, self.recorded, (item.source,))
        rows = [(a.id, dump_line(encode(replace(a, provenance=provenance)))) for a in artifacts]
        return Written(tuple(rows), place, Counter(a.kind for a in artifacts), made.notes)

    def _asked(self, artifact: Imported) -> Any:
        """Return what --as asks for; raises InvalidInput where the source does not give it."""
        kind = self.options.kind
        if kind is None or artifact.kind == KIND_OF[kind]:
            return artifact
        if kind == "attributes" and artifact.kind == "building" and self.convert is not None:
            return self.convert(artifact)
        raise InvalidInput(f"gives {artifact.kind}, not {kind}; leave --as out")


def _identified(artifact: Imported, stem: str) -> Imported:
    """Return the artifact with the file's name in its id, where its source gives it none."""
    if not artifact.id.startswith(BY_NAME):
        return artifact
    return replace(artifact, id=stem.strip("-") + artifact.id.removeprefix(BY_NAME))
