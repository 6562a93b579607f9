"""Exports a second by format against trimesh's bare GLB writer, file sizes, and pictures a second.

    python benchmarks/bench_export.py [BUILDINGS...]

Without arguments it takes four sample houses of each style. trimesh gets meshes that are ready, and
writes positions and indices only: it is the floor, not a peer that does the same work.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import trimesh

from facade_tools.artifacts.store import read
from facade_tools.formats import gltf
from facade_tools.formats.city import building_model
from facade_tools.formats.exporting import model_files
from facade_tools.geometry.details import building_scene
from facade_tools.imaging.camera import View
from facade_tools.imaging.render import render

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data" / "houses"
SECONDS = 3.0
GOAL = 20.0


def rate(function, items) -> float:
    """Return calls a second of processor time: other work on the machine does not count."""
    function(items[0])
    start, count = time.process_time(), 0
    while time.process_time() - start < SECONDS:
        function(items[count % len(items)])
        count += 1
    return count / (time.process_time() - start)


def bare(scene) -> bytes:
    out = trimesh.Scene()
    for index, mesh in enumerate(scene.meshes):
        if len(mesh.faces):
            part = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
            out.add_geometry(part, geom_name=f"{mesh.name}-{index}")
    return out.export(file_type="glb")


def export(form):
    prepare = building_model if form == "cityjson" else building_scene

    def run(building) -> dict[str, bytes]:
        return model_files([prepare(building)], building.id, form)

    return run


def size(files: dict[str, bytes]) -> int:
    return sum(map(len, files.values()))


def main() -> None:
    paths = sys.argv[1:] or sorted(map(str, SAMPLES.glob("*.jsonl")))
    houses = [house for path in paths for house in list(read([path], "building"))[:4]]
    scenes = [building_scene(house) for house in houses]
    triangles = sum(len(mesh.faces) for scene in scenes for mesh in scene.meshes) / len(scenes)
    print(f"{len(houses)} houses, {triangles:.0f} triangles each; per core:")
    floor = rate(bare, scenes)
    floor_size = sum(len(bare(scene)) for scene in scenes) / len(scenes)
    print(f"trimesh GLB, meshes ready    {floor:7.1f}/s   1.00     {floor_size / 1024:6.0f} kB")
    ready = rate(lambda scene: gltf.write([scene], "x"), scenes)
    print(f"our GLB, meshes ready        {ready:7.1f}/s   {ready / floor:4.2f}")
    print(f"building to scene            {rate(building_scene, houses):7.1f}/s")
    for form in ("glb", "obj", "cityjson"):
        run = export(form)
        speed = rate(run, houses)
        mean = sum(size(run(house)) for house in houses) / len(houses)
        goal = f"   {speed / GOAL:4.2f} × the goal of {GOAL:.0f}/s" if form == "glb" else ""
        row = f"{speed:7.1f}/s   {speed / floor:4.2f}     {mean / 1024:6.0f} kB"
        print(f"building to {form:8s}         {row}{goal}")
    for name, view in (("400x300", View(size=(400, 300))), ("960x720", View(size=(960, 720)))):
        speed = rate(lambda scene, view=view: render(scene, view), scenes)
        print(f"picture {name}              {speed:7.2f}/s")


if __name__ == "__main__":
    main()
