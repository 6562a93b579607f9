"""Meshes and pictures that a design's shapes name, checked before they are used."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..artifacts.design import Appearance, Design
from ..artifacts.layout import Layout
from ..artifacts.pointers import escaped
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Points3, Triangles
from .stack import shape_tables, stack_of

MESH = "model/obj"
MEDIA = {".obj": MESH, ".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg"}
ENDINGS = {"mesh": (".obj",), "texture": (".png", ".jpg", ".jpeg")}
FAR = 1e12  # of whatever unit a mesh has
MAGIC = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")


@dataclass(frozen=True, slots=True)
class Asset:
    """A mesh within the unit cube: x to the right, y to the back, z up."""

    vertices: Points3
    faces: Triangles


def named_assets(design: Design) -> Iterator[tuple[str, str]]:
    """Yield pointer and name of every file that a shape names, hidden or not.

    Raises InvalidInput where a name's ending is none of a mesh or of a texture.
    """
    for pointer, look in _looks(design):
        for key, endings in ENDINGS.items():
            name = getattr(look, key)
            if name is None:
                continue
            if not name.lower().endswith(endings):
                expected = " or ".join(endings)
                raise InvalidInput(f"{name}: expected {expected}", pointer=f"{pointer}/{key}")
            yield f"{pointer}/{key}", name


def _looks(design: Design) -> Iterator[tuple[str, Appearance]]:
    for pointer, table in shape_tables(stack_of(design)):
        for key, look in table.items():
            yield f"{pointer}/{escaped(key)}", look


def check_asset(media: str, data: bytes) -> None:
    """Raise InvalidInput where the bytes are no mesh, or no picture, that can be drawn."""
    if media == MESH:
        unit_mesh(data.decode(errors="replace"))
    else:
        _check_picture(data)


def layout_problems(layout: Layout) -> Iterator[tuple[str, str]]:
    """Yield pointer and message of what is wrong with the files that a layout holds."""
    for name, entry in layout.assets.items():
        read: Callable[..., object] = mesh_of if entry["media"] == MESH else picture_of
        try:
            read(name, entry)
        except InvalidInput as error:
            yield error.place.pointer, error.message


def picture_of(name: str, entry: Mapping[str, Any]) -> bytes:
    """Return the encoded picture of an asset. Raises InvalidInput on what is none."""
    pointer = f"/assets/{escaped(name)}/data"
    try:
        picture = base64.b64decode(entry["data"], validate=True)
    except binascii.Error:
        raise InvalidInput("is no base64", pointer=pointer) from None
    try:
        _check_picture(picture)
    except InvalidInput as error:
        raise InvalidInput(error.message, pointer=pointer) from None
    return picture


def _check_picture(data: bytes) -> None:
    from ..imaging.image_io import decoded

    if not data.startswith(MAGIC):
        raise InvalidInput("is no picture that can be read; expected PNG or JPEG")
    decoded(data, "")


def mesh_of(name: str, entry: Mapping[str, Any]) -> Asset:
    """Return the mesh of an asset. Raises InvalidInput on what is none."""
    try:
        return unit_mesh(entry["data"])
    except InvalidInput as error:
        raise InvalidInput(error.message, pointer=f"/assets/{escaped(name)}/data") from None


def unit_mesh(text: str) -> Asset:
    """Read an OBJ text (z up, front towards −y), scaled to the unit cube; polygons are fanned.

    Raises InvalidInput on what is no such text, or has no faces.
    """
    points: list[tuple[float, ...]] = []
    faces: list[tuple[int, int, int]] = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                points.append(_point(words[1:4]))
            elif words[:1] == ["f"]:
                ids = [int(word.split("/")[0]) for word in words[1:]]
                row = [i - 1 if i > 0 else len(points) + i for i in ids]
                faces += [(row[0], row[k], row[k + 1]) for k in range(1, len(row) - 1)]
        except ValueError:
            raise InvalidInput(f"OBJ line {number} is no {words[0]!r} line") from None
    vertices = np.array(points, dtype=np.float64).reshape(-1, 3)
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if not len(triangles) or triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InvalidInput("has no faces over existing vertices; expected an OBJ mesh")
    return Asset(_unit(vertices), triangles)


def _point(words: Sequence[str]) -> tuple[float, ...]:
    point = tuple(map(float, words))
    if len(point) != 3 or not all(abs(value) <= FAR for value in point):  # NaN is not
        raise ValueError(words)
    return point


def _unit(vertices: Floats) -> Floats:
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    unit: Floats = (vertices - low) / np.maximum(high - low, 1e-12)
    return unit
