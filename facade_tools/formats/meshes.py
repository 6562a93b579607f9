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
LINEAR = (".glb", ".gltf")

log = logging.getLogger("facade_tools.formats")


def read_scene(path: Path) -> Scene:
    """Return the scene of a mesh file, z up, a mesh a material, with colours and textures.

    Raises InvalidInput where it holds no triangles or cannot be read.
    """
    mesh = read_textured(path)
    for note in mesh.notes:
        log.info("%s: %s", path.name, note)
    names = [f"material-{index}" for index in range(len(mesh.paints))]
    linear = path.suffix.lower() in LINEAR
    materials = {
        name: _material(name, paint, linear) for name, paint in zip(names, mesh.paints, strict=True)
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


def _material(name: str, paint: Paint, linear: bool) -> Material:
    """Return a paint as a material; linear: its colour is linear light and tints its picture."""
    color = bytes(_srgb(value) for value in paint.color) if linear else bytes(paint.color)
    if paint.picture is None:
        return Material(name, f"#{color.hex()}")
    tint = f"#{color.hex()}" if linear else WHITE
    return Material(name, tint, texture=png.write(paint.picture, effort=1))


def _srgb(value: int) -> int:
    share = value / 255
    curved = 12.92 * share if share <= 0.0031308 else 1.055 * share ** (1 / 2.4) - 0.055
    return round(255 * curved)
