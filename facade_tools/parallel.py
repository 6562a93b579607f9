"""One function over a stream of items: in this process, in local workers, on a Dask cluster.

Results come back in the order of the items, at most a window of them in memory, and are the same
on all three: nothing an item's function sees depends on where or when it runs.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import InvalidInput, WorkerDied
from .workers import AHEAD, Outcome, attempt, map_in_workers

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Outcome", "attempt", "map_ordered"]

T = TypeVar("T")
R = TypeVar("R")

CONNECT_SECONDS = 10


def map_ordered(
    function: Callable[[T], R],
    items: Iterable[T],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
) -> Generator[Outcome[R], None, None]:
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
        yield from map_in_workers(function, items, jobs)


def _on_cluster(
    function: Callable[[T], R], items: Iterable[T], address: str
) -> Generator[Outcome[R], None, None]:
    client = _connect(address)
    try:
        remote = client.scatter(function, broadcast=True, hash=False)
        window = max(2, AHEAD * sum(client.nthreads().values()))
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
        return Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
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
