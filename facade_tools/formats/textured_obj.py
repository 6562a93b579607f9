"""OBJ and MTL as people really write them: polygons of any size, several materials, any case."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..errors import InvalidInput, Place
from .textured import GREY, Colours, Paint, TexturedMesh, Textures, read_bytes, with_colours
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
    maps = [table.get(name, _Map(name)) for name in content.names]
    paints = tuple(textures.paint(one.name or "none", one.color, one.file) for one in maps)
    mesh = _triangulated(content, paints)
    uv = mesh.uv * np.array([one.scale for one in maps])[mesh.paint, None]
    uv += np.array([one.offset for one in maps])[mesh.paint, None]
    notes = (*mesh.notes, *dict.fromkeys(textures.notes))
    mesh = replace(mesh, uv=uv, notes=notes)
    colours = _colours(content.positions)
    return mesh if colours is None else with_colours(mesh, colours[mesh.faces])


def _parsed(text: str, name: str) -> _Content:
    content = _Content()
    paint = 0
    for number, line in enumerate(text.replace("\\\n", " ").split("\n"), 1):
        word, rest = _statement(line)
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


def _statement(line: str) -> tuple[str, str]:
    """Return the keyword of a line and what follows; either is parted by spaces or tabs."""
    words = line.split(None, 1)
    return (words[0] if words else ""), (words[1] if len(words) > 1 else "").strip()


def _position(rest: str) -> tuple[float, ...]:
    """Return x, y, z, and whatever else stands there: a weight, or red, green and blue."""
    position = tuple(map(float, rest.split()[:7]))
    if len(position) < 3 or not all(map(math.isfinite, position)):
        raise InvalidInput("vertices need three finite coordinates")
    return position


def _colours(positions: list[tuple[float, ...]]) -> Colours | None:
    """Return the colours (n, 3) that stand behind the coordinates of all vertices, if they do."""
    if min(map(len, positions)) < 6:
        return None
    shares = np.array([position[3:6] for position in positions])
    shares = shares if shares.max() > 1 else 255 * shares
    colours: Colours = np.round(np.clip(shares, 0, 255)).astype(np.uint8)
    return colours


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
    vertices = np.array([position[:3] for position in content.positions], dtype=np.float64)
    return polygonal_mesh(vertices, rings, uv, content.paint, paints)


@dataclass(frozen=True, slots=True)
class _Map:
    """A material: its colour, and a texture's file with the scale and offset of its uv."""

    name: str
    color: tuple[int, int, int] = GREY
    file: str = ""
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)


def _materials(folder: Path, libraries: list[str], textures: Textures) -> dict[str, _Map]:
    table: dict[str, _Map] = {}
    for library in (name for names in libraries for name in _names(folder, names)):
        path = (folder / library).resolve()
        if not path.is_relative_to(folder.resolve()) or not path.is_file():
            textures.notes.append(f"material library {library!r} is missing or outside the folder")
            continue
        text = read_bytes(path).decode("utf-8", errors="replace")
        table |= {row.name: row for row in _rows(text)}
    return table


def _names(folder: Path, names: str) -> list[str]:
    """Return the libraries that a statement names: one with spaces in its name, or several."""
    names = names.replace("\\", "/").strip('"')
    return [names] if (folder / names).is_file() else names.split() or [names]


def _rows(text: str) -> list[_Map]:
    rows: list[_Map] = []
    for line in text.splitlines():
        word, rest = _statement(line)
        if word == "newmtl":
            rows.append(_Map(rest))
        elif rows and word == "Kd":
            rows[-1] = replace(rows[-1], color=_color(rest))
        elif rows and word.casefold() == "map_kd":
            rows[-1] = _mapped(rows[-1], rest)
    return rows


def _color(rest: str) -> tuple[int, int, int]:
    try:
        r, g, b = (min(max(float(value), 0.0), 1.0) for value in rest.split()[:3])
    except ValueError:
        return GREY
    return round(255 * r), round(255 * g), round(255 * b)


VECTORS = {"-s": 1.0, "-o": 0.0, "-t": 0.0}  # of one to three numbers; and what the rest are
ARGUMENTS = {
    **{"-mm": 2, "-bm": 1, "-clamp": 1, "-blendu": 1, "-blendv": 1},
    **{"-cc": 1, "-texres": 1, "-imfchan": 1, "-boost": 1, "-type": 1},
}


def _mapped(row: _Map, rest: str) -> _Map:
    """Return a material with the texture that a map statement names; names may hold spaces."""
    words = rest.split(" ")
    vectors: dict[str, tuple[float, float]] = {}
    while words and words[0] in {"", *VECTORS, *ARGUMENTS}:
        option = words.pop(0)
        if option in VECTORS:
            found: list[float] = []
            while len(found) < 3 and len(words) > 1 and _is_number(words[0]):
                found.append(float(words.pop(0)))
            u, v = (*found, VECTORS[option], VECTORS[option])[:2]
            vectors[option] = u, v
        else:
            del words[: ARGUMENTS.get(option, 0)]
    scale, offset = vectors.get("-s", row.scale), vectors.get("-o", row.offset)
    return replace(row, file=" ".join(words).strip().strip('"'), scale=scale, offset=offset)


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False
