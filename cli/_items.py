"""Items of a stream mapped for stages that end in files of their own: export, view."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from importlib import import_module
from typing import Any, TypeVar

from facade_tools.artifacts.store import read_raw
from facade_tools.parallel import map_ordered

from ._options import StreamOptions
from ._report import Progress
from ._stream import Faults

R = TypeVar("R")


def load(target: str) -> Callable[..., Any]:
    """Return the function that `module:name` names, importing it now."""
    module, name = target.split(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function


def each(
    name: str,
    function: Callable[[Any], R],
    stream: StreamOptions,
    items: Iterable[Any] | None = None,
) -> Iterator[R]:
    """Yield `function` of every item, in order, with progress and --on-error as asked for.

    items: default is all inputs of the stream. The last thing that it does after skipped items is
    to raise InvalidInput.
    """
    items = read_raw(stream.inputs) if items is None else items
    outcomes = map_ordered(function, items, jobs=stream.jobs, scheduler=stream.scheduler)
    progress, faults = Progress(name), Faults(name, stream.on_error)
    with closing(outcomes):
        for outcome in outcomes:
            if outcome.value is not None:
                yield outcome.value
            elif outcome.error is None:
                continue
            else:
                faults(outcome.error)
            progress.advance()
        progress.close()
    faults.complain()
