"""Meshes of formats that hold triangles alone (STL, OFF), through trimesh."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from ..errors import InvalidInput
from .textured import Paint, TexturedMesh, read_bytes
from .textured_polygons import MAX_CORNERS


def read_bare(path: Path) -> TexturedMesh:
    """Return the triangles of a file, their equal corners joined, in one grey paint.

    Raises InvalidInput on what is no mesh, or too large a one.
    """
    import trimesh

    data = io.BytesIO(read_bytes(path))
    try:
        mesh = trimesh.load_mesh(data, file_type=path.suffix.lower()[1:], process=False)
        mesh.merge_vertices()
        vertices = np.asarray(mesh.vertices, dtype=np.float64)
        faces = np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:  # trimesh raises whatever its parsers raise
        raise InvalidInput(f"cannot be read as a mesh: {error}") from None
    if not len(faces):
        raise InvalidInput("holds no faces; expected a mesh")
    if faces.size > MAX_CORNERS:
        raise InvalidInput(f"more than {MAX_CORNERS:,} face corners")
    if not 0 <= faces.min() <= faces.max() < len(vertices):
        raise InvalidInput("cannot be read as a mesh: a face names a vertex that is not there")
    if not np.isfinite(vertices).all():
        raise InvalidInput("holds coordinates that are not finite; expected metres")
    uv = np.full((len(faces), 3, 2), np.nan)
    return TexturedMesh(vertices, faces, uv, np.zeros(len(faces), np.int64), (Paint("none"),))
