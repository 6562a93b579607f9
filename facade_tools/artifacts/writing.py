"""Writing: a file appears whole or not at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from ..errors import OutputFailed
from .documents import Artifact, encode
from .numbers import dump_document, dump_line


@contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """Open a file that appears under `path` when the block ends without an error.

    It is written beside, flushed to disk and renamed. What is not a regular file (a device, a
    pipe) is written in place. Raises OutputFailed on a full disk or a missing folder.
    """
    if path.exists() and not path.is_file():
        with _explained(path), path.open("wb") as direct:
            yield direct
        return
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with _explained(path), beside.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        with _explained(path):
            os.replace(beside, path)
    finally:
        with suppress(OSError):  # what stood in the way of writing, stands in the way of this
            beside.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: Path) -> Iterator[Path]:
    """Yield a folder to fill that takes the place of `path` when the block ends without an error.

    An existing folder is replaced only if it looks like one of ours (or is empty).
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    old = path.with_name(f".{path.name}.{os.getpid()}.old.tmp")
    try:
        with _explained(path):
            beside.mkdir(parents=True)
            yield beside
            if path.exists():
                _refuse_foreign(path, beside)
                os.replace(path, old)
            os.replace(beside, path)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def _refuse_foreign(path: Path, fresh: Path) -> None:
    extra = {entry.name for entry in path.iterdir()} - {entry.name for entry in fresh.iterdir()}
    if extra:
        raise OutputFailed(f"{path}: holds other files ({min(extra)}); name an empty or new folder")


def check_target(path: Path) -> None:
    """Raise OutputFailed where a file at `path` would: before the work that it takes to fill it."""
    if path.is_dir() or not path.parent.is_dir():
        raise OutputFailed(f"{path}: cannot be written; expected a file in a folder that exists")


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path` atomically."""
    with atomic_file(path) as file:
        file.write(data)


def write_artifact(path: Path, artifact: Artifact) -> None:
    """Write one artifact: one line to a .jsonl, an indented document otherwise."""
    document = encode(artifact)
    line = path.suffix.lower() == ".jsonl"
    write_bytes(path, dump_line(document) if line else dump_document(document))


def write_artifacts(path: Path, artifacts: Iterable[Artifact]) -> None:
    """Write artifacts as they come, one a line."""
    with atomic_file(path) as file:
        for artifact in artifacts:
            file.write(dump_line(encode(artifact)))


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputFailed(f"{path}: cannot be written: {error.strerror or error}") from error
