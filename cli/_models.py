"""Buildings written as models, as artifacts, or both: derive and reconstruct."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.building import Frame
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_document, dump_line
from facade_tools.errors import InvalidInput
from facade_tools.formats.exporting import model_files, placed
from facade_tools.geometry.mesh import Scene

from ._export import write_files
from ._stream import Faults, file_name, is_folder, new_file_name, open_sink

MODELS = (".glb", ".obj")
DATA = (".json", ".jsonl")


@dataclass(frozen=True)
class Made:
    """One result: its id, and those of building, scene and tree that are wanted."""

    id: str
    building: Any = None
    scene: Scene | None = None
    tree: Any = None
    frame: Frame | None = None


@dataclass(frozen=True)
class Wanted:
    """What the output's name asks for: a `building`, a `scene`; and the `tree` beside it."""

    building: bool
    scene: bool
    tree: bool


def wanted(output: str | None, tree: str | None) -> Wanted:
    """Return what is to be made; raises UsageError for an ending that means nothing."""
    ending = "" if output is None else Path(output).suffix.lower()
    data = output is None or output == "-" or ending in DATA
    if not data and ending not in MODELS and not is_folder(output or ""):
        known = ", ".join((*MODELS, *DATA))
        raise click.UsageError(f"{output}: unknown ending; expected {known} or a folder")
    return Wanted(data, not data, tree is not None)


def write_models(
    results: Iterable[Made], outputs: tuple[str | None, str | None], faults: Faults
) -> None:
    """Write results as they come, and their trees, to the outputs; a single model waits for all."""
    output, tree = outputs
    seen: set[str] = set()
    with _opened(output) as write, _trees(tree) as write_tree:

        def put(made: Made) -> None:
            if made.id in seen:
                raise InvalidInput(f"id {made.id!r} stands twice; expected unique ids")
            seen.add(made.id)
            write_tree(made)
            write(made)

        for made in results:
            faults.guard(put, made)


@contextmanager
def _trees(tree: str | None) -> Iterator[Callable[[Made], None]]:
    if tree is None:
        yield lambda made: None
        return
    with open_sink(tree) as write:
        yield lambda made: write(made.id, _bytes(made.tree, tree))


@contextmanager
def _opened(output: str | None) -> Iterator[Callable[[Made], None]]:
    """Open what takes the results themselves."""
    if wanted(output, None).building:
        with open_sink(output) as write:
            yield lambda made: write(made.id, _bytes(made.building, output))
    elif output is not None and not is_folder(output):
        kept: list[Made] = []
        yield kept.append
        _model(kept, Path(output))
    else:
        names: dict[str, str] = {}
        yield lambda made: _alone(made, Path(output or ""), names)


def _bytes(artifact: Any, output: str | None) -> bytes:
    lines = output is None or output == "-" or output.lower().endswith(".jsonl")
    document = encode(artifact)
    return dump_line(document) if lines else dump_document(document)


def _alone(made: Made, folder: Path, names: dict[str, str]) -> None:
    assert made.scene is not None
    write_files(folder, model_files([made.scene], new_file_name(made.id, names), "glb"))


def _model(rows: list[Made], path: Path) -> None:
    form = path.suffix.lower().removeprefix(".")
    scenes = placed([row.scene for row in rows if row.scene], "auto", [row.frame for row in rows])
    files = model_files(scenes, file_name(path.stem), form)
    main = f"{file_name(path.stem)}.{form}"
    write_files(path.parent, {path.name if name == main else name: d for name, d in files.items()})
