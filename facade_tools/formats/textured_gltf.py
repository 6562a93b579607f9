"""glTF 2.0, binary or not, as exporters write it: every instance in its place, base colours.

Our own, because the readers that there are drop what a facade is drawn with: transforms and second
coordinates of textures, colours of corners, holes.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidInput
from ..geometry.arrays import Floats, Integers
from .textured import (
    GREY,
    NO_TEXTURE,
    Colours,
    Paint,
    Texture,
    TexturedMesh,
    Textures,
    joined,
    read_bytes,
    with_colours,
)
from .textured_polygons import MAX_CORNERS

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES, STRIP, FAN = 4, 5, 6
# What may be required of a reader, and changes neither shapes nor base colours beyond what is read.
READ = ("KHR_texture_transform", "KHR_mesh_quantization", "EXT_texture_webp", "KHR_materials_")
GLOSSY = "KHR_materials_pbrSpecularGlossiness"
MAX_DEPTH, MAX_NODES = 200, 1_000_000  # of the tree of nodes
BROKEN = (
    KeyError, IndexError, TypeError, ValueError, AttributeError,
    OverflowError, RecursionError, struct.error,
)  # fmt: skip


def read_gltf(path: Path) -> TexturedMesh:
    """Return the mesh of a glTF file, y up, in metres, with the base colours of its materials.

    Raises InvalidInput where it cannot be read or shows no faces.
    """
    try:
        file = _File(*_content(read_bytes(path)), Textures(path.parent))
        file.check()
        parts = [part for mesh, place in file.instances() for part in file.parts(mesh, place)]
    except BROKEN as error:
        said = f"{type(error).__name__}: {error}"
        raise InvalidInput(f"is no glTF 2.0 that can be read: {said}").at(str(path)) from None
    if not sum(len(part.faces) for part in parts):
        raise InvalidInput("holds no faces; expected a mesh").at(str(path))
    mesh = joined(parts)
    return replace(mesh, notes=(*file.plain(), *dict.fromkeys(file.textures.notes)))


def _content(data: bytes) -> tuple[Any, bytes]:
    """Return the document of a file and its binary chunk."""
    if not data.startswith(b"glTF"):
        return json.loads(data), b""
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2 or length > len(data):
        raise ValueError("a header that does not fit; expected version 2")
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, at)
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    return json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b"")


@dataclass
class _File:
    """A document with its binary chunk; what was read of it."""

    document: Any
    binary: bytes
    textures: Textures
    buffers: dict[int, bytes] = field(default_factory=dict)
    images: dict[int, Texture] = field(default_factory=dict)
    paints: dict[int, Paint] = field(default_factory=dict)
    corners: int = 0

    def check(self) -> None:
        """Refuse what only other readers understand."""
        needed = self.document.get("extensionsRequired", [])
        strange = [name for name in needed if not str(name).startswith(READ)]
        if strange:
            raise InvalidInput(f"needs the extension {strange[0]!r}; expected a file without it")

    def plain(self) -> list[str]:
        """Tell how many materials have no picture, where others do."""
        bare = sum(paint.picture is None for paint in self.paints.values())
        count = len(self.paints)
        if not 0 < bare < count:
            return []
        return [f"{bare} of {count} materials have no texture: drawn in their plain colours"]

    # --- where meshes stand -----------------------------------------------------------------------
    def instances(self) -> Iterator[tuple[Any, Floats]]:
        """Yield the meshes that the scene shows, each with its place (4, 4).

        Raises ValueError where nodes hold themselves.
        """
        nodes = self.document.get("nodes", [])
        stack = [(root, np.eye(4), 0) for root in self._roots(nodes)]
        seen = 0
        while stack:
            number, place, depth = stack.pop()
            seen += 1
            node = nodes[number]
            place = place @ _matrix(node)
            if depth > MAX_DEPTH or seen > MAX_NODES:
                raise ValueError("too many nodes, or nodes that hold themselves")
            stack += [(child, place, depth + 1) for child in reversed(node.get("children", []))]
            if "mesh" in node:
                yield self.document["meshes"][node["mesh"]], place

    def _roots(self, nodes: Sequence[Any]) -> list[int]:
        scenes = self.document.get("scenes")
        if scenes:
            found: list[int] = scenes[self.document.get("scene", 0)].get("nodes", [])
            return found[::-1]
        inner = {child for node in nodes for child in node.get("children", [])}
        return [number for number in range(len(nodes)) if number not in inner][::-1]

    # --- shapes -----------------------------------------------------------------------------------
    def parts(self, mesh: Any, place: Floats) -> Iterator[TexturedMesh]:
        """Yield the triangles of a mesh; points and lines are left out."""
        for primitive in mesh["primitives"]:
            mode = primitive.get("mode", TRIANGLES)
            if mode in (TRIANGLES, STRIP, FAN) and "POSITION" in primitive["attributes"]:
                yield self._part(primitive, mode, place)

    def _part(self, primitive: Any, mode: int, place: Floats) -> TexturedMesh:
        attributes = primitive["attributes"]
        vertices = self.accessor(attributes["POSITION"])[:, :3]
        vertices = vertices @ place[:3, :3].T + place[:3, 3]
        if not np.isfinite(vertices).all():
            raise InvalidInput("holds coordinates that are not finite; expected metres")
        faces = self._faces(primitive, mode, len(vertices))
        self.corners += faces.size
        if self.corners > MAX_CORNERS:
            raise InvalidInput(f"more than {MAX_CORNERS:,} face corners")
        material = self._material(primitive.get("material"))
        uv = np.full((len(faces), 3, 2), np.nan)
        channel = f"TEXCOORD_{material.channel}"
        if channel in attributes:
            places = self.accessor(attributes[channel])[:, :2] @ material.turn.T + material.shift
            uv = (places * np.array([1.0, -1.0]) + np.array([0.0, 1.0]))[faces]
        number = np.zeros(len(faces), dtype=np.int64)
        part = TexturedMesh(vertices, faces, uv, number, (material.paint,))
        if "COLOR_0" not in attributes:
            return part
        linear = self.accessor(attributes["COLOR_0"])[:, :3] * material.factor
        return with_colours(part, _srgb(linear)[faces])

    def _faces(self, primitive: Any, mode: int, count: int) -> Integers:
        index = (
            self.accessor(primitive["indices"])[:, 0].astype(np.int64)
            if "indices" in primitive
            else np.arange(count)
        )
        if mode == TRIANGLES:
            faces = index[: len(index) // 3 * 3].reshape(-1, 3)
        elif mode == STRIP:
            faces = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
            faces[1::2] = faces[1::2, ::-1]
        else:
            faces = np.stack([np.full(max(len(index) - 2, 0), index[0]), index[1:-1], index[2:]], 1)
        if len(faces) and not 0 <= faces.min() <= faces.max() < count:
            raise ValueError("a face names a vertex that is not there")
        return faces

    # --- numbers ----------------------------------------------------------------------------------
    def accessor(self, number: int) -> Floats:
        """Return the values (n, width) of an accessor; integers that stand for shares as shares.

        Raises ValueError on more values than a mesh may have.
        """
        one = self.document["accessors"][number]
        kind, width = np.dtype(TYPES[one["componentType"]]), WIDTHS[one["type"]]
        count = int(one["count"])
        if not 0 <= count <= MAX_CORNERS:
            raise ValueError(f"{count} values")
        values = np.zeros((count, width), kind)
        if "bufferView" in one:
            values = self._rows(one["bufferView"], one.get("byteOffset", 0), kind, count, width)
        if "sparse" in one:
            values = values.copy()
            sparse, at = one["sparse"], one["sparse"]["indices"]
            index = self._rows(
                at["bufferView"], at.get("byteOffset", 0), np.dtype(TYPES[at["componentType"]]),
                sparse["count"], 1,
            )[:, 0]  # fmt: skip
            some = sparse["values"]
            values[index] = self._rows(
                some["bufferView"], some.get("byteOffset", 0), kind, sparse["count"], width
            )
        shares = values.astype(np.float64)
        if one.get("normalized") and kind.kind != "f":
            shares = np.maximum(shares / np.iinfo(kind).max, -1.0)
        return shares

    def _rows(
        self, view: int, start: int, kind: np.dtype[Any], count: int, width: int
    ) -> NDArray[Any]:
        one = self.document["bufferViews"][view]
        stride = one.get("byteStride") or kind.itemsize * width
        data = self._view(view)
        return np.ndarray((count, width), kind, data, start, (stride, kind.itemsize))

    def _view(self, number: int) -> bytes:
        one = self.document["bufferViews"][number]
        start = one.get("byteOffset", 0)
        buffer, end = self._buffer(one["buffer"]), start + one["byteLength"]
        if not 0 <= start <= end <= len(buffer):
            raise ValueError("a buffer that ends too early")
        return buffer[start:end]

    def _buffer(self, number: int) -> bytes:
        if number not in self.buffers:
            address = self.document["buffers"][number].get("uri")
            self.buffers[number] = self.binary if address is None else self._bytes(address)
        return self.buffers[number]

    def _bytes(self, address: str) -> bytes:
        """Return what an address holds: data of its own, or a file inside the folder."""
        if address.startswith("data:"):
            return _embedded(address)
        folder = self.textures.folder
        path = (folder / unquote(address)).resolve()
        if not path.is_relative_to(folder):
            raise InvalidInput(f"buffer {address!r} lies outside the file's folder: not read")
        return read_bytes(path)

    # --- colours ----------------------------------------------------------------------------------
    def _material(self, number: int | None) -> _Material:
        material = {} if number is None else self.document["materials"][number]
        plain = material.get("pbrMetallicRoughness", {})
        glossy = material.get("extensions", {}).get(GLOSSY, {})
        factor = plain.get("baseColorFactor", glossy.get("diffuseFactor", (1, 1, 1, 1)))
        info = plain.get("baseColorTexture", glossy.get("diffuseTexture"))
        rgb = np.array(factor, dtype=np.float64)[:3]
        key = -1 if number is None else number
        if key not in self.paints:
            opaque = material.get("alphaMode", "OPAQUE") == "OPAQUE"
            self.paints[key] = self._paint(str(material.get("name", "none")), rgb, info, opaque)
        return _Material(self.paints[key], rgb, *_transform(info or {}))

    def _paint(self, name: str, factor: Floats, info: Any, opaque: bool) -> Paint:
        r, g, b = _srgb(factor).tolist()
        if info is None:
            return Paint(name, (r, g, b))
        lost = Paint(name, GREY if (factor == 1).all() else (r, g, b))
        texture = self.document["textures"][info["index"]]
        webp = texture.get("extensions", {}).get("EXT_texture_webp", {})
        picture, holes = self._image(webp.get("source", texture.get("source")))
        if picture is None:
            return lost
        if (factor != 1).any():
            shades = _srgb(_linear(np.arange(256))[:, None] * factor)
            picture = np.stack([shades[picture[:, :, k], k] for k in range(3)], axis=2)
        return Paint(name, (r, g, b), picture, None if opaque else holes)

    def _image(self, number: int | None) -> Texture:
        if number is None:
            self.textures.notes.append("a texture has no picture that can be read")
            return NO_TEXTURE
        if number not in self.images:
            image = self.document["images"][number]
            address, name = image.get("uri", ""), str(image.get("name", f"image {number}"))
            if "bufferView" in image:
                self.images[number] = self.textures.embedded(self._view(image["bufferView"]), name)
            elif address.startswith("data:"):
                self.images[number] = self.textures.embedded(_embedded(address), name)
            else:
                self.images[number] = self.textures.read(unquote(address))
        return self.images[number]


@dataclass(frozen=True, slots=True)
class _Material:
    """A paint, its linear factor (3,), and where its texture finds its coordinates.

    turn (2, 2), shift (2,): coordinates of the channel to those of the picture, v down.
    """

    paint: Paint
    factor: Floats
    channel: int
    turn: Floats
    shift: Floats


def _transform(info: Mapping[str, Any]) -> tuple[int, Floats, Floats]:
    """Return channel, turn and shift of a texture (KHR_texture_transform)."""
    more = info.get("extensions", {}).get("KHR_texture_transform", {})
    angle = float(more.get("rotation", 0.0))
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]]) * np.array(more.get("scale", (1, 1)), dtype=np.float64)
    channel = int(more.get("texCoord", info.get("texCoord", 0)))
    return channel, turn, np.array(more.get("offset", (0, 0)), dtype=np.float64)


def _matrix(node: Any) -> Floats:
    """Return the place (4, 4) of a node in its parent."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    place = np.eye(4)
    place[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
    place[:3, 3] = node.get("translation", (0, 0, 0))
    return place


def _embedded(address: str) -> bytes:
    head, _, body = address.partition(",")
    try:
        return base64.b64decode(body) if head.endswith(";base64") else unquote_to_bytes(body)
    except binascii.Error as error:
        raise ValueError(f"data that cannot be decoded: {error}") from None


def _srgb(linear: Floats) -> Colours:
    """Return bytes of linear light 0..1."""
    light = np.clip(np.nan_to_num(linear), 0.0, 1.0)
    shares = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.round(255 * shares).astype(np.uint8)


def _linear(values: NDArray[Any]) -> Floats:
    """Return the linear light 0..1 of bytes."""
    shares = values / 255.0
    return np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
