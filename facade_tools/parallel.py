"""One function over a stream of items: in this process, in local workers, on a Dask cluster.

Results come back in the order of the items, at most a window of them in memory, and are the same
on all three: nothing an item's function sees depends on where or when it runs.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from .errors import FacadeError, InvalidInput, WorkerDied

if TYPE_CHECKING:
    from distributed import Client

T = TypeVar("T")
R = TypeVar("R")

CHUNK_SECONDS = 0.02  # items faster than this travel to the workers together
LARGEST_CHUNK = 64
CHUNKS_AHEAD = 3  # in flight per worker: enough to hide the way to the worker and back


@dataclass(frozen=True, slots=True)
class Outcome(Generic[R]):
    """What became of one item: its value, or the error and the worker's traceback as text."""

    value: R | None = None
    error: Exception | None = None
    traceback: str = ""


def map_ordered(
    function: Callable[[T], R],
    items: Iterable[T],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
) -> Iterator[Outcome[R]]:
    """Yield the outcome of `function` for every item, in order.

    jobs: worker processes; 1 stays in this process, 0 takes all cores. scheduler: address of a
    Dask scheduler, which then has the say. `function` and items must pickle where there are
    workers. An item that kills its worker is tried once more alone, then its outcome is
    `WorkerDied`. An exception of the items' own iterator passes through after the outcomes of the
    items before it.
    """
    jobs = jobs or os.cpu_count() or 1
    if scheduler is not None:
        yield from _on_cluster(function, items, scheduler)
    elif jobs == 1:
        yield from (attempt(function, item) for item in items)
    else:
        yield from _in_pool(function, items, jobs)


def attempt(function: Callable[[T], R], item: T) -> Outcome[R]:
    """Call `function` on `item`; an exception becomes part of the outcome."""
    try:
        return Outcome(value=function(item))
    except FacadeError as error:
        return Outcome(error=error)
    except Exception as error:  # a bug in one item must not lose the others' results
        return Outcome(error=_picklable(error), traceback=traceback.format_exc())


def _picklable(error: Exception) -> Exception:
    return RuntimeError(f"{type(error).__name__}: {error}")


# --- local processes ----------------------------------------------------------------------------


class _Worker:
    """Holds a worker process's function, sent once at its start instead of with every item."""

    function: Callable[[Any], Any]


def _start_worker(function: Callable[[Any], Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    _Worker.function = function
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_chunk(chunk: list[Any]) -> tuple[list[Outcome[Any]], float]:
    start = time.perf_counter()
    outcomes = [attempt(_Worker.function, item) for item in chunk]
    return outcomes, time.perf_counter() - start


class _Pool(Generic[T, R]):
    """A process pool that survives the death of its workers."""

    def __init__(self, function: Callable[[T], R], jobs: int) -> None:
        self.function = function
        self.jobs = jobs
        self.executor = self._new(jobs)

    def _new(self, jobs: int) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        arguments = (self.function,)
        return ProcessPoolExecutor(jobs, context, initializer=_start_worker, initargs=arguments)

    def submit(self, chunk: list[T]) -> Future[Any] | None:
        """Send a chunk; None where the pool is broken (its items will be run alone)."""
        try:
            return self.executor.submit(_run_chunk, chunk)
        except BrokenProcessPool:
            return None

    def result(self, chunk: list[T], future: Future[Any] | None) -> tuple[list[Outcome[R]], float]:
        """Wait for a chunk; after a worker's death run its items one by one, each alone."""
        try:
            if future is not None:
                result: tuple[list[Outcome[R]], float] = future.result()
                return result
        except BrokenProcessPool:
            pass
        return [self._alone(item) for item in chunk], CHUNK_SECONDS

    def _alone(self, item: T) -> Outcome[R]:
        with self._new(1) as executor:
            try:
                outcome: Outcome[R] = executor.submit(_run_chunk, [item]).result()[0][0]
                return outcome
            except BrokenProcessPool:
                why = "the worker process died on this item (out of memory, or a crash)"
                return Outcome(error=WorkerDied(why))

    def renew_if_broken(self) -> None:
        try:
            self.executor.submit(int).cancel()
        except BrokenProcessPool:
            self.executor.shutdown(wait=False, cancel_futures=True)
            self.executor = self._new(self.jobs)

    def close(self) -> None:
        self.executor.shutdown(wait=True, cancel_futures=True)

    def kill(self) -> None:
        """End the workers at once: their results are not wanted any more."""
        children = multiprocessing.active_children()
        for child in children:
            child.kill()
        self.executor.shutdown(wait=False, cancel_futures=True)


def _in_pool(function: Callable[[T], R], items: Iterable[T], jobs: int) -> Iterator[Outcome[R]]:
    pool: _Pool[T, R] = _Pool(function, jobs)
    stream = iter(items)
    ahead: deque[tuple[list[T], Future[Any] | None]] = deque()
    failure: list[Exception] = []
    size = 1
    finished = False
    try:
        while True:
            while not failure and len(ahead) < jobs * CHUNKS_AHEAD:
                chunk = _take(stream, size, failure)
                if not chunk:
                    break
                ahead.append((chunk, pool.submit(chunk)))
            if not ahead:
                break
            outcomes, seconds = pool.result(*ahead.popleft())
            pool.renew_if_broken()
            size = _next_size(size, len(outcomes), seconds)
            yield from outcomes
        finished = True
    finally:
        pool.close() if finished else pool.kill()
    if failure:
        raise failure[0]


def _take(stream: Iterator[T], size: int, failure: list[Exception]) -> list[T]:
    """Return the next items; an error of the stream is kept for after the items before it."""
    chunk: list[T] = []
    try:
        for item in islice(stream, size):
            chunk.append(item)
    except Exception as error:
        failure.append(error)
    return chunk


def _next_size(size: int, count: int, seconds: float) -> int:
    if seconds < CHUNK_SECONDS / 2 and count == size:
        return min(2 * size, LARGEST_CHUNK)
    return max(size // 2, 1) if seconds > 4 * CHUNK_SECONDS else size


# --- Dask ---------------------------------------------------------------------------------------


def _on_cluster(
    function: Callable[[T], R], items: Iterable[T], address: str
) -> Iterator[Outcome[R]]:
    client = _connect(address)
    try:
        remote = client.scatter(function, broadcast=True, hash=False)
        window = max(2, CHUNKS_AHEAD * sum(client.nthreads().values()))
        ahead: deque[Any] = deque()
        for item in items:
            ahead.append(client.submit(attempt, remote, item, pure=False, retries=1))
            if len(ahead) >= window:
                yield _cluster_outcome(ahead.popleft())
        while ahead:
            yield _cluster_outcome(ahead.popleft())
    finally:
        client.close()


def _connect(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError:
        message = "--scheduler needs the optional extra: pip install 'facade-tools[cluster]'"
        raise InvalidInput(message) from None
    try:
        return Client(address, timeout=10, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        reason = str(error).split("\n")[0]
        raise InvalidInput(f"no Dask scheduler answers at {address}: {reason}") from None


def _cluster_outcome(future: Any) -> Outcome[Any]:
    from distributed.scheduler import KilledWorker

    try:
        outcome: Outcome[Any] = future.result()
        return outcome
    except KilledWorker:
        why = "the cluster's workers died on this item (out of memory, or a crash)"
        return Outcome(error=WorkerDied(why))


def interrupt_on_terminate() -> None:
    """Let SIGTERM end the program like Ctrl-C, so that unfinished files are removed."""

    def stop(*_: object) -> None:
        sys.exit(128 + signal.SIGTERM)

    signal.signal(signal.SIGTERM, stop)
