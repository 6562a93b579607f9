"""OBJ and MTL as people really write them: polygons of any size, several materials, any case."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import InvalidInput, Place
from .textured import GREY, Paint, TexturedMesh, Textures, read_bytes
from .textured_polygons import MAX_CORNERS, polygonal_mesh


@dataclass
class _Content:
    """What the lines of a file say, before it becomes arrays."""

    positions: list[tuple[float, ...]] = field(default_factory=list)
    texture: list[tuple[float, ...]] = field(default_factory=list)
    polygons: list[list[tuple[int, int]]] = field(default_factory=list)  # vertex, uv (or -1)
    paint: list[int] = field(default_factory=list)
    names: list[str] = field(default_factory=lambda: [""])
    libraries: list[str] = field(default_factory=list)
    corners: int = 0


def read_obj(path: Path) -> TexturedMesh:
    """Return the mesh of an OBJ file with the textures of its MTL files.

    Polygons are triangulated by ear clipping; a polygon that stands twice (also with opposite
    winding) is kept once. Raises InvalidInput with the line of what cannot be read.
    """
    content = _parsed(read_bytes(path).decode("utf-8", errors="replace"), str(path))
    if not content.polygons:
        raise InvalidInput("holds no faces; expected a mesh").at(str(path))
    textures = Textures(path.parent)
    table = _materials(path.parent, content.libraries, textures)
    paints = tuple(table.get(name, Paint(name or "none")) for name in content.names)
    mesh = _triangulated(content, paints)
    notes = (*mesh.notes, *dict.fromkeys(textures.notes))
    return TexturedMesh(mesh.vertices, mesh.faces, mesh.uv, mesh.paint, paints, notes)


def _parsed(text: str, name: str) -> _Content:
    content = _Content()
    paint = 0
    for number, line in enumerate(text.replace("\\\n", " ").split("\n"), 1):
        word, _, rest = line.strip().partition(" ")
        try:
            if word == "v":
                content.positions.append(_position(rest))
            elif word == "vt":
                content.texture.append(tuple(map(float, rest.split()[:2])))
            elif word == "f":
                _add_face(content, rest, paint)
            elif word == "usemtl":
                paint = _paint_index(content, rest.strip())
            elif word == "mtllib":
                content.libraries.append(rest.strip())
        except InvalidInput as error:
            raise error.at(name, number) from None
        except (ValueError, IndexError):
            place = Place(name, number)
            raise InvalidInput(f"{line.strip()[:60]!r} is no OBJ statement", place) from None
    return content


def _position(rest: str) -> tuple[float, ...]:
    position = tuple(map(float, rest.split()[:3]))
    if len(position) != 3 or not all(map(math.isfinite, position)):
        raise InvalidInput("vertices need three finite coordinates")
    return position


def _add_face(content: _Content, rest: str, paint: int) -> None:
    corners = []
    for corner in rest.split("#")[0].split():
        parts = corner.split("/")
        vertex = _index(parts[0], len(content.positions))
        uv = _index(parts[1], len(content.texture)) if len(parts) > 1 and parts[1] else -1
        corners.append((vertex, uv))
    content.corners += len(corners)
    if content.corners > MAX_CORNERS:
        raise InvalidInput(f"more than {MAX_CORNERS:,} face corners")
    if len(corners) >= 3:
        content.polygons.append(corners)
        content.paint.append(paint)


def _index(text: str, count: int) -> int:
    value = int(text)
    index = value - 1 if value > 0 else count + value
    if not 0 <= index < count:
        raise IndexError(text)
    return index


def _paint_index(content: _Content, name: str) -> int:
    if name not in content.names:
        content.names.append(name)
    return content.names.index(name)


def _triangulated(content: _Content, paints: tuple[Paint, ...]) -> TexturedMesh:
    texture = np.array([(*pair, math.nan, math.nan)[:2] for pair in content.texture] or [(0, 0)])
    texture = np.vstack([texture, [math.nan, math.nan]])  # index -1
    rings = [np.array([vertex for vertex, _ in corners]) for corners in content.polygons]
    uv = [texture[[slot for _, slot in corners]] for corners in content.polygons]
    vertices = np.array(content.positions, dtype=np.float64)
    return polygonal_mesh(vertices, rings, uv, content.paint, paints)


def _materials(folder: Path, libraries: list[str], textures: Textures) -> dict[str, Paint]:
    table: dict[str, Paint] = {}
    for library in libraries:
        path = (folder / library.replace("\\", "/")).resolve()
        if not path.is_relative_to(folder.resolve()) or not path.is_file():
            textures.notes.append(f"material library {library!r} is missing or outside the folder")
            continue
        text = read_bytes(path).decode("utf-8", errors="replace")
        for name, color, picture in _paint_rows(text):
            table[name] = Paint(name, color, textures.read(picture) if picture else None)
    return table


def _paint_rows(text: str) -> list[tuple[str, tuple[int, int, int], str]]:
    rows: list[tuple[str, tuple[int, int, int], str]] = []
    for line in text.splitlines():
        word, _, rest = line.strip().partition(" ")
        if word == "newmtl":
            rows.append((rest.strip(), GREY, ""))
        elif rows and word == "Kd":
            rows[-1] = (rows[-1][0], _color(rest), rows[-1][2])
        elif rows and word == "map_Kd":
            rows[-1] = (*rows[-1][:2], _map_name(rest))
    return rows


def _color(rest: str) -> tuple[int, int, int]:
    try:
        r, g, b = (min(max(float(value), 0.0), 1.0) for value in rest.split()[:3])
    except ValueError:
        return GREY
    return round(255 * r), round(255 * g), round(255 * b)


OPTIONS = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2, "-bm": 1, "-clamp": 1, "-blendu": 1, "-blendv": 1}


def _map_name(rest: str) -> str:
    """Return the file name of a map statement without its options; names may hold spaces."""
    words = rest.strip().split(" ")
    while words and words[0] in OPTIONS:
        words = words[1 + OPTIONS[words[0]] :]
    return " ".join(words)
