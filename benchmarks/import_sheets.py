"""Contact sheets: each imported building beside the polygons of its source, in one frame.

python benchmarks/import_sheets.py FILE... -o sheet.png [--count 20] [--azimuth -32]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import cv2
import mapbox_earcut
import numpy as np

from facade_tools.artifacts.building import Building
from facade_tools.errors import FacadeError
from facade_tools.formats.detect import detect
from facade_tools.formats.models import House
from facade_tools.formats.reading import HEAD_BYTES, ReadOptions
from facade_tools.formats.surfaces import Model, Surface, told
from facade_tools.geometry.details import building_scene
from facade_tools.geometry.mesh import Material, Mesh, Scene
from facade_tools.imaging.camera import View
from facade_tools.imaging.contact_sheet import contact_sheet
from facade_tools.imaging.render import Look, render

COLORS = {
    "wall": "#e9e6df",
    "roof": "#a4543f",
    "ground": "#888888",
    "window": "#3c5a78",
    "door": "#5a3c28",
    "closure": "#c9c2b4",
    "other": "#c9c2b4",
}


def houses(paths: list[str]) -> Iterator[tuple[Model, Building]]:
    """Yield the models of files with the buildings made of them."""
    options = ReadOptions()
    for path in paths:
        with Path(path).open("rb") as stream:
            found = detect(stream.read(HEAD_BYTES))
            stream.seek(0)
            for record in found.records(stream, options):
                if not isinstance(record.payload, House):
                    continue
                try:
                    built = found.build(record, options)
                except FacadeError as error:
                    print(f"{record.pointer}: {error}")
                    continue
                neighbours = tuple(n.model for n in record.payload.neighbours)
                yield (record.payload.model, neighbours), built.artifacts[0]


def source_scene(model: Model, building: Building, neighbours: tuple[Model, ...] = ()) -> Scene:
    """Return the source's own polygons in the building's frame."""
    frame = building.frame
    turn = np.radians(-frame.rotation)
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    meshes = []
    for part in (model, *neighbours):
        shift = matrix @ (np.array(part.origin) - np.array(frame.shift))
        surfaces = [s for group in part.parts for s in told(group)]
        surfaces += [s for group in part.outside for s in group]
        for k, surface in enumerate(surfaces):
            mesh = _mesh(surface.moved(matrix, shift), f"{part.id}-{k}")
            if mesh is not None:
                meshes.append(mesh)
    return Scene(model.id, tuple(meshes), {k: Material(k, v) for k, v in COLORS.items()})


def _mesh(surface: Surface, name: str) -> Mesh | None:
    points = np.concatenate(surface.rings)
    axis = int(np.argmax(np.abs(surface.normal)))
    flat = np.delete(points, axis, axis=1)
    ends = np.cumsum([len(ring) for ring in surface.rings]).astype(np.uint32)
    faces = mapbox_earcut.triangulate_float64(flat, ends).reshape(-1, 3).astype(np.int64)
    if not len(faces):
        return None
    a, b, c = (points[faces[:, k]] for k in range(3))
    if float((np.cross(b - a, c - a).sum(axis=0)) @ surface.normal) < 0.0:
        faces = faces[:, ::-1]
    lift = 0.02 * surface.normal if surface.meaning in ("window", "door") else 0.0
    return Mesh(name, points + lift, np.ascontiguousarray(faces), surface.meaning)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--azimuth", type=float, default=-32.0)
    parser.add_argument("--skip", type=int, default=0)
    arguments = parser.parse_args()
    view = View(arguments.azimuth, 18.0, (300, 230))
    pictures, labels = [], []
    for index, ((model, neighbours), building) in enumerate(houses(arguments.files)):
        if index < arguments.skip:
            continue
        if len(labels) >= 2 * arguments.count:
            break
        scenes = source_scene(model, building, neighbours), building_scene(building)
        pictures += [render(scene, view, Look(rays=4)) for scene in scenes]
        labels += [f"{building.id[-16:]} source", f"{len(building.boxes)} boxes"]
    sheet = contact_sheet(pictures, labels, 8)
    cv2.imwrite(arguments.output, sheet[:, :, ::-1])


if __name__ == "__main__":
    main()
