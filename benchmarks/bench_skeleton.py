"""Straight skeletons against py_straight_skeleton, and closed solids with roofs.

    python benchmarks/bench_skeleton.py [--random N] [--each SECONDS]

The same polygons for both: every ground polygon in the shared CityJSON files (FACADE_TOOLS_DATA,
or ../shared/data) and N random ones of each kind of tests/catalogue.py. A skeleton counts as good
when its faces tile the polygon to 1e-6 of its area, one face an edge, with every node within
1 mm of equidistant. A polygon that takes longer than SECONDS counts as failed. Times are the
processor's. The peer is optional: pip install 'facade-tools[bench]'.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import shapely

from facade_tools.artifacts.footprint import Footprint
from facade_tools.geometry.polygons import Rings, oriented, sound
from facade_tools.geometry.skeleton import Contour, straight_skeleton
from facade_tools.geometry.solids import building_solid, footprint_solid, triangulated

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import catalogue  # noqa: E402  (it lies beside the tests)

Faces = tuple[np.ndarray, np.ndarray, list[list[int]]]  # points, times, faces


def ours(rings: Rings) -> Faces:
    skeleton = straight_skeleton(rings)
    return skeleton.points, skeleton.times, [face.tolist() for face in skeleton.faces]


def peer(rings: Rings) -> Faces:
    from py_straight_skeleton import compute_skeleton

    exterior, *holes = ([(float(x), float(y)) for x, y in ring] for ring in rings)
    skeleton = compute_skeleton(exterior=exterior, holes=holes)
    nodes = list(skeleton.nodes)
    points = np.array([(node.position.x, node.position.y) for node in nodes])
    times = np.array([node.time for node in nodes])
    return points, times, [list(face) for face in skeleton.get_faces()]


def good(rings: Rings, found: Faces) -> bool:
    points, _, faces = found
    contour = Contour.of(rings)
    area = shapely.Polygon(rings[0], rings[1:]).area
    shapes = [shapely.Polygon(points[face]) for face in faces if len(face) > 2]
    union = shapely.union_all(shapely.make_valid(shapes), grid_size=1e-9).area
    tiles = (
        abs(sum(s.area for s in shapes) - area) < 1e-6 * area and abs(union - area) < 1e-6 * area
    )
    return len(faces) == len(contour.points) and tiles and node_error(contour, found) < 1e-3


def node_error(contour: Contour, found: Faces) -> float:
    points, times, faces = found
    _, normal, offset = contour.frames()
    middles = (contour.points + contour.points[contour.following]) / 2
    worst = 0.0
    for face in faces:
        middle = points[face[:2]].mean(axis=0)  # a face begins with its edge
        edge = int(np.argmin(((middles - middle) ** 2).sum(axis=1)))
        away = points[face] @ normal[edge] - offset[edge]
        worst = max(worst, float(np.abs(away - times[face]).max()))
    return worst


def run(method: Callable[[Rings], Faces], polygons: list[Rings], limit: float) -> dict[str, float]:
    seconds, bad = [], 0
    for rings in polygons:
        start, found = time.process_time(), None
        with suppress(Exception):  # a peer may fail in any way
            signal.setitimer(signal.ITIMER_REAL, limit)
            try:
                found = method(rings)
            finally:
                signal.setitimer(signal.ITIMER_REAL, 0)
        seconds.append(time.process_time() - start)
        bad += found is None or not good(rings, found)
    middle, high, worst = (1e3 * float(np.percentile(seconds, q)) for q in (50, 95, 100))
    rate = len(seconds) / sum(seconds)
    return {"failed": bad, "median": middle, "p95": high, "max": worst, "rate": rate}


def table(name: str, polygons: list[Rings], limit: float) -> None:
    sizes = [sum(len(ring) for ring in rings) for rings in polygons]
    holes = sum(len(rings) > 1 for rings in polygons)
    print(f"\n{name}: {len(polygons)} polygons, {holes} with holes, {max(sizes)} vertices at most")
    methods: dict[str, Callable[[Rings], Faces]] = {"facade_tools": ours}
    try:
        import py_straight_skeleton  # noqa: F401

        methods["py_straight_skeleton"] = peer
    except ImportError:
        print("  (py_straight_skeleton is not installed)")
    rows = {label: run(method, polygons, limit) for label, method in methods.items()}
    print(
        f"  {'':22}{'failed':>8}{'median ms':>11}{'p95 ms':>9}{'max ms':>9}{'per s':>9}{'ratio':>8}"
    )
    for label, row in rows.items():
        ratio = row["rate"] / rows["facade_tools"]["rate"]
        print(
            f"  {label:22}{row['failed']:8.0f}{row['median']:11.2f}{row['p95']:9.1f}"
            f"{row['max']:9.1f}{row['rate']:9.1f}{ratio:8.3f}"
        )


def solids(footprints: list[Rings]) -> None:
    print("\nclosed solids with triangles, one core")
    for style in catalogue.ROOF_STYLES:
        things = [
            Footprint("f", tuple(tuple(map(tuple, r)) for r in rings), 6.0, catalogue.roofed(style))
            for rings in footprints
        ]
        print(f"  footprints, {style:10} {rate(footprint_solid, things):8.0f} a second")
    buildings = list(catalogue.buildings().values())
    print(f"  buildings of the catalogue  {rate(building_solid, buildings):6.0f} a second")


def rate(function: Callable, things: list) -> float:
    triangulated(function(things[0]))
    start = time.process_time()
    for thing in things:
        triangulated(function(thing))
    return len(things) / (time.process_time() - start)


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--random", type=int, default=500)
    options.add_argument("--each", type=float, default=5.0)
    given = options.parse_args()
    signal.signal(signal.SIGALRM, _too_long)
    straight_skeleton(oriented(catalogue.polygons()["L"]))  # compile before the clock runs
    data = Path(os.environ.get("FACADE_TOOLS_DATA", ROOT.parent / "shared" / "data"))
    real = []
    if data.is_dir():
        real = [r for p in catalogue.real_footprints(data).values() for r in sound(p)]
        table("real footprints", real, given.each)
    for kind in catalogue.POLYGON_KINDS:
        rng = np.random.default_rng(7)
        polygons = [oriented(catalogue.random_polygon(rng, kind)) for _ in range(given.random)]
        table(f"random, {kind}", polygons, given.each)
    solids(real or [oriented(p) for p in catalogue.polygons().values()])


def _too_long(*_: object) -> None:
    raise TimeoutError


if __name__ == "__main__":
    main()
