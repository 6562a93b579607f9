"""Attributes a second: the library function, the facade pieces, and the whole command.

    python benchmarks/bench_attributes.py [BUILDINGS...]

Without arguments it takes the shipped sample houses.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from facade_tools.artifacts.store import read
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.geometry.pieces import facade_pieces

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data" / "houses"
SECONDS = 2.0
GOAL = 2000


def rate(function, items) -> float:
    function(items[0])
    start, count = time.process_time(), 0
    while time.process_time() - start < SECONDS:
        for item in items:
            function(item)
        count += len(items)
    return count / (time.process_time() - start)


def command_rate(paths) -> float:
    facade = str(Path(sys.executable).with_name("facade"))
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        subprocess.run([facade, "attributes", *paths, "-o", f"{folder}/a.jsonl"], check=True)
        seconds = time.perf_counter() - start
        return len(Path(folder, "a.jsonl").read_bytes().splitlines()) / seconds


def main() -> None:
    paths = sys.argv[1:] or [str(SAMPLES)]
    houses = list(read(paths, "building"))
    library = rate(building_attributes, houses)
    print(f"buildings                    {len(houses)}")
    ratio = f"{library / GOAL:5.2f} × the goal of {GOAL}/s"
    print(f"building_attributes          {library:8.0f}/s   {ratio}")
    print(f"facade_pieces                {rate(facade_pieces, houses):8.0f}/s")
    print(f"facade attributes (process)  {command_rate(paths):8.0f}/s")


if __name__ == "__main__":
    main()
