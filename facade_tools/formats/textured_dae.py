"""COLLADA as modellers write it: every instance in its place, polygons by ear clipping."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from ..errors import InvalidInput
from ..geometry.arrays import Floats
from .textured import GREY, Paint, TexturedMesh, Textures, joined, read_bytes
from .textured_polygons import polygonal_mesh

Y_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=np.float64)


def read_dae(path: Path) -> TexturedMesh:
    """Return the mesh of a COLLADA file, z up, in metres, with the textures that it names.

    Raises InvalidInput where it cannot be read or shows no faces.
    """
    data = read_bytes(path)
    textures = Textures(path.parent)
    paints: dict[str, Paint] = {}
    matrix = _frame(data[:20_000].decode("utf-8", errors="replace"))
    parts = [
        _part(primitive, matrix, _paint(primitive.material, paints, textures))
        for primitive in _primitives(data, path)
        if len(primitive) and primitive.vertex is not None
    ]
    if not sum(len(part.faces) for part in parts):
        raise InvalidInput("holds no faces; expected a mesh").at(str(path))
    mesh = joined(parts)
    notes = tuple(dict.fromkeys((*mesh.notes, *textures.notes)))
    return replace(mesh, notes=notes)


def _frame(head: str) -> Floats:
    """Return the matrix to metres, z up, of a COLLADA file's asset element."""
    unit = re.search(r"<unit\b[^>]*\bmeter\s*=\s*[\"']([0-9.eE+-]+)", head)
    axis = re.search(r"<up_axis>\s*([XYZ])_UP", head)
    scale = float(unit.group(1)) if unit else 1.0
    return scale * (np.eye(3) if axis and axis.group(1) == "Z" else Y_UP)


def _primitives(data: bytes, path: Path) -> Iterator[Any]:
    """Yield all faces that the scene shows: triangle sets, polygon lists and polygons, in place."""
    import collada

    if b"<!ENTITY" in data:
        raise InvalidInput("declares entities; expected a plain COLLADA file").at(str(path))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PendingDeprecationWarning)  # its matrices
            document = collada.Collada(io.BytesIO(data), ignore=[collada.common.DaeError])
            shown = [] if document.scene is None else list(document.scene.objects("geometry"))
            primitives = [one for geometry in shown for one in geometry.primitives()]
    except Exception as error:  # pycollada raises whatever its parsers raise
        raise InvalidInput(f"cannot be read as a mesh: {error}").at(str(path)) from None
    kinds = (collada.triangleset.BoundTriangleSet, collada.polylist.BoundPolylist)
    yield from (one for one in primitives if isinstance(one, kinds))


def _part(primitive: Any, matrix: Floats, paint: Paint) -> TexturedMesh:
    index = np.asarray(primitive.vertex_index, dtype=np.int64).ravel()
    starts = getattr(primitive, "polyindex", None)
    ends = np.arange(0, len(index), 3) if starts is None else np.asarray(starts)[:, 0]
    rings = np.split(index, ends[1:])
    vertices = np.asarray(primitive.vertex, dtype=np.float64) @ matrix.T
    uv = None
    if len(primitive.texcoordset):
        places = np.asarray(primitive.texcoordset[0], dtype=np.float64)[:, :2]
        slots = np.asarray(primitive.texcoord_indexset[0], dtype=np.int64).ravel()
        uv = np.split(places[slots], ends[1:])
    return polygonal_mesh(vertices, rings, uv, [0] * len(rings), (paint,))


def _paint(material: Any, paints: dict[str, Paint], textures: Textures) -> Paint:
    """Return the paint of a material, each read once."""
    if material is None:
        textures.notes.append("a part has no material: drawn in its plain colour")
        return Paint("none")
    name = str(material.id)
    if name not in paints:
        paints[name] = _read_paint(name, material.effect, textures)
    return paints[name]


def _read_paint(name: str, effect: Any, textures: Textures) -> Paint:
    diffuse = getattr(effect, "diffuse", None)
    image = getattr(getattr(getattr(diffuse, "sampler", None), "surface", None), "image", None)
    if image is not None and image.path:
        return textures.paint(name, GREY, _file(image.path))
    if not isinstance(diffuse, (tuple, list)):
        textures.notes.append(f"material {name!r} has no texture: drawn in its plain colour")
        return Paint(name)
    r, g, b = (round(255 * min(max(float(value), 0.0), 1.0)) for value in diffuse[:3])
    return Paint(name, (r, g, b))


def _file(address: str) -> str:
    """Return the file name of an image's address; of one on another machine its last part."""
    name = unquote(address).replace("\\", "/")
    absolute = name.startswith(("file:", "/")) or re.match(r"[A-Za-z]:", name)
    return name.rsplit("/", 1)[-1] if absolute else name
