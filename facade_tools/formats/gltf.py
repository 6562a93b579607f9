"""Binary glTF 2.0: y up, one node and mesh a part, flat shading, PBR materials."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..geometry.mesh import Material, Mesh, Scene
from .tiles import tile

FLOAT, USHORT, UINT = 5126, 5123, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
JPEG_MAGIC = b"\xff\xd8"


def write(scenes: Sequence[Scene], name: str) -> bytes:
    """Return the scenes as one GLB file, each under a node of its name.

    (x, y, z) becomes (x, z, -y) in 32-bit floats; transforms are identity. With one scene its
    parts keep their names, with several they are prefixed with their scene's. Equal input gives
    equal bytes.
    """
    build = _Build()
    roots = [build.scene(scene, "" if len(scenes) == 1 else f"{scene.name}/") for scene in scenes]
    return build.file(name, roots)


def covered(material: Material, mesh: Mesh) -> Material:
    """Return the material with its pattern as a texture where the mesh can carry one."""
    if not material.pattern:
        return material
    texture = None if mesh.uv is None else tile(material.pattern)
    suffix = "" if mesh.uv is None else f"-{material.pattern}"
    return replace(material, name=material.name + suffix, texture=texture, pattern="")


def linear(color: str) -> tuple[float, float, float]:
    """Return the linear-light components of #rrggbb.

    >>> linear("#ff0000")
    (1.0, 0.0, 0.0)
    """
    red, green, blue = (int(color[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return _linear(red), _linear(green), _linear(blue)


def _linear(value: float) -> float:
    return float(value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4)


@dataclass
class _Build:
    """The tables of a file while it is put together."""

    nodes: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    materials: list[dict[str, Any]] = field(default_factory=list)
    images: list[bytes] = field(default_factory=list)
    known: dict[Material, int] = field(default_factory=dict)
    # One view for vertex data of each stride, one for indices of each size.
    chunks: dict[str, list[bytes]] = field(default_factory=dict)
    sizes: dict[str, int] = field(default_factory=dict)

    def scene(self, scene: Scene, prefix: str) -> int:
        children = []
        for name, group in groupby(scene.meshes, key=lambda mesh: mesh.name):
            primitives = [self._primitive(mesh, scene) for mesh in group if len(mesh.faces)]
            if primitives:
                children.append(len(self.nodes))
                self.nodes.append({"name": prefix + name, "mesh": len(self.meshes)})
                self.meshes.append({"name": prefix + name, "primitives": primitives})
        node: dict[str, Any] = {"name": scene.name}
        self.nodes.append({**node, "children": children} if children else node)
        return len(self.nodes) - 1

    def _primitive(self, mesh: Mesh, scene: Scene) -> dict[str, Any]:
        x, y, z = mesh.vertices.T
        positions = np.stack([x, z, -y], axis=1).astype("<f4") + np.float32(0.0)
        attributes = {"POSITION": self._vertices("position", positions, bounded=True)}
        if mesh.uv is not None:
            flipped = np.stack([mesh.uv[:, 0], 1.0 - mesh.uv[:, 1]], axis=1).astype("<f4")
            attributes["TEXCOORD_0"] = self._vertices("uv", flipped)
        small = len(positions) < 65535
        indices = mesh.faces.astype("<u2" if small else "<u4").ravel()
        accessor = self._add(
            "index2" if small else "index4",
            indices.tobytes(),
            {"componentType": USHORT if small else UINT, "count": indices.size, "type": "SCALAR"},
        )
        material = self._material(covered(scene.materials[mesh.material], mesh))
        return {"attributes": attributes, "indices": accessor, "material": material}

    def _vertices(self, view: str, rows: NDArray[np.float32], bounded: bool = False) -> int:
        shape: dict[str, Any] = {"componentType": FLOAT, "count": len(rows)}
        shape["type"] = "VEC3" if rows.shape[1] == 3 else "VEC2"
        if bounded:
            shape |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        return self._add(view, rows.tobytes(), shape)

    def _add(self, view: str, data: bytes, accessor: dict[str, Any]) -> int:
        offset = self.sizes.get(view, 0)
        self.chunks.setdefault(view, []).append(data)
        self.sizes[view] = offset + len(data)
        self.accessors.append({"bufferView": view, "byteOffset": offset, **accessor})
        return len(self.accessors) - 1

    def _material(self, material: Material) -> int:
        if material not in self.known:
            self.known[material] = len(self.materials)
            self.materials.append(self._material_json(material))
        return self.known[material]

    def _material_json(self, material: Material) -> dict[str, Any]:
        pbr: dict[str, Any] = {
            "baseColorFactor": [*(round(c, 6) for c in linear(material.color)), material.opacity],
            "metallicFactor": material.metallic,
            "roughnessFactor": material.roughness,
        }
        if material.texture is not None:
            if material.texture not in self.images:
                self.images.append(material.texture)
            pbr["baseColorTexture"] = {"index": self.images.index(material.texture)}
        out: dict[str, Any] = {"name": material.name, "pbrMetallicRoughness": pbr}
        if material.cutout:
            return out | {"alphaMode": "MASK", "doubleSided": True}
        return out | ({"alphaMode": "BLEND"} if material.opacity < 1.0 else {})

    def file(self, name: str, roots: list[int]) -> bytes:
        views, body = self._views()
        first_image = len(views) - len(self.images)
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"facade-tools {__version__}"},
            "scene": 0,
            "scenes": [{"name": name, **({"nodes": roots} if roots else {})}],
        }
        tables = {"nodes": self.nodes, "meshes": self.meshes, "materials": self.materials}
        document |= {key: rows for key, rows in tables.items() if rows}
        if self.images:
            document["samplers"] = [
                {"wrapS": 10497, "wrapT": 10497, "magFilter": 9729, "minFilter": 9987}
            ]
            document["images"] = [
                {"bufferView": first_image + i, "mimeType": mime_type(data)}
                for i, data in enumerate(self.images)
            ]
            document["textures"] = [{"source": i, "sampler": 0} for i in range(len(self.images))]
        if body:
            document |= {"accessors": self.accessors, "bufferViews": views}
            document["buffers"] = [{"byteLength": len(body)}]
        return _container(document, body)

    def _views(self) -> tuple[list[dict[str, Any]], bytes]:
        views: list[dict[str, Any]] = []
        number: dict[str, int] = {}
        body = bytearray()
        for view, chunks in self.chunks.items():
            number[view] = len(views)
            data = b"".join(chunks)
            views.append(
                {"buffer": 0, "byteOffset": len(body), "byteLength": len(data), **_TARGET[view]}
            )
            body += data + bytes(-len(data) % 4)
        for image in self.images:
            views.append({"buffer": 0, "byteOffset": len(body), "byteLength": len(image)})
            body += image + bytes(-len(image) % 4)
        for accessor in self.accessors:
            accessor["bufferView"] = number[accessor["bufferView"]]
        return views, bytes(body)


_TARGET: dict[str, dict[str, int]] = {
    "position": {"target": ARRAY_BUFFER, "byteStride": 12},
    "uv": {"target": ARRAY_BUFFER, "byteStride": 8},
    "index2": {"target": ELEMENT_ARRAY_BUFFER},
    "index4": {"target": ELEMENT_ARRAY_BUFFER},
}


def mime_type(picture: bytes) -> str:
    """Return the media type of an encoded picture, JPEG or PNG."""
    return "image/jpeg" if picture.startswith(JPEG_MAGIC) else "image/png"


def _container(document: dict[str, Any], body: bytes) -> bytes:
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    parts = [struct.pack("<I4s", len(text), b"JSON"), text]
    if body:
        parts += [struct.pack("<I4s", len(body), b"BIN\0"), body]
    length = 12 + sum(map(len, parts))
    return struct.pack("<4sII", b"glTF", 2, length) + b"".join(parts)
