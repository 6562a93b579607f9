"""Items of a stream mapped for stages that end in files of their own: export, view."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from typing import Any, TypeVar

from facade_tools.artifacts.store import read_raw
from facade_tools.parallel import map_ordered

from ._options import StreamOptions
from ._report import Progress
from ._stream import Faults

R = TypeVar("R")


def each(
    function: Callable[[Any], R],
    stream: StreamOptions,
    faults: Faults,
    items: Iterable[Any] | None = None,
) -> Iterator[R]:
    """Yield `function` of every item, in order, with progress; bad items go to `faults`.

    items: default is all inputs of the stream. Who has written what was yielded lets the faults
    complain.
    """
    items = read_raw(stream.inputs) if items is None else items
    outcomes = map_ordered(function, items, jobs=stream.jobs, scheduler=stream.scheduler)
    progress = Progress(faults.stage)
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
