"""CityJSON 1.0 to 2.0 and CityJSONSeq: city objects to building models, in bounded memory."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO

from ..artifacts.documents import parse_json
from ..errors import InvalidInput
from . import models
from .cityjson_geometry import Header, Vertices, kind_of, model_of
from .json_stream import pairs, values
from .reading import Built, ReadOptions, Record, without_mark
from .surfaces import Model

TYPE = re.compile(rb'"type"\s*:\s*"CityJSON(Feature)?"')
LONGEST_LINE = 64 << 20
BLOCK = 1 << 20
TEMPLATES = b'"geometry-templates"'


def detect(head: bytes) -> bool:
    """Tell CityJSON and CityJSONSeq by the type."""
    return head.lstrip()[:1] == b"{" and TYPE.search(head) is not None


def records(stream: BinaryIO, options: ReadOptions) -> Iterator[Record]:
    """Yield a record a building, of one document or of a sequence of features."""
    start = without_mark(stream)
    if _is_sequence(stream):
        stream.seek(start)
        yield from models.records(_Sequence(stream, start), options)
        return
    stream.seek(start)
    yield from models.records(_Document(stream, start), options)


def build(record: Record, options: ReadOptions) -> Built:
    """Return the artifacts of one building."""
    return models.build(record, options)


def _is_sequence(stream: BinaryIO) -> bool:
    """Tell a file whose first line is an object and whose next line begins another."""
    last = b""
    while block := stream.readline(BLOCK):
        last = block.rstrip()[-1:] or last
        if block.endswith(b"\n"):
            break
    while block := stream.readline(BLOCK):
        if block.strip():
            return last == b"}" and block.lstrip().startswith(b"{")
    return False


# --- sequences ------------------------------------------------------------------------------------
class _Sequence:
    """A header a line, then a feature a line."""

    def __init__(self, stream: BinaryIO, start: int) -> None:
        self.stream = stream
        line = stream.readline(LONGEST_LINE)
        document = parse_json(line)
        self.first, self.start, self.header = 1, start, Header()
        if document.get("type") == "CityJSON":
            self.first, self.start = 2, stream.tell()
            self.header = Header.of(
                document.get("transform"),
                document.get("metadata"),
                document.get("geometry-templates"),
            )

    def __call__(self) -> Iterator[Model | InvalidInput | models.Line]:
        """Yield the models of all features, each after its line."""
        self.stream.seek(self.start)
        number = self.first
        while line := self.stream.readline(LONGEST_LINE):
            if line.strip():
                yield models.Line(number, line)
                yield from self._feature(line)
            number += 1

    def _feature(self, line: bytes) -> Iterator[Model | InvalidInput]:
        try:
            feature = parse_json(line)
            if not isinstance(feature, dict) or feature.get("type") != "CityJSONFeature":
                raise InvalidInput("is no CityJSONFeature; expected one a line after the header")
            objects = feature.get("CityObjects")
            if not isinstance(objects, dict):
                raise InvalidInput("expected an object", pointer="/CityObjects")
            rows = feature.get("vertices") or []
            if not isinstance(rows, list):
                raise InvalidInput("expected a list", pointer="/vertices")
            vertices = Vertices(iter(rows))
        except InvalidInput as error:
            yield InvalidInput(error.message, pointer=error.place.pointer)
            return
        yield from _grouped(iter(objects.items()), self.header, vertices)


# --- documents ------------------------------------------------------------------------------------
class _Document:
    """One document, read twice object by object."""

    def __init__(self, stream: BinaryIO, start: int) -> None:
        """Read transform, reference system, templates and vertices."""
        self.stream, self.start = stream, start
        templates = self._value("geometry-templates") if self._has_templates() else None
        self.header = Header.of(self._value("transform"), self._value("metadata"), templates)
        stream.seek(start)
        self.vertices = Vertices(values(stream, "vertices.item"))

    def _has_templates(self) -> bool:
        self.stream.seek(self.start)
        before = b""
        while block := self.stream.read(BLOCK):
            if TEMPLATES in before + block:
                return True
            before = block[-len(TEMPLATES) :]
        return False

    def _value(self, name: str) -> Any:
        self.stream.seek(self.start)
        return next(values(self.stream, name), None)

    def __call__(self) -> Iterator[Model | InvalidInput]:
        """Yield the models of all buildings."""
        self.stream.seek(self.start)
        try:
            yield from _grouped(pairs(self.stream, "CityObjects"), self.header, self.vertices)
        except InvalidInput as error:
            yield error


# --- city objects ---------------------------------------------------------------------------------
def _grouped(
    objects: Iterator[tuple[str, Any]], header: Header, vertices: Vertices
) -> Iterator[Model | InvalidInput]:
    """Yield a model a root building as soon as all its children were read."""
    waiting: dict[str, _Group] = {}  # root -> its objects so far
    root_of: dict[str, str] = {}
    orphans: dict[str, Any] = {}
    for name, item in objects:
        if not isinstance(item, dict):
            yield InvalidInput("expected an object", pointer=f"/CityObjects/{name}")
            continue
        if not kind_of(item).startswith("Building"):
            continue
        if any(not isinstance(item.get(key) or [], list) for key in ("parents", "children")):
            text = "parents or children are no list; expected ids of city objects"
            yield InvalidInput(text, pointer=f"/CityObjects/{name}")
            continue
        parents = item.get("parents") or []
        root = name if not parents else root_of.get(str(parents[0]))
        if root is None:
            orphans[name] = item
            continue
        group = waiting.setdefault(root, _Group())
        root_of.update(dict.fromkeys(group.take(name, item, orphans), root))
        if not group.missing:
            for member in waiting.pop(root).members:
                root_of.pop(member, None)
            yield _model(root, group.members, header, vertices)
    for root, group in waiting.items():
        yield _model(root, group.members, header, vertices)
    for name, item in orphans.items():
        if kind_of(item) == "BuildingPart":
            yield _model(name, {name: item}, header, vertices)
        else:
            yield InvalidInput("its parent is not in the file", pointer=f"/CityObjects/{name}")


@dataclass
class _Group:
    """The objects of a root building that were read, and the ids of those that were not."""

    members: dict[str, Any] = field(default_factory=dict)
    missing: set[str] = field(default_factory=set)

    def take(self, name: str, item: dict[str, Any], orphans: dict[str, Any]) -> list[str]:
        """Add an object and all below it that wait; return the ids that now belong here."""
        found = []
        rows = [(name, item)]
        while rows:
            name, item = rows.pop()
            self.members[name] = item
            self.missing.discard(name)
            children = [str(child) for child in item.get("children") or []]
            self.missing.update(child for child in children if child not in self.members)
            found += [name, *children]
            rows += [(child, orphans.pop(child)) for child in children[::-1] if child in orphans]
        return found


def _model(
    root: str, members: Mapping[str, Any], header: Header, vertices: Vertices
) -> Model | InvalidInput:
    try:
        return model_of(root, members, header, vertices)
    except InvalidInput as error:
        return InvalidInput(error.message, pointer=f"/CityObjects/{root}")
    except (
        TypeError,
        ValueError,
        LookupError,
        AttributeError,
        RecursionError,
        OverflowError,
    ) as error:
        text = f"broken geometry ({type(error).__name__}: {error})"
        return InvalidInput(text, pointer=f"/CityObjects/{root}")
