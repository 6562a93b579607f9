"""Other people's meshes (OBJ, GLB, PLY, STL, …) as scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..geometry.mesh import Material, Mesh, Scene

MESH_ENDINGS = (".obj", ".glb", ".gltf", ".ply", ".stl", ".off")
Y_UP = (".glb", ".gltf")
PLAIN = "#c8c4ba"


def read_scene(path: Path) -> Scene:
    """Return the scene of a mesh file, z up, with its colours and textures where it has any.

    Raises InvalidInput where it holds no triangles or cannot be read.
    """
    import trimesh

    try:
        loaded: Any = trimesh.load(path, force="scene", process=False)
    except (OSError, ValueError, KeyError, IndexError, TypeError, NotImplementedError) as error:
        raise InvalidInput(f"not a readable mesh: {error}").at(str(path)) from None
    meshes: list[Mesh] = []
    materials: dict[str, Material] = {}
    for node in loaded.graph.nodes_geometry:
        transform, key = loaded.graph[node]
        geometry = loaded.geometry[key]
        if not isinstance(geometry, trimesh.Trimesh) or not len(geometry.faces):
            continue
        points = trimesh.transform_points(geometry.vertices, transform)
        if path.suffix.lower() in Y_UP:
            points = np.column_stack([points[:, 0], -points[:, 2], points[:, 1]])
        name = f"material-{len(materials)}"
        materials[name] = _material(name, geometry)
        uv = getattr(geometry.visual, "uv", None)
        meshes.append(Mesh(str(node), points, np.asarray(geometry.faces, np.int64), name, uv))
    if not meshes:
        raise InvalidInput("holds no triangles").at(str(path))
    return Scene(path.stem, tuple(meshes), materials)


def _material(name: str, geometry: Any) -> Material:
    material = getattr(geometry.visual, "material", None)
    color, texture = PLAIN, None
    if material is not None:
        red, green, blue = (int(value) for value in material.main_color[:3])
        color = f"#{red:02x}{green:02x}{blue:02x}"
        picture = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
        if picture is not None:
            from .png import write

            texture, color = write(np.asarray(picture.convert("RGB"))), "#ffffff"
    return Material(name, color, texture=texture)
