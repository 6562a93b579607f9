"""Textured triangle meshes of other people: what every reader of them returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..artifacts.store import unreadable
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Integers, Points3, Triangles
from ..imaging.image_io import Picture, decoded

MAX_MESH_BYTES = 1 << 30
MAX_TEXTURE_BYTES = 64 << 20
MAX_TEXTURE_PIXELS = 400_000_000  # of all pictures of a model together
GREY = (190, 190, 190)


@dataclass(frozen=True, slots=True)
class Paint:
    """A material: sRGB colour, and a picture (h, w, 3) that takes its place where there is one."""

    name: str
    color: tuple[int, int, int] = GREY
    picture: Picture | None = None


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


class Textures:
    """Finds and decodes the pictures that a mesh file names, all inside its folder."""

    def __init__(self, folder: Path) -> None:
        """Remember the folder that the mesh file lies in."""
        self.folder = folder.resolve()
        self.notes: list[str] = []
        self.pixels = 0

    def read(self, name: str) -> Picture | None:
        """Return a picture, or None (with a note) if it is missing or cannot be decoded."""
        path = self._find(name)
        if path is None:
            self.notes.append(f"texture {name!r} is missing: drawn in its plain colour")
            return None
        try:
            picture = decoded(_bounded(path, MAX_TEXTURE_BYTES), path.name)
        except InvalidInput as error:
            self.notes.append(f"texture {name!r} {error.message}: drawn in its plain colour")
            return None
        self.pixels += picture.shape[0] * picture.shape[1]
        if self.pixels > MAX_TEXTURE_PIXELS:
            limit = MAX_TEXTURE_PIXELS // 10**6
            raise InvalidInput(f"textures of more than {limit} megapixels together")
        return picture

    def _find(self, name: str) -> Path | None:
        """Look the name up inside the folder; by its letters alone if the case is wrong."""
        relative = name.replace("\\", "/")
        exact = (self.folder / relative).resolve()
        if not exact.is_relative_to(self.folder):
            self.notes.append(f"texture {name!r} lies outside the file's folder: not read")
            return None
        if exact.is_file():
            return exact
        wanted = Path(relative).name.casefold()
        found = [p for p in self._siblings() if p.name.casefold() == wanted]
        if found:
            self.notes.append(f"texture {name!r} was found as {found[0].name!r}")
        return found[0] if found else None

    def _siblings(self) -> list[Path]:
        places = [self.folder, *(p for p in sorted(self.folder.iterdir()) if p.is_dir())]
        return [entry for place in places for entry in sorted(place.iterdir()) if entry.is_file()]


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
