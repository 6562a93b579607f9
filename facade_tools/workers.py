"""Local worker processes that may die without losing anybody else's results.

The standard library's pools either hang or break as a whole when a worker is killed, so each of
ours has a pipe of its own and is replaced alone.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

from .errors import FacadeError, WorkerDied

T = TypeVar("T")
R = TypeVar("R")

AHEAD = 3  # chunks taken from the stream per worker: hides the way to the worker and back
FAST, SLOW = 0.01, 0.1  # seconds a chunk: below the one it grows, above the other it shrinks
LARGEST_CHUNK = 64
END_SECONDS = 5.0  # a worker that has not ended by then is killed


@dataclass(frozen=True, slots=True)
class Outcome(Generic[R]):
    """What became of one item: its value, or the error and the worker's traceback as text."""

    value: R | None = None
    error: Exception | None = None
    traceback: str = ""


def attempt(function: Callable[[T], R], item: T) -> Outcome[R]:
    """Call `function` on `item`; an exception becomes part of the outcome."""
    try:
        return Outcome(value=function(item))
    except FacadeError as error:
        return Outcome(error=error)
    except Exception as error:  # a bug in one item must not lose the others' results
        # Somebody else's exception may not pickle; its text always does.
        told = RuntimeError(f"{type(error).__name__}: {error}")
        return Outcome(error=told, traceback=traceback.format_exc())


def _work(connection: Connection, function: Callable[[Any], Any]) -> None:
    """Run chunks from the pipe until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            chunk = connection.recv()
        except EOFError:
            return
        start = time.perf_counter()
        outcomes = [attempt(function, item) for item in chunk]
        connection.send((outcomes, time.perf_counter() - start))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


class _Slot:
    """Results of consecutive items, filled in any order."""

    def __init__(self, size: int) -> None:
        self.outcomes: list[Outcome[Any] | None] = [None] * size

    def done(self) -> bool:
        return None not in self.outcomes


@dataclass(frozen=True, slots=True)
class _Task:
    slot: _Slot
    start: int
    chunk: list[Any]
    alone: bool = False  # second try, after a worker died on the chunk


class _Worker:
    """One process and its pipe."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(
            target=_work, args=(theirs, function), daemon=True
        )
        self.process.start()
        theirs.close()
        self.task: _Task | None = None

    def close(self) -> None:
        self.connection.close()
        self.process.join(END_SECONDS)
        self.kill()

    def kill(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()


class _Crew:
    """The workers, what they do, and what is left to do again."""

    def __init__(self, function: Callable[[Any], Any], jobs: int) -> None:
        self.function = function
        self.workers = [_Worker(function) for _ in range(jobs)]
        self.again: deque[_Task] = deque()
        self.chunk_size = 1

    def idle(self) -> list[_Worker]:
        return [worker for worker in self.workers if worker.task is None]

    def give(self, worker: _Worker, task: _Task) -> None:
        """Send a task to an idle worker."""
        try:
            worker.connection.send(task.chunk)
            worker.task = task
        except ConnectionError:  # it died while idle
            self._replace(worker, task)

    def collect(self) -> None:
        """Wait until a worker has an answer or has died, and take note of it."""
        busy = {worker.connection: worker for worker in self.workers if worker.task is not None}
        for connection in wait(list(busy)):
            worker = busy[connection]  # type: ignore[index]
            task, worker.task = worker.task, None
            assert task is not None
            try:
                outcomes, seconds = worker.connection.recv()
            except (EOFError, ConnectionError):
                self._replace(worker, task)
            else:
                task.slot.outcomes[task.start : task.start + len(outcomes)] = outcomes
                self._adapt(len(outcomes), seconds)

    def _adapt(self, count: int, seconds: float) -> None:
        """Let items travel together when the way costs more than the work."""
        if seconds > SLOW:
            self.chunk_size = max(self.chunk_size // 2, 1)
        elif seconds < FAST and count == self.chunk_size:
            self.chunk_size = min(2 * self.chunk_size, LARGEST_CHUNK)

    def _replace(self, dead: _Worker, task: _Task) -> None:
        dead.kill()
        self.workers[self.workers.index(dead)] = _Worker(self.function)
        if task.alone:
            why = "the worker process died on this item (out of memory, or a crash)"
            task.slot.outcomes[task.start] = Outcome(error=WorkerDied(why))
            return
        for offset, item in enumerate(task.chunk):
            self.again.append(_Task(task.slot, task.start + offset, [item], alone=True))


def map_in_workers(
    function: Callable[[T], R], items: Iterable[T], jobs: int
) -> Generator[Outcome[R], None, None]:
    """Yield the outcomes of `items` in order from `jobs` processes (see parallel.map_ordered)."""
    crew = _Crew(function, jobs)
    stream = _Stream(iter(items))
    slots: deque[_Slot] = deque()
    finished = False
    try:
        while True:
            for worker in crew.idle():
                task = crew.again.popleft() if crew.again else None
                if task is None and len(slots) < jobs * AHEAD:
                    task = stream.task(crew.chunk_size)
                    slots.extend([task.slot] if task else [])
                if task is not None:
                    crew.give(worker, task)
            while slots and slots[0].done():
                yield from slots.popleft().outcomes  # type: ignore[misc]
            if not slots and stream.ended:
                break
            if any(worker.task is not None for worker in crew.workers):
                crew.collect()
        finished = True
    finally:
        for worker in crew.workers:
            worker.close() if finished else worker.kill()
    if stream.failure is not None:
        raise stream.failure


class _Stream(Generic[T]):
    """Takes chunks from an iterator; its error is kept for after the items before it."""

    def __init__(self, items: Iterator[T]) -> None:
        self.items = items
        self.ended = False
        self.failure: Exception | None = None

    def task(self, size: int) -> _Task | None:
        chunk: list[T] = []
        try:
            if not self.ended:
                for item in islice(self.items, size):
                    chunk.append(item)
        except Exception as error:
            self.failure = error
        self.ended = len(chunk) < size
        return _Task(_Slot(len(chunk)), 0, chunk) if chunk else None
