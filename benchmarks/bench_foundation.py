"""Start-up, validation's share of a run, attributes a second, seconds of each stage of the chain.

python benchmarks/bench_foundation.py [--real FOLDER_OF_H2K_HOUSES]
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from facade_tools.artifacts.codec import from_json
from facade_tools.artifacts.documents import artifact_class, encode, parse_json
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.store import read_raw
from facade_tools.artifacts.validation import check
from facade_tools.exteriors.attributes import building_attributes

ROOT = Path(__file__).resolve().parent.parent
HOUSES = ROOT / "sample_data" / "houses"
FACADE = str(Path(sys.executable).with_name("facade"))


def seconds(words: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - start


def paired_ratio(ours: list[str], theirs: list[str], runs: int = 15) -> tuple[float, float, float]:
    """Median seconds of both commands, run in turn, and the median of the ratios pair by pair."""
    seconds(ours), seconds(theirs)
    pairs = [(seconds(ours), seconds(theirs)) for _ in range(runs)]
    ratios = [a / b for a, b in pairs]
    medians = [statistics.median(column) for column in zip(*pairs, strict=True)]
    return medians[0], medians[1], statistics.median(ratios)


def start_up() -> None:
    ours, theirs, ratio = paired_ratio([FACADE, "--help"], [sys.executable, "-c", "import click"])
    print(f"facade --help            {1e3 * ours:8.0f} ms")
    print(f"python -c 'import click' {1e3 * theirs:8.0f} ms")
    print(f"ratio                    {ratio:8.2f}   (at most 1.5)")


def steps_of_an_item() -> None:
    """Microseconds a building in each step of `facade attributes`, and what validation takes."""
    items = list(read_raw([str(HOUSES)]))
    cls = artifact_class("building")
    documents = [parse_json(item.data) for item in items]
    buildings = [from_json(cls, document) for document in documents]
    check(documents[0], "building")
    building_attributes(buildings[0])
    results = [building_attributes(building) for building in buildings]
    steps = {
        "parse JSON": lambda: [parse_json(item.data) for item in items],
        "validate": lambda: [check(document, "building") for document in documents],
        "decode": lambda: [from_json(cls, document) for document in documents],
        "attributes": lambda: [building_attributes(building) for building in buildings],
        "encode, write": lambda: [dump_line(encode(result)) for result in results],
    }
    each = {name: best(step) / len(items) for name, step in steps.items()}
    total = sum(each.values())
    print(f"\n{len(items)} sample houses, microseconds a building")
    for name, value in each.items():
        print(f"  {name:14}{1e6 * value:8.0f}   {value / total:5.0%}")
    print(f"  {'all':14}{1e6 * total:8.0f}")
    print(f"attributes a second a core: {1 / each['attributes']:,.0f} (at least 2,000)")
    print(f"with reading and writing:   {1 / total:,.0f}")


def best(step) -> float:
    times = []
    for _ in range(5):
        start = time.perf_counter()
        step()
        times.append(time.perf_counter() - start)
    return min(times)


def chain(houses: Path, count: int) -> None:
    """Seconds of each stage of the main job, whole processes."""
    print(f"\nthe chain on {houses.name}, {count} new houses")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        first = "import" if not (houses / "bungalow.jsonl").exists() else "attributes"
        stages = [
            [first, houses, "-o", out / "attributes.jsonl"],
            ["learn", out / "attributes.jsonl", "-o", out / "model.json"],
            ["sample", out / "model.json", "-n", count, "-o", out / "sampled.jsonl"],
            ["massgen", out / "sampled.jsonl", "-o", out / "masses.jsonl"],
            ["facadegen", out / "masses.jsonl", "-o", out / "houses.jsonl"],
            ["validate", out / "houses.jsonl", "-o", out / "findings.txt"],
            ["export", out / "houses.jsonl", "--format", "glb", "-o", f"{out}/glb/"],
            ["view", out / "houses.jsonl", "-o", out / "houses.png"],
        ]
        for words in stages:
            print(f"  {words[0]:12}{seconds([FACADE, *map(str, words)]):8.2f} s", flush=True)
        rows = (out / "masses.jsonl").read_text().splitlines()
        energies = [json.loads(row)["energy"]["mass"] for row in rows]
        print(f"  median mass energy {statistics.median(energies):.2e}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--real", type=Path, help="folder or file of HOT2000 houses")
    parser.add_argument("--count", type=int, default=20)
    options = parser.parse_args()
    start_up()
    steps_of_an_item()
    chain(HOUSES, options.count)
    if options.real:
        chain(options.real, options.count)
