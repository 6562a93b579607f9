"""Textured triangle meshes of other people: what every reader of them returns."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..artifacts.store import unreadable
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Integers, Points3, Triangles
from ..imaging.image_io import Holes, Picture, decoded_texture

MAX_MESH_BYTES = 1 << 30
MAX_TEXTURE_BYTES = 256 << 20
MAX_TEXTURE_PIXELS = 400_000_000  # of all pictures of a model together
GREY = (190, 190, 190)
Colours = NDArray[np.uint8]  # (..., 3) RGB


@dataclass(frozen=True, slots=True)
class Paint:
    """A material: sRGB colour, and a picture (h, w, 3) that takes its place where there is one.

    holes (h, w): where one sees through the picture. gradient: the picture holds no image, but the
    colours of corners (see `gradients`).
    """

    name: str
    color: tuple[int, int, int] = GREY
    picture: Picture | None = None
    holes: Holes | None = None
    gradient: bool = False


@dataclass(frozen=True, slots=True)
class TexturedMesh:
    """Triangles with texture coordinates at their corners.

    vertices (n, 3) metres, z up; faces (m, 3); uv (m, 3, 2), origin at the picture's lower left,
    NaN where there are none; paint (m,) index of `paints`. polygons: sides of the source's
    polygons that were triangulated. notes: what was repaired or lost, in words.
    """

    vertices: Points3
    faces: Triangles
    uv: Floats
    paint: Integers
    paints: tuple[Paint, ...]
    notes: tuple[str, ...] = field(default=())


Texture = tuple[Picture | None, Holes | None]
NO_TEXTURE: Texture = (None, None)


class Textures:
    """Finds and decodes the pictures that a mesh file names, all inside its folder."""

    def __init__(self, folder: Path) -> None:
        """Remember the folder that the mesh file lies in."""
        self.folder = folder.resolve()
        self.notes: list[str] = []
        self.pixels = 0
        self.found: dict[str, Texture] = {}

    def paint(self, name: str, color: tuple[int, int, int], file: str) -> Paint:
        """Return a paint with the picture of a file; without, if it is lost or `file` is empty."""
        return Paint(name, color, *(self.read(file) if file else NO_TEXTURE))

    def read(self, file: str) -> Texture:
        """Return the picture of a file and its holes, or nothing (with a note)."""
        if file not in self.found:
            self.found[file] = self._read(file)
        return self.found[file]

    def _read(self, name: str) -> Texture:
        try:
            path = self._find(name)
            data = _bounded(path, MAX_TEXTURE_BYTES)
        except InvalidInput as error:
            return self._lost(name, error)
        return self.embedded(data, name)

    def _lost(self, name: str, error: InvalidInput) -> Texture:
        self.notes.append(f"texture {name!r} {error.message}: drawn in its plain colour")
        return NO_TEXTURE

    def embedded(self, data: bytes, name: str) -> Texture:
        """Return the picture of an encoded file and its holes, or nothing (with a note).

        Raises InvalidInput where all textures together are too large for memory.
        """
        try:
            picture, holes = decoded_texture(data, name)
        except InvalidInput as error:
            return self._lost(name, error)
        self.pixels += picture.shape[0] * picture.shape[1]
        if self.pixels > MAX_TEXTURE_PIXELS:
            limit = MAX_TEXTURE_PIXELS // 10**6
            raise InvalidInput(f"textures of more than {limit} megapixels together")
        return picture, holes

    def _find(self, name: str) -> Path:
        """Look the name up inside the folder; by its letters alone if the case is wrong.

        Raises InvalidInput where it is not there.
        """
        relative = name.replace("\\", "/")
        exact = (self.folder / relative).resolve()
        if not exact.is_relative_to(self.folder):
            raise InvalidInput("lies outside the file's folder")
        if exact.is_file():
            return exact
        wanted = Path(relative).name.casefold()
        found = [p for p in self._siblings() if p.name.casefold() == wanted]
        if not found:
            raise InvalidInput("is missing")
        self.notes.append(f"texture {name!r} was found as {found[0].name!r}")
        return found[0]

    def _siblings(self) -> list[Path]:
        places = [self.folder, *(p for p in sorted(self.folder.iterdir()) if p.is_dir())]
        return [entry for place in places for entry in sorted(place.iterdir()) if entry.is_file()]


def gradients(faces: Colours) -> tuple[Paint, Floats]:
    """Return a paint with the colours (m, 3, 3) of the corners of triangles, and its uv (m, 3, 2).

    Every triangle has 2×2 pixels with its corners at three centres; the fourth is such that
    bilinear sampling is linear over the triangle.
    """
    count = len(faces)
    columns = max(1, math.isqrt(count - 1) + 1) if count else 1
    rows = max(1, -(-count // columns))
    a, b, c = (faces[:, k].astype(np.int64) for k in range(3))
    blocks = np.zeros((rows * columns, 2, 2, 3), dtype=np.uint8)
    blocks[:count] = np.stack([a, b, c, np.clip(b + c - a, 0, 255)], axis=1).reshape(-1, 2, 2, 3)
    picture = blocks.reshape(rows, columns, 2, 2, 3).transpose(0, 2, 1, 3, 4)
    row, column = np.divmod(np.arange(count), columns)
    corners = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]])
    uv = 2.0 * np.stack([column, row], axis=1)[:, None] + corners
    uv /= np.array([2.0 * columns, 2.0 * rows])
    uv[:, :, 1] = 1.0 - uv[:, :, 1]
    flat = np.ascontiguousarray(picture.reshape(2 * rows, 2 * columns, 3))
    mean = faces.reshape(-1, 3).mean(axis=0) if count else np.array(GREY)
    r, g, b_ = np.round(mean).astype(int).tolist()
    return Paint("colours", (r, g, b_), flat, gradient=True), uv


def with_colours(mesh: TexturedMesh, colours: Colours) -> TexturedMesh:
    """Return the mesh with the colours of corners (m, 3, 3) on the triangles without a picture."""
    bare = np.array([paint.picture is None for paint in mesh.paints])[mesh.paint]
    bare |= ~np.isfinite(mesh.uv).all(axis=(1, 2))
    if not bare.any():
        return mesh
    paint, corners = gradients(colours[bare])
    uv, numbers = mesh.uv.copy(), mesh.paint.copy()
    uv[bare], numbers[bare] = corners, len(mesh.paints)
    return replace(mesh, uv=uv, paint=numbers, paints=(*mesh.paints, paint))


def read_bytes(path: Path) -> bytes:
    """Return the bytes of a mesh file. Raises InvalidInput if missing or too large."""
    return _bounded(path, MAX_MESH_BYTES)


def _bounded(path: Path, limit: int) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except OSError as error:
        raise unreadable(str(path), error) from None
    if len(data) > limit:
        raise InvalidInput(f"is larger than {limit >> 20} MiB").at(str(path))
    return data


def joined(parts: list[TexturedMesh]) -> TexturedMesh:
    """Return one mesh of several, in order; paints that are the same stand once."""
    vertex = np.cumsum([0, *(len(part.vertices) for part in parts)])
    numbers: dict[tuple[str, tuple[int, int, int], int], int] = {}
    paints: list[Paint] = []
    rows = []
    for part in parts:
        for paint in part.paints:
            key = (paint.name, paint.color, id(paint.picture))
            if numbers.setdefault(key, len(paints)) == len(paints):
                paints.append(paint)
        places = [numbers[p.name, p.color, id(p.picture)] for p in part.paints]
        rows.append(np.array(places, dtype=np.int64)[part.paint])
    return TexturedMesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + vertex[i] for i, part in enumerate(parts)]),
        np.concatenate([part.uv for part in parts]),
        np.concatenate(rows),
        tuple(paints),
        tuple(note for part in parts for note in part.notes),
    )
