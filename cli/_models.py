"""Buildings written as models, as artifacts, or both: derive and reconstruct."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.building import Frame
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_document, dump_line
from facade_tools.artifacts.writing import write_bytes
from facade_tools.errors import InvalidInput, OutputFailed
from facade_tools.formats.exporting import model_files, placed
from facade_tools.geometry.mesh import Scene

from ._stream import file_name, is_folder, open_sink

MODELS = (".glb", ".obj")
DATA = (".json", ".jsonl")


@dataclass(frozen=True)
class Made:
    """One result: the building, and functions that make its scene and its tree when asked."""

    building: Any
    scene: Callable[[], Scene]
    tree: Callable[[], Any]
    frame: Frame | None = None


def write_models(results: Iterable[Made], output: str | None, tree: str | None) -> None:
    """Write results where the options say; an error before leaves no file behind."""
    rows = _checked(list(results))
    writer = _writer(output)
    if tree is not None:
        with open_sink(tree) as write:
            for row in rows:
                _write_artifact(write, row.tree(), tree)
    writer(rows, output)


def _checked(rows: list[Made]) -> list[Made]:
    seen: set[str] = set()
    for row in rows:
        if row.building.id in seen:
            raise InvalidInput(f"id {row.building.id!r} stands twice; expected unique ids")
        seen.add(row.building.id)
    return rows


def _writer(output: str | None) -> Callable[[list[Made], Any], None]:
    if output is None or output == "-" or Path(output).suffix.lower() in DATA:
        return _artifacts
    if is_folder(output):
        return _folder
    if Path(output).suffix.lower() in MODELS:
        return _model
    known = ", ".join((*MODELS, *DATA))
    raise click.UsageError(f"{output}: unknown ending; expected {known} or a folder")


def _artifacts(rows: list[Made], output: str | None) -> None:
    with open_sink(output) as write:
        for row in rows:
            _write_artifact(write, row.building, output)


def _write_artifact(write: Any, artifact: Any, output: str | None) -> None:
    document = encode(artifact)
    lines = output is None or Path(output).suffix.lower() == ".jsonl" or output == "-"
    write(artifact.id, dump_line(document) if lines else dump_document(document))


def _folder(rows: list[Made], output: str) -> None:
    for row in rows:
        _write(Path(output), model_files([row.scene()], file_name(row.building.id), "glb"))


def _model(rows: list[Made], output: str) -> None:
    path = Path(output)
    form = path.suffix.lower().removeprefix(".")
    scenes = placed([row.scene() for row in rows], "auto", [row.frame for row in rows])
    files = model_files(scenes, file_name(path.stem), form)
    main = f"{file_name(path.stem)}.{form}"
    _write(path.parent, {path.name if name == main else name: d for name, d in files.items()})


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputFailed(f"{folder}: cannot be made: {error.strerror}") from error
    for name, data in files.items():
        write_bytes(folder / name, data)
