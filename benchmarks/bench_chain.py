"""Memory and speed of the whole chain: sample | massgen | facadegen | export, one process each.

    python benchmarks/bench_chain.py MODEL [-n 10000] [-o FOLDER]

Prints for each stage the resident memory (MiB) when a tenth, a half and all of the run is over, its
growth a thousand buildings after the first tenth, and its processor time; then finished GLB files
a second of processor time of the whole chain. Linux only: it reads /proc.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FACADE = str(Path(sys.executable).with_name("facade"))
STAGES = ("sample", "massgen", "facadegen", "export")
PAGE = os.sysconf("SC_PAGE_SIZE") / 2**20
EVERY = 0.5  # seconds between two looks at the memory


def commands(model: str, count: int, out: str) -> list[list[str]]:
    return [
        ["sample", model, "-n", str(count)],
        ["massgen", "-"],
        ["facadegen", "-"],
        ["export", "-", "-o", out],
    ]


def resident(process: subprocess.Popen[bytes]) -> float:
    """Return a running process's resident memory (MiB), 0 when it has ended."""
    try:
        return int(Path(f"/proc/{process.pid}/statm").read_text().split()[1]) * PAGE
    except (OSError, IndexError):
        return 0.0


def run_chain(model: str, count: int, out: str) -> tuple[list[list[float]], list[float], float]:
    """Return the memory of each stage over time, its processor seconds, and the time."""
    start = time.perf_counter()
    running: list[subprocess.Popen[bytes]] = []
    for words in commands(model, count, out):
        source = running[-1].stdout if running else None
        process = subprocess.Popen([FACADE, "-q", *words], stdin=source, stdout=subprocess.PIPE)
        if source is not None:
            source.close()
        running.append(process)
    seen: list[list[float]] = [[] for _ in running]
    ends: dict[int, float] = {}
    while len(ends) < len(running):
        time.sleep(EVERY)
        for k, process in enumerate(running):
            if k in ends:
                continue
            seen[k].append(resident(process))
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                if status:
                    raise SystemExit(f"{STAGES[k]} ended with status {status}")
                ends[k] = usage.ru_utime + usage.ru_stime
    return seen, [ends[k] for k in range(len(running))], time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("model")
    parser.add_argument("-n", "--count", type=int, default=10_000)
    parser.add_argument("-o", "--out")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as spare:
        out = options.out or spare
        seen, seconds, wall = run_chain(options.model, options.count, out)
        done = len(list(Path(out).glob("*.glb")))
    print(f"{done} of {options.count} buildings finished in {wall:.0f} s\n")
    print(f"{'stage':<12}{'10%':>8}{'50%':>8}{'end':>8}{'MiB a 1,000':>14}{'CPU s':>9}")
    for name, rows, cpu in zip(STAGES, seen, seconds, strict=True):
        alive = [row for row in rows if row > 0]
        early, half, end = (alive[int(share * (len(alive) - 1))] for share in (0.1, 0.5, 1.0))
        slope = (end - early) / (0.9 * options.count / 1000)
        print(f"{name:<12}{early:8.0f}{half:8.0f}{end:8.0f}{slope:14.2f}{cpu:9.0f}")
    print(f"\nfinished GLB a second of processor time: {done / sum(seconds):.1f} (goal 1)")


if __name__ == "__main__":
    main()
