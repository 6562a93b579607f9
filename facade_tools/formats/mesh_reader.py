"""Textured meshes by the ending of their file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ..errors import InvalidInput
from .textured import TexturedMesh
from .textured_bare import read_bare
from .textured_dae import Y_UP, read_dae
from .textured_gltf import read_gltf
from .textured_obj import read_obj
from .textured_ply import read_ply

READERS = {".obj": read_obj, ".glb": read_gltf, ".gltf": read_gltf, ".ply": read_ply}
READERS |= {".dae": read_dae, ".stl": read_bare, ".off": read_bare}
ENDINGS = tuple(READERS)
STATED = (".glb", ".gltf", ".dae")  # formats that say their unit and which way is up


def read_textured(path: Path) -> TexturedMesh:
    """Return the textured mesh of a file, z up where the format says which way is up, in metres.

    glTF is y up in metres; COLLADA says its unit and axis; the others say neither.
    """
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise InvalidInput(f"is no mesh that can be read; expected {', '.join(ENDINGS)}").at(
            str(path)
        )
    try:
        mesh = READERS[ending](path)
    except InvalidInput as error:
        raise error.at(str(path)) from None
    if not any(paint.picture is not None for paint in mesh.paints):
        mesh = replace(mesh, notes=(*mesh.notes, "no texture was found: drawn in plain colours"))
    if ending in (".glb", ".gltf"):
        mesh = replace(mesh, vertices=mesh.vertices @ Y_UP.T)
    return mesh
