"""The mesh of a layout: boxes or OBJ assets in the shapes' places, mirrored where they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ..artifacts.layout import Layout, LayoutShape
from ..errors import InvalidInput
from ..geometry.arrays import Points2, Points3, Triangles
from ..geometry.mesh import Material, Mesh, Scene
from .assets import MESH, Asset, mesh_of, picture_of

BEHIND = 0.1  # metres that a box reaches behind the canvas, and its least thickness
MOST_FACES = 5_000_000
PLAIN = "#a9866a"


@dataclass(frozen=True, slots=True)
class Patch:
    """A piece of mesh in place; uv (n, 2) where it carries a texture."""

    vertices: Points3
    faces: Triangles
    uv: Points2 | None = None


# Corners of the unit cube: bit 0 is x, bit 1 y (back), bit 2 z (up).
_CUBE = np.array([[(i >> k) & 1 for k in range(3)] for i in range(8)], dtype=np.float64)
_FRONT = np.array([(0, 1, 5), (0, 5, 4)])
_REST = np.array(
    [(1, 3, 7), (1, 7, 5), (3, 2, 6), (3, 6, 7), (2, 0, 4), (2, 4, 6), (4, 5, 7), (4, 7, 6),
     (2, 3, 1), (2, 1, 0)]
)  # fmt: skip


def layout_scene(layout: Layout) -> Scene:
    """Return the visible shapes of a layout as a scene, the facade towards −y, z up, metres.

    One part a layer and pair of symbols, named `layer/CP`. Raises InvalidInput on an asset that
    cannot be read, or where the assets have too many faces.
    """
    assets = {
        name: mesh_of(name, entry)
        for name, entry in layout.assets.items()
        if entry["media"] == MESH
    }
    parts: dict[tuple[str, str], list[Patch]] = {}
    materials: dict[str, Material] = {}
    faces = 0
    for shape in layout.shapes:
        if shape.visible:
            for material, patch in _patches(shape, assets):
                faces += len(patch.faces)
                if faces > MOST_FACES:
                    raise InvalidInput(f"more than {MOST_FACES} faces", pointer="/assets")
                parts.setdefault((_part_name(shape), material), []).append(patch)
                if material not in materials:
                    materials[material] = _material(material, shape, layout)
    meshes = tuple(_merged(name, material, patches) for (name, material), patches in parts.items())
    return Scene(layout.id, meshes, materials)


def _part_name(shape: LayoutShape) -> str:
    return f"{shape.layer}/{''.join(_bare(symbol) for symbol in shape.symbols)}"


def _bare(symbol: str) -> str:
    return symbol.lstrip("~")


def _patches(shape: LayoutShape, assets: Mapping[str, Asset]) -> Iterator[tuple[str, Patch]]:
    color = shape.color or PLAIN
    asset = assets.get(shape.mesh or "")
    if asset is not None:
        yield color, _placed(shape, asset.vertices, asset.faces)
        return
    if shape.texture is None:
        yield color, _placed(shape, _CUBE, np.concatenate([_FRONT, _REST]))
        return
    yield color, _placed(shape, _CUBE, _REST)
    corners = _CUBE[[0, 1, 5, 4]]
    front = _placed(shape, corners, np.array([(0, 1, 2), (0, 2, 3)]))
    yield f"{color} {shape.texture}", Patch(front.vertices, front.faces, corners[:, [0, 2]])


def _placed(shape: LayoutShape, unit: Points3, faces: Triangles) -> Patch:
    """Stretch a mesh of the unit cube over the shape's box; `~` mirrors it in x or in z."""
    flip = [shape.symbols[0].startswith("~"), False, shape.symbols[1].startswith("~")]
    points = np.where(flip, 1.0 - unit, unit)
    thickness = shape.thickness or max(BEHIND, BEHIND + shape.depth)
    low = np.array([shape.x0, -shape.depth, shape.y0])
    high = np.array([shape.x1, thickness - shape.depth, shape.y1])
    turned = faces[:, ::-1] if sum(flip) == 1 else faces
    return Patch(low + points * (high - low), np.ascontiguousarray(turned, dtype=np.int64))


def _material(name: str, shape: LayoutShape, layout: Layout) -> Material:
    color, _, texture = name.partition(" ")
    entry = layout.assets.get(texture)
    if not texture or entry is None:
        return Material(_plain(name), color)
    return Material(_plain(name), "#ffffff", texture=picture_of(texture, entry))


def _plain(name: str) -> str:
    """Return a material's name without blanks and #, which some readers take for a comment."""
    return name.replace(" ", "-").replace("#", "color-")


def _merged(name: str, material: str, patches: list[Patch]) -> Mesh:
    counts = np.cumsum([0, *(len(patch.vertices) for patch in patches)])
    faces = [patch.faces + start for patch, start in zip(patches, counts, strict=False)]
    uvs = [patch.uv for patch in patches if patch.uv is not None]
    return Mesh(
        name,
        np.concatenate([patch.vertices for patch in patches]),
        np.concatenate(faces),
        material,
        np.concatenate(uvs) if len(uvs) == len(patches) else None,
    )
