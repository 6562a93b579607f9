"""Textured meshes by the ending of their file: glTF through trimesh, the rest by our readers."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..geometry.arrays import Floats
from ..imaging.image_io import Picture
from .textured import GREY, Paint, TexturedMesh, joined, read_bytes
from .textured_dae import Y_UP, read_dae
from .textured_obj import read_obj
from .textured_ply import read_ply

ENDINGS = (".obj", ".glb", ".gltf", ".ply", ".dae")


def read_textured(path: Path) -> TexturedMesh:
    """Return the textured mesh of a file, z up where the format says which way is up, in metres.

    glTF is y up in metres; COLLADA says its unit and axis; OBJ and PLY say neither.
    """
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise InvalidInput(f"is no mesh that can be read; expected {', '.join(ENDINGS)}").at(
            str(path)
        )
    own = {".obj": read_obj, ".ply": read_ply, ".dae": read_dae}
    try:
        return own.get(ending, _read_gltf)(path)
    except InvalidInput as error:
        raise error.at(str(path)) from None


def _read_gltf(path: Path) -> TexturedMesh:
    read_bytes(path)
    mesh = _through_trimesh(path)
    if not np.isfinite(mesh.vertices).all():
        raise InvalidInput("holds coordinates that are not finite; expected metres")
    return replace(mesh, vertices=mesh.vertices @ Y_UP.T)


def _through_trimesh(path: Path) -> TexturedMesh:
    import trimesh

    with _complaints() as notes:
        try:
            scene = trimesh.load_scene(path, process=False)
        except Exception as error:  # trimesh raises whatever its parsers raise
            raise InvalidInput(f"cannot be read as a mesh: {error}").at(str(path)) from None
    parts = []
    pictures: dict[int, Picture] = {}
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            parts.append(_part(geometry, np.asarray(transform), pictures))
    if not parts:
        raise InvalidInput("holds no faces; expected a mesh").at(str(path))
    mesh = joined(parts)
    return replace(mesh, notes=(*mesh.notes, *dict.fromkeys(notes)))


@contextmanager
def _complaints() -> Iterator[list[str]]:
    """Collect what trimesh logs, with the reason, in place of printing it."""
    notes: list[str] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            cause = f": {record.exc_info[1]}" if record.exc_info and record.exc_info[1] else ""
            notes.append(f"{record.getMessage().splitlines()[0]}{cause}")

    logger, collector = logging.getLogger("trimesh"), Collector(logging.WARNING)
    propagate, logger.propagate = logger.propagate, False
    logger.addHandler(collector)
    try:
        yield notes
    finally:
        logger.removeHandler(collector)
        logger.propagate = propagate


def _part(geometry: Any, transform: Floats, pictures: dict[int, Picture]) -> TexturedMesh:
    """Return a geometry as a mesh; pictures: those decoded so far, by the id of their image."""
    vertices = np.asarray(geometry.vertices, dtype=np.float64)
    vertices = vertices @ transform[:3, :3].T + transform[:3, 3]
    faces = np.asarray(geometry.faces, dtype=np.int64)
    uv = getattr(geometry.visual, "uv", None)
    corners = (
        np.full((len(faces), 3, 2), np.nan)
        if uv is None or len(uv) != len(vertices)
        else np.asarray(uv, dtype=np.float64)[faces]
    )
    paint, note = _paint(getattr(geometry.visual, "material", None), pictures)
    notes = (note,) if note else ()
    return TexturedMesh(vertices, faces, corners, np.zeros(len(faces), np.int64), (paint,), notes)


def _paint(material: Any, pictures: dict[int, Picture]) -> tuple[Paint, str]:
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    color = np.asarray(getattr(material, "main_color", [*GREY, 255]))[:3]
    name = str(getattr(material, "name", "") or "none")
    rgb = (int(color[0]), int(color[1]), int(color[2]))
    if image is None:
        return Paint(name, rgb), f"part {name!r} has no texture: drawn in its plain colour"
    if id(image) not in pictures:
        pictures[id(image)] = np.asarray(image.convert("RGB"), dtype=np.uint8)
    return Paint(name, rgb, pictures[id(image)]), ""
