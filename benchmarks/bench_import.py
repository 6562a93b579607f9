"""Rates of every reader (by CPU time), the memory of a stream, what became of each real set.

    python benchmarks/bench_import.py [--data FOLDER] [--no-sets] [--stream 10000]

FOLDER holds the real sets of buildings, one folder each (as SETS names them).
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

from facade_tools.errors import FacadeError
from facade_tools.formats.importing import items
from facade_tools.formats.reading import ReadOptions
from facade_tools.geometry.checks import building_problems

ROOT = Path(__file__).resolve().parent.parent
SETS = {
    "HOT2000 extract": ("nrcan-energuide-h2k", "houses.jsonl"),
    "HOT2000 files": ("nrcan-energuide-h2k/h2k", "*.h2k"),
    "HPXML": ("nrel-hpxml-real-homes", "*.xml"),
    "assessor CSV": ("ames-assessor", "*.csv"),
    "CityJSON LoD2": ("nrw-lod2", "*.city.json"),
    "CityGML LoD2": ("nrw-lod2", "*.gml"),
    "CityJSON LoD3": ("ingolstadt-lod3", "*.city.json"),
    "CityGML LoD3": ("ingolstadt-lod3/citygml", "*.gml"),
    "IFC": ("ifc-sample-houses", "*.ifc"),
}


def artifacts(paths: list[Path], notes: Counter[str]) -> Iterator[Any]:
    """Yield artifacts, and the errors of what is refused."""
    options = ReadOptions()
    for item in items(map(str, paths), options):
        try:
            if item.error is not None or item.format is None or item.record is None:
                raise item.error or RuntimeError
            built = item.format.build(item.record, options)
        except FacadeError as error:
            yield error
            continue
        notes += built.notes
        yield from built.artifacts


def real_sets(data: Path) -> None:
    """Print the table of the real sets, and the rules that were applied to each."""
    print(f"{'set':<18}{'read':>6}{'refused':>9}{'valid':>7}{'median res.':>13}{'/s':>9}")
    applied = {}
    for name, (folder, pattern) in SETS.items():
        paths = sorted((data / folder).glob(pattern))
        if not paths:
            print(f"{name:<18}  no {pattern} in {data / folder}")
            continue
        notes: Counter[str] = Counter()
        start = time.process_time()
        found = list(artifacts(paths, notes))
        seconds = time.process_time() - start
        refused = [item for item in found if isinstance(item, FacadeError)]
        good = [item for item in found if not isinstance(item, FacadeError)]
        residuals = [r.tags["plan_residual"] for r in good if "plan_residual" in r.tags]
        valid = sum(r.kind != "building" or not list(building_problems(r)) for r in good)
        middle = f"{median(residuals):.4f}" if residuals else "-"
        print(f"{name:<18}{len(good):>6}{len(refused):>9}{valid:>7}{middle:>13}", end="")
        print(f"{len(found) / max(seconds, 1e-9):>9.0f}")
        applied[name] = notes + Counter(f"refused: {error.args[0]}" for error in refused)
    for name, notes in applied.items():
        for note, count in notes.most_common():
            print(f"  {name}: {count} × {note}")


def write_geojson(path: Path, count: int) -> None:
    """Write a collection of `count` L-shaped footprints."""
    plan = [[0, 0], [12, 0], [12, 5], [7, 5], [7, 9], [0, 9], [0, 0]]
    with path.open("w") as file:
        file.write('{"type":"FeatureCollection","features":[')
        for k in range(count):
            shift = 20 * (k % 1000), 20 * (k // 1000)
            ring = [[x + shift[0], y + shift[1]] for x, y in plan]
            feature = {
                "type": "Feature",
                "id": k + 1,
                "properties": {"building": "house", "height": "8", "roof:shape": "hipped"},
                "geometry": {"type": "Polygon", "coordinates": [ring]},
            }
            file.write(("," if k else "") + json.dumps(feature))
        file.write("]}")


def write_cityjson(path: Path, count: int, sequence: bool = False) -> None:
    """Write a document, or a sequence, of `count` houses with gables."""
    sys.path.insert(0, str(ROOT))
    from tests.city_sources import City, gable_house

    city = City()
    house = gable_house(12.0, 8.0, 5.5, 35.0)
    geometry = city.add("h", house).document()["CityObjects"]["h"]["geometry"][0]
    corners = city.vertices
    head = {**city.document(), "CityObjects": {}, "vertices": []}
    with path.open("w") as file:
        if sequence:
            file.write(json.dumps(head) + "\n")
            for k in range(count):
                objects = {f"b{k}": {"type": "Building", "geometry": [geometry]}}
                rows = [[x + 20000 * k, y, z] for x, y, z in corners]
                feature = {"type": "CityJSONFeature", "CityObjects": objects, "vertices": rows}
                file.write(json.dumps(feature) + "\n")
            return
        file.write(json.dumps(head)[:-1].split('"CityObjects"')[0] + '"CityObjects":{')
        for k in range(count):
            rings = [[[c + k * len(corners) for c in r] for r in p] for p in geometry["boundaries"]]
            item = {"type": "Building", "geometry": [{**geometry, "boundaries": rings}]}
            file.write(("," if k else "") + f'"b{k}":' + json.dumps(item))
        file.write('},"vertices":[')
        for k in range(count):
            rows = [[x + 20000 * k, y, z] for x, y, z in corners]
            file.write(("," if k else "") + json.dumps(rows)[1:-1])
        file.write("]}")


def read_all(path: str, kind: Any, answer: Any) -> None:
    """Read a file to its end in a process of its own; answer count, seconds and peak memory."""
    options = ReadOptions(kind=kind, metres=True)
    start, count = time.process_time(), 0
    for item in items([path], options):
        if item.format is not None and item.record is not None:
            count += len(item.format.build(item.record, options).artifacts)
    answer.send((count, time.process_time() - start, peak_memory()))


def peak_memory() -> float:
    """Return the largest memory that this process held (MiB)."""
    status = Path("/proc/self/status")
    if status.exists():  # getrusage would answer the parent's peak here
        rows = dict(line.split(":", 1) for line in status.read_text().splitlines())
        return float(rows["VmHWM"].split()[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1 << 20)


def measured(path: Path, kind: str) -> tuple[int, float, float]:
    """Return count, seconds and peak memory (MiB) of reading a file."""
    here, there = multiprocessing.Pipe()
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=read_all, args=(str(path), kind, there))
    process.start()
    answer: tuple[int, float, float] = here.recv()
    process.join()
    return answer


STREAMS = (  # format, what it becomes, how many of the asked number, writer
    ("GeoJSON", "footprints", 1.0, write_geojson),
    ("CityJSONSeq", "footprints", 1.0, lambda path, n: write_cityjson(path, n, True)),
    ("CityJSON", "footprints", 1.0, write_cityjson),
    ("CityJSON", "buildings", 0.2, write_cityjson),
)


def streams(count: int) -> None:
    """Print rate and memory of streams of `count` buildings, and of a tenth of them."""
    print(f"\n{'stream':<26}{'buildings':>10}{'/s':>8}{'peak MiB':>10}{'KiB each more':>15}")
    with tempfile.TemporaryDirectory() as folder:
        for name, kind, share, write in STREAMS:
            peaks = []
            most = int(share * count)
            for size in (most // 10, most):
                path = Path(folder) / f"{size}"
                write(path, size)
                found, seconds, peak = measured(path, kind)
                peaks.append(peak)
                slope = 1024 * (peaks[-1] - peaks[0]) / max(size - most // 10, 1)
                label = f"{name} to {kind}"
                print(f"{label:<26}{found:>10}{found / seconds:>8.0f}{peak:>10.0f}{slope:>15.2f}")
                path.unlink()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data" / "buildings")
    parser.add_argument("--no-sets", action="store_true", help="only the streams")
    parser.add_argument("--stream", type=int, default=10_000)
    arguments = parser.parse_args()
    if arguments.data.is_dir() and not arguments.no_sets:
        real_sets(arguments.data)
    streams(arguments.stream)


if __name__ == "__main__":
    main()
