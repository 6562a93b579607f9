"""Other people's meshes as scenes, to be looked at."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from ..geometry.mesh import Material, Mesh, Scene
from . import png
from .mesh_reader import ENDINGS, read_textured
from .textured import Paint, TexturedMesh

MESH_ENDINGS = ENDINGS
WHITE = "#ffffff"

log = logging.getLogger("facade_tools.formats")


def read_scene(path: Path) -> Scene:
    """Return the scene of a mesh file, z up, a mesh a material, with colours and textures.

    Raises InvalidInput where it holds no triangles or cannot be read.
    """
    mesh = read_textured(path)
    for note in mesh.notes:
        log.info("%s: %s", path.name, note)
    names = [f"material-{index}" for index in range(len(mesh.paints))]
    materials = {
        name: _material(name, paint) for name, paint in zip(names, mesh.paints, strict=True)
    }
    used = np.unique(mesh.paint).tolist()
    meshes = tuple(_part(names[index], mesh, mesh.paint == index) for index in used)
    return Scene(path.stem, meshes, materials)


def _part(name: str, mesh: TexturedMesh, rows: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Mesh:
    corners = mesh.vertices[mesh.faces[rows]].reshape(-1, 3)
    faces = np.arange(len(corners), dtype=np.int64).reshape(-1, 3)
    uv = np.nan_to_num(mesh.uv[rows].reshape(-1, 2))
    textured = mesh.paints[int(mesh.paint[rows][0])].picture is not None
    return Mesh(name, corners, faces, name, uv if textured else None)


def _material(name: str, paint: Paint) -> Material:
    if paint.picture is None:
        return Material(name, f"#{bytes(paint.color).hex()}")
    pixels, cutout = paint.picture, paint.holes is not None
    if paint.holes is not None:
        alpha = np.where(paint.holes, 0, 255).astype(np.uint8)
        pixels = np.dstack([pixels, alpha])
    return Material(name, WHITE, texture=png.write(pixels, effort=1), cutout=cutout)
