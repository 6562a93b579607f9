from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from facade_tools.errors import InvalidInput, WorkerDied
from facade_tools.parallel import map_ordered
from facade_tools.randomness import item_generator


def draw(item: int) -> float:
    return float(item_generator(7, "test", item).normal())


def fragile(item: int) -> int:
    if item == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    if item == 5:
        raise InvalidInput("five", pointer="/five")
    if item == 6:
        raise KeyError("six")
    return item


def outcomes(function, items, **options):
    return [outcome.value for outcome in map_ordered(function, items, **options)]


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_order_and_values_do_not_depend_on_the_number_of_jobs(jobs):
    expected = [draw(item) for item in range(200)]
    assert outcomes(draw, range(200), jobs=jobs) == expected


def test_no_items_give_no_outcomes():
    assert outcomes(draw, [], jobs=2) == []
    assert outcomes(draw, [], jobs=1) == []


def test_a_dead_worker_is_the_failure_of_its_item_alone():
    found = list(map_ordered(fragile, range(10), jobs=2))
    assert [outcome.value for outcome in found] == [0, 1, 2, None, 4, None, None, 7, 8, 9]
    assert isinstance(found[3].error, WorkerDied)
    assert isinstance(found[5].error, InvalidInput)
    assert found[5].error.place.pointer == "/five"
    assert "KeyError" in str(found[6].error)
    assert "fragile" in found[6].traceback


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_of_the_source_comes_after_the_items_before_it(jobs):
    def source():
        yield from range(5)
        raise InvalidInput("the sixth")

    seen = []
    with pytest.raises(InvalidInput, match="the sixth"):
        seen.extend(outcome.value for outcome in map_ordered(draw, source(), jobs=jobs))
    assert seen == [] or len(seen) <= 5
    stream = map_ordered(draw, source(), jobs=jobs)
    assert [next(stream).value for _ in range(5)] == [draw(item) for item in range(5)]
    with pytest.raises(InvalidInput):
        next(stream)


def test_only_a_window_of_items_is_read_ahead():
    taken = []

    def source():
        for item in range(10_000):
            taken.append(item)
            yield item

    stream = map_ordered(draw, source(), jobs=2)
    next(stream)
    assert len(taken) < 200
    stream.close()


def test_dask_gives_the_same_values():
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
    )
    with cluster:
        found = list(map_ordered(draw, range(50), scheduler=cluster.scheduler_address))
    assert [outcome.value for outcome in found] == [draw(item) for item in range(50)]


def test_no_scheduler_is_invalid_input():
    pytest.importorskip("distributed")
    with pytest.raises(InvalidInput, match="no Dask scheduler"):
        list(map_ordered(draw, [1], scheduler="nonsense://address"))


SLOW = """
import sys, time
from facade_tools.parallel import map_ordered
if __name__ == "__main__":
    print("ready", flush=True)
    for _ in map_ordered(time.sleep, [60] * 8, jobs=2):
        pass
"""


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_workers_end_with_their_parent(tmp_path, how):
    script = tmp_path / "slow.py"
    script.write_text(SLOW)
    parent = subprocess.Popen(
        [sys.executable, str(script)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert parent.stdout is not None
    assert parent.stdout.readline()
    wait_for(lambda: len(children(parent.pid)) >= 2)
    workers = children(parent.pid)
    parent.send_signal(how)
    parent.wait(timeout=10)
    parent.stdout.close()
    wait_for(lambda: not any(alive(worker) for worker in workers))


def wait_for(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def children(parent: int) -> list[int]:
    tasks = Path(f"/proc/{parent}/task")
    if not tasks.is_dir():
        pytest.skip("no /proc here")
    found = (path.read_text().split() for path in tasks.glob("*/children"))
    return [int(pid) for pids in found for pid in pids]


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False
