"""The body of `facade export`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.store import RawItem
from facade_tools.artifacts.writing import write_bytes
from facade_tools.errors import FacadeError, InvalidInput, OutputFailed
from facade_tools.formats.exporting import ENDINGS, model_files, placed, vertex_count

from ._items import each
from ._options import StreamOptions
from ._stream import Faults, file_name, is_folder, new_file_name, to_stdout
from ._tables import CITY, SCENES, load

MOST_VERTICES = 30_000_000  # in one file: about 2 GB of memory


@dataclass(frozen=True)
class Part:
    """Makes what an item becomes in a model of the format: a Scene, or a CityModel."""

    form: str

    def __call__(self, item: RawItem) -> tuple[Any, Any]:
        """Return the item converted, and its frame; raises InvalidInput with its place."""
        table = CITY if self.form == "cityjson" else SCENES
        artifact = item.artifact(*table)
        try:
            part = load(table[artifact.kind])(artifact)
        except InvalidInput as error:
            raise error.at(item.source, item.line) from None
        except FacadeError as error:
            raise type(error)(f"{artifact.id}: {error}") from None
        if self.form == "obj":
            part = replace(part, note=_note(artifact))
        return part, getattr(artifact, "frame", None)


def _note(artifact: Any) -> str:
    return dump_line(encode(artifact)).decode().strip()


@dataclass(frozen=True)
class Files:
    """Makes all files of an item's own model."""

    form: str
    arrange: str

    def __call__(self, item: RawItem) -> tuple[str, dict[str, bytes]]:
        """Return the item's id and the bytes of its files by name."""
        part, frame = Part(self.form)(item)
        files = model_files(placed([part], self.arrange, [frame]), file_name(part.name), self.form)
        return part.name, files


def run_export(stream: StreamOptions, form: str | None, arrange: str) -> None:
    """Write all items to the output that the options name."""
    output = str(stream.output)
    if output == "-":
        _to_stdout(stream, form or "glb", arrange)
    elif _ending(output) is None and is_folder(output):
        _to_folder(stream, Path(output), Files(form or "glb", arrange))
    else:
        _to_file(stream, Path(output), form or _ending(output), arrange)


def _ending(output: str) -> str | None:
    if output.endswith("/") or Path(output).is_dir():
        return None
    return next((form for form, end in ENDINGS.items() if output.lower().endswith(end)), None)


def _to_folder(stream: StreamOptions, folder: Path, convert: Files) -> None:
    faults = Faults("export", stream.on_error)
    seen: dict[str, str] = {}
    for identity, files in each(convert, stream, faults):
        if faults.guard(new_file_name, identity, seen) is not None:
            write_files(folder, files)
    faults.complain()


def _to_file(stream: StreamOptions, path: Path, form: str | None, arrange: str) -> None:
    if form is None:
        known = ", ".join(ENDINGS.values())
        raise click.UsageError(f"{path}: unknown ending; expected {known}, a folder, or --format")
    end = ENDINGS[form]
    stem = path.name[: -len(end)] if path.name.lower().endswith(end) else path.stem
    faults = Faults("export", stream.on_error)
    files = model_files(_parts(stream, form, arrange, faults), file_name(stem), form)
    renamed = {_as_named(name, file_name(stem) + end, path): data for name, data in files.items()}
    write_files(path.parent, renamed)
    faults.complain()


def _as_named(name: str, main: str, path: Path) -> str:
    return path.name if name == main else name


def _to_stdout(stream: StreamOptions, form: str, arrange: str) -> None:
    if form == "obj":
        raise click.UsageError("OBJ is several files; name a file or a folder with -o.")
    faults = Faults("export", stream.on_error)
    (data,) = model_files(_parts(stream, form, arrange, faults), "stdin", form).values()
    to_stdout("stdin", data)
    faults.complain()


def _parts(stream: StreamOptions, form: str, arrange: str, faults: Faults) -> list[Any]:
    parts, frames, size = [], [], 0
    names: set[str] = set()
    for part, frame in each(Part(form), stream, faults):
        if part.name in names:
            text = f"id {part.name!r} stands twice; expected unique ids in one file"
            faults(InvalidInput(text))
            continue
        names.add(part.name)
        parts.append(part)
        frames.append(frame)
        size += vertex_count(part)
        if size > MOST_VERTICES:
            raise InvalidInput(
                f"more than {MOST_VERTICES:,} vertices; export to a folder or fewer items at a time"
            )
    arranged: list[Any] = placed(parts, arrange, frames)
    return arranged


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files into a folder, made where it is missing. Raises OutputFailed."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputFailed(f"{folder}: cannot be made: {error.strerror}") from error
    for name, data in files.items():
        write_bytes(folder / name, data)
