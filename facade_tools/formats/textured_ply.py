"""PLY as scanners and modellers write it: polygons of any size, three encodings, any textures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidInput
from ..geometry.arrays import Floats, Integers
from .textured import (
    GREY,
    Colours,
    Paint,
    TexturedMesh,
    Textures,
    read_bytes,
    with_colours,
)
from .textured_polygons import MAX_CORNERS, polygonal_mesh

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
RINGS = ("vertex_indices", "vertex_index")
COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
COLOURS = ("red", "green", "blue")
Column = Floats | list[Floats]  # numbers, or lists of them


@dataclass
class _Element:
    """What the header says of one kind: properties as (name, type, type of a list's length)."""

    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)


def read_ply(path: Path) -> TexturedMesh:
    """Return the mesh of a PLY file with the pictures that its comments name.

    Coordinates of textures stand at the vertices or at the corners of faces, the number of the
    texture at the faces. Faces without a picture have their colours or those of their vertices.
    Raises InvalidInput on what cannot be read.
    """
    data = read_bytes(path)
    try:
        order, elements, pictures, start = _header(data)
        content = dict(_content(data, start, order, elements))
        vertex, face = content["vertex"], content["face"]
        vertices = np.column_stack([np.asarray(vertex[axis]) for axis in "xyz"])
        lists = next(face[name] for name in RINGS if name in face)
    except (KeyError, ValueError, IndexError, StopIteration, OverflowError) as error:
        raise InvalidInput(f"is no PLY mesh: {error or 'it ends too early'}").at(
            str(path)
        ) from None
    rings = [np.asarray(ring, dtype=np.int64) for ring in lists]
    if not rings:
        raise InvalidInput("holds no faces; expected a mesh").at(str(path))
    textures = Textures(path.parent)
    mesh = polygonal_mesh(vertices, rings, _uv(vertex, face, rings), range(len(rings)), ())
    paints = [textures.paint(f"texture-{i}", GREY, name) for i, name in enumerate(pictures)]
    number = _numbers(face, len(rings))[mesh.paint]  # the paint of a triangle is its ring's number
    known = (number >= 0) & (number < len(paints))
    colours = _colours(vertex, face, mesh)
    mesh = replace(
        mesh,
        paint=np.where(known, number, len(paints)),
        paints=(*paints, Paint("none")),
        notes=(*mesh.notes, *textures.notes),
    )
    return mesh if colours is None else with_colours(mesh, colours)


def _header(data: bytes) -> tuple[str, list[_Element], list[str], int]:
    """Return byte order ("" for text), the elements, the textures, and where data begins."""
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise ValueError("no header")
    order = ""
    pictures: list[str] = []
    elements: list[_Element] = []
    for line in data[:end].decode("utf-8", errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["format"]:
            order = ORDERS[words[1]]
        elif words[:1] == ["element"]:
            elements.append(_Element(words[1], int(words[2])))
        elif words[:2] == ["property", "list"]:
            elements[-1].properties.append((words[4], TYPES[words[3]], TYPES[words[2]]))
        elif words[:1] == ["property"]:
            elements[-1].properties.append((words[2], TYPES[words[1]], ""))
        elif words[:1] == ["comment"] and words[1:2] and words[1].lower() == "texturefile":
            pictures.append(line.split(None, 2)[2].strip())
    return order, elements, pictures, data.index(b"\n", end) + 1


def _content(
    data: bytes, start: int, order: str, elements: list[_Element]
) -> Iterator[tuple[str, dict[str, Column]]]:
    if not order:
        words = np.array(data[start:].split(), dtype=np.float64)
        at = 0
        for element in elements:
            columns, at = _from_words(words, at, element)
            yield element.name, columns
        return
    for element in elements:
        columns, start = _from_bytes(data, start, order, element)
        yield element.name, columns


def _bounded(element: _Element, left: int) -> None:
    """Refuse counts that the rest of the file cannot hold."""
    if not 0 <= element.count <= min(left, MAX_CORNERS):
        raise ValueError(f"{element.count} of {element.name!r} do not fit the file")


def _from_words(words: Floats, at: int, element: _Element) -> tuple[dict[str, Column], int]:
    _bounded(element, len(words) - at)
    names = [name for name, _, _ in element.properties]
    if not any(length for _, _, length in element.properties):
        size = element.count * len(names)
        table = words[at : at + size].reshape(element.count, len(names))
        return {name: table[:, k] for k, name in enumerate(names)}, at + size
    columns: dict[str, list[Floats]] = {name: [] for name in names}
    for _ in range(element.count):
        for name, _, length in element.properties:
            size = int(words[at]) if length else 1
            at += bool(length)
            if size < 0 or at + size > len(words):
                raise ValueError("a list ends too early")
            columns[name].append(words[at : at + size])
            at += size
    return dict(columns), at


def _from_bytes(
    data: bytes, at: int, order: str, element: _Element
) -> tuple[dict[str, Column], int]:
    _bounded(element, len(data) - at)
    if not any(length for _, _, length in element.properties):
        kind = np.dtype([(name, order + one) for name, one, _ in element.properties])
        table = np.frombuffer(data, kind, element.count, at)
        columns = {name: table[name].astype(np.float64) for name, _, _ in element.properties}
        return dict(columns), at + element.count * kind.itemsize
    lists: dict[str, list[Floats]] = {name: [] for name, _, _ in element.properties}
    kinds = [(n, np.dtype(order + k), np.dtype(order + c) if c else None)
             for n, k, c in element.properties]  # fmt: skip
    for _ in range(element.count):
        for name, kind, counter in kinds:
            size = 1
            if counter is not None:
                size = int(np.frombuffer(data, counter, 1, at)[0])
                at += counter.itemsize
            if size < 0:
                raise ValueError("a list of negative length")
            lists[name].append(np.frombuffer(data, kind, size, at) if size else np.empty(0))
            at += size * kind.itemsize
    return dict(lists), at


def _uv(
    vertex: dict[str, Column], face: dict[str, Column], rings: list[Integers]
) -> list[Floats] | None:
    """Return the corners' coordinates of every ring, None where the file has none."""
    if "texcoord" in face:
        corners = [np.asarray(values, dtype=np.float64) for values in face["texcoord"]]
        plain: NDArray[np.float64] = np.full((1, 2), np.nan)
        return [
            one.reshape(-1, 2) if len(one) == 2 * len(ring) else np.repeat(plain, len(ring), axis=0)
            for one, ring in zip(corners, rings, strict=True)
        ]
    names = next((pair for pair in COORDINATES if set(pair) <= set(vertex)), None)
    if names is None:
        return None
    places = np.column_stack([np.asarray(vertex[name]) for name in names])
    return [places[np.clip(ring, 0, len(places) - 1)] for ring in rings]


def _numbers(face: dict[str, Column], count: int) -> Integers:
    """Return the number of every face's texture."""
    if "texnumber" not in face:
        return np.zeros(count, dtype=np.int64)
    return np.clip(_scalars(face["texnumber"]), -1, MAX_CORNERS).astype(np.int64)


def _scalars(column: Column) -> Floats:
    """Return a property that has one number, whichever way it was read; 0 for what is none."""
    values = [float(np.ravel(value)[0]) if np.size(value) else 0.0 for value in column]
    return np.nan_to_num(np.array(values, dtype=np.float64))


def _colours(
    vertex: dict[str, Column], face: dict[str, Column], mesh: TexturedMesh
) -> Colours | None:
    """Return the colours (m, 3, 3) of triangles' corners, those of their faces or vertices."""
    if set(COLOURS) <= set(face):
        return np.repeat(_rgb(face)[mesh.paint][:, None], 3, axis=1)
    return _rgb(vertex)[mesh.faces] if set(COLOURS) <= set(vertex) else None


def _rgb(element: dict[str, Column]) -> Colours:
    """Return colours (n, 3) of bytes, or of shares where they are numbers up to 1 with a point."""
    values = np.stack([_scalars(element[name]) for name in COLOURS], axis=1)
    shares = values.max(initial=0.0) <= 1.0 and (values % 1.0).any()
    return np.round(np.clip(255 * values if shares else values, 0, 255)).astype(np.uint8)
