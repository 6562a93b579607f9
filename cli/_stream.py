"""Stages over streams: read, map in order, write; the same for every stage."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import click

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_document, dump_line
from facade_tools.artifacts.provenance import Provenance, Source
from facade_tools.artifacts.store import RawItem, digest, read_raw
from facade_tools.artifacts.writing import atomic_file, write_bytes
from facade_tools.errors import FacadeError, InvalidInput, OutputFailed
from facade_tools.parallel import map_ordered
from facade_tools.randomness import item_generator

from ._options import StreamOptions
from ._report import Message, Progress, ReaderLeft, collected_log, say_error, show_messages

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class ItemResult:
    """Id and bytes of every artifact that an item became, and the log of its making."""

    artifacts: tuple[tuple[str, bytes], ...]
    messages: list[Message]


@dataclass(frozen=True)
class ItemStage:
    """A stage's library function with its options, ready to run on raw items in any process.

    `function(artifact, **options)` returns an artifact or an iterable of them; where `seed` is
    not None it also takes `rng`, the generator of the item. `recorded` are the options that the
    provenance names, `sources` the side inputs (model, library).
    """

    name: str
    reads: tuple[str, ...]
    function: Callable[..., Any]
    options: Mapping[str, Any] = field(default_factory=dict)
    recorded: Mapping[str, Any] = field(default_factory=dict)
    sources: tuple[Source, ...] = ()
    seed: int | None = None
    indented: bool = False

    def __call__(self, item: RawItem) -> ItemResult:
        """Return id and bytes of every artifact made from `item`, and what was logged."""
        with collected_log() as messages:
            return ItemResult(tuple(self._artifacts(item)), messages)

    def _artifacts(self, item: RawItem) -> Iterator[tuple[str, bytes]]:
        artifact = item.artifact(*self.reads)
        rng = (
            {} if self.seed is None else {"rng": item_generator(self.seed, self.name, artifact.id)}
        )
        inputs = (item.provenance(), *self.sources)
        provenance = Provenance(self.name, self.seed, self.recorded, inputs)
        dump = dump_document if self.indented else dump_line
        try:
            results = self.function(artifact, **self.options, **rng)
            for result in results if isinstance(results, Iterable) else [results]:
                yield result.id, dump(encode(replace(result, provenance=provenance)))
        except InvalidInput as error:
            raise error.at(item.source, item.line) from None
        except FacadeError as error:
            raise type(error)(f"{_place(item)}: {artifact.id}: {error}") from None


@dataclass
class Faults:
    """Takes the errors of items: raises the first one, or reports each where --on-error skips."""

    stage: str
    on_error: str
    count: int = 0

    def stops(self, error: Exception) -> bool:
        """Tell whether an error ends the stage; a bug is never skipped."""
        return self.on_error == "stop" or not isinstance(error, FacadeError)

    def __call__(self, error: Exception) -> None:
        """Take one error."""
        if self.stops(error):
            raise error
        say_error(self.stage, error)
        self.count += 1

    def guard(self, work: Callable[..., R], *given: Any) -> R | None:
        """Return what `work` makes of its arguments; None where what it refuses was taken."""
        try:
            return work(*given)
        except InvalidInput as error:
            self(error)
            return None

    def complain(self) -> None:
        """Raise InvalidInput if anything was left out."""
        if self.count:
            raise InvalidInput(f"{self.count} bad items were skipped")


def _place(item: RawItem) -> str:
    return item.source if item.line is None else f"{item.source}:{item.line}"


def side_input(path: str | None) -> tuple[Source, ...]:
    """Return the provenance of a side input (model, library) if one was named."""
    return () if path is None else (digest(path),)


def run_stream(stage: ItemStage, stream: StreamOptions) -> None:
    """Run a stage over all inputs; raises the first error, or after --on-error skip the last."""
    made = replace(stage, seed=stream.seed, indented=is_single(stream.output))
    run_items(stage.name, made, read_raw(stream.inputs), stream)


def run_items(
    name: str, function: Callable[[Any], ItemResult], items: Iterable[Any], stream: StreamOptions
) -> None:
    """Write what `function` makes of each item; raises as `run_stream` does."""
    faults = Faults(name, stream.on_error)
    write_items(function, items, stream, faults)
    faults.complain()


def write_items(
    function: Callable[[Any], ItemResult],
    items: Iterable[Any],
    stream: StreamOptions,
    faults: Faults,
) -> None:
    """Write what `function` makes of each item; bad items go to `faults`."""
    outcomes = map_ordered(function, items, jobs=stream.jobs, scheduler=stream.scheduler)
    progress = Progress(faults.stage)
    with open_sink(stream.output, inputs=stream.inputs) as write, closing(outcomes):
        for outcome in outcomes:
            if outcome.value is not None:
                show_messages(outcome.value.messages)
                for identity, data in outcome.value.artifacts:
                    faults.guard(write, identity, data)
            elif outcome.error is None:
                continue
            else:
                if faults.stops(outcome.error):
                    _show_remote(outcome.traceback)
                faults(outcome.error)
            progress.advance()
        progress.close()


def _show_remote(traceback: str) -> None:
    if traceback and click.get_current_context().find_root().params.get("debug"):
        click.echo(traceback, err=True)


LONGEST_NAME = 200  # bytes; of 255 that file systems take, endings and marks need some
Write = Callable[[str, bytes], None]


def is_single(output: str | None) -> bool:
    """Tell whether an output is a file of one artifact."""
    return output is not None and Path(output).suffix.lower() == ".json"


def is_folder(output: str) -> bool:
    """Tell whether an output path means a folder: it is one, ends in a slash, or has no suffix.

    Devices and pipes (`/dev/null`, `/dev/fd/63`) are none.
    """
    path = Path(output)
    if output.endswith("/") or path.is_dir():
        return True
    return not path.suffix and (path.is_file() or not path.exists())


def one_by_one(output: str | None) -> bool:
    """Tell whether an output takes artifacts one by one: a folder, or a file for a single one."""
    return output not in (None, "-") and (is_folder(str(output)) or is_single(output))


@contextmanager
def open_sink(
    output: str | None, suffix: str = ".json", inputs: Iterable[str] = ()
) -> Iterator[Write]:
    """Open what takes the results: standard output, one file, or a folder with a file an item.

    inputs: files that no item may overwrite.
    """
    if output is None or output == "-":
        yield to_stdout
    elif is_folder(output):
        yield _to_folder(Path(output), suffix, frozenset(map(os.path.realpath, inputs)))
    else:
        with atomic_file(Path(output)) as file:
            yield _to_file(file, output)


def to_stdout(_: str, data: bytes) -> None:
    """Write bytes to standard output; raises ReaderLeft or OutputFailed."""
    try:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
    except BrokenPipeError:
        raise ReaderLeft from None
    except OSError as error:
        raise OutputFailed(f"standard output cannot be written: {error.strerror}") from error


def _to_file(file: BinaryIO, output: str) -> Write:
    count = 0

    def write(_: str, data: bytes) -> None:
        nonlocal count
        count += 1
        if count > 1 and is_single(output):
            raise OutputFailed(f"{output}: several artifacts; name a .jsonl file or a folder")
        file.write(data)

    return write


def _to_folder(folder: Path, suffix: str, inputs: frozenset[str]) -> Write:
    seen: dict[str, str] = {}

    def write(identity: str, data: bytes) -> None:
        name = new_file_name(identity, seen) + suffix
        if os.path.realpath(folder / name) in inputs:
            raise OutputFailed(f"{folder / name}: is an input; name another folder")
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputFailed(f"{folder}: cannot be made: {error.strerror}") from error
        write_bytes(folder / name, data)

    return write


def file_name(identity: str) -> str:
    """Return a file name for an item's id: what could leave the folder is replaced."""
    safe = "".join(c if c.isalnum() or c in "-_.+@" else "_" for c in identity)
    short = safe.encode()[:LONGEST_NAME].decode(errors="ignore")
    return short.lstrip(".") or "_"


def new_file_name(identity: str, seen: dict[str, str]) -> str:
    """Return the file name of an item's id; raises InvalidInput where another one took it.

    seen: ids by their file names so far, without case, which not every file system tells apart.
    """
    name = file_name(identity)
    other = seen.setdefault(name.casefold(), "")
    if other == identity:
        raise InvalidInput(f"id {identity!r} stands twice; expected unique ids in a folder")
    if other:
        text = f"ids {other!r} and {identity!r} have one file name, {name} (case does not count)"
        raise InvalidInput(f"{text}; expected ids that differ in letters and digits")
    seen[name.casefold()] = identity
    return name


def refuse_single(output: str | None, count: int, noun: str) -> None:
    """Raise UsageError where one .json file is to take several artifacts."""
    if count > 1 and is_single(output):
        raise click.UsageError(f"{output}: several {noun}; name a .jsonl file or a folder")


def write_result(artifact: Any, output: str | None) -> None:
    """Write the only result of a stage."""
    document = encode(artifact)
    with open_sink(output) as write:
        write(artifact.id, dump_document(document) if is_single(output) else dump_line(document))
