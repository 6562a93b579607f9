"""Wavefront OBJ with MTL and textures by relative name; z up, metres."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from ..geometry.mesh import Material, Mesh, Scene
from .gltf import mime_type
from .tiles import tile

NOTE = "facade-tools artifact:"  # before the JSON of an artifact, in a comment


def write(scenes: Sequence[Scene], stem: str) -> dict[str, bytes]:
    """Return the files of an OBJ model by name: textures, `stem`.mtl, `stem`.obj, in this order.

    The artifacts stand in comments, so that `facade import`
    gets them back. With several scenes the parts' names are prefixed with their scene's.
    Vertices are written to the micrometre.
    """
    materials: dict[Material, str] = {}
    pictures: dict[bytes, str] = {}
    lines = [f"# {NOTE} {scene.note}" for scene in scenes if scene.note]
    lines.append(f"mtllib {stem}.mtl")
    offsets = np.ones(2, dtype=np.int64)
    for scene in scenes:
        prefix = "" if len(scenes) == 1 else f"{scene.name}/"
        for name, group in groupby(scene.meshes, key=lambda mesh: mesh.name):
            lines.append(f"o {_word(prefix + name)}")
            for mesh in group:
                material = _named(_covered(scene.materials[mesh.material], mesh), materials)
                lines.append(f"usemtl {material}")
                lines.extend(_mesh_lines(mesh, offsets))
    mtl = [
        line
        for material, name in materials.items()
        for line in _mtl(material, name, pictures, stem)
    ]
    files = {name: picture for picture, name in pictures.items()}
    files[f"{stem}.mtl"] = _text(mtl)
    files[f"{stem}.obj"] = _text(lines)
    return files


def _covered(material: Material, mesh: Mesh) -> Material:
    """Return the material with its pattern as a coloured texture where the mesh can carry one.

    Many readers let a texture take the place of the colour, so the texture brings it along.
    """
    if not material.pattern or mesh.uv is None:
        return replace(material, pattern="")
    picture = tile(material.pattern, material.color)
    name = f"{material.name}-{material.pattern}"
    return replace(material, name=name, color="#ffffff", texture=picture, pattern="")


def _text(lines: list[str]) -> bytes:
    return ("\n".join(lines) + "\n").encode()


def _word(name: str) -> str:
    return "_".join(name.split())


def _named(material: Material, names: dict[Material, str]) -> str:
    """Return the name of a material, made unique among different materials of the same name."""
    if material not in names:
        base, taken = _word(material.name), set(names.values())
        candidates = (base if i == 1 else f"{base}-{i}" for i in range(1, len(taken) + 2))
        names[material] = next(name for name in candidates if name not in taken)
    return names[material]


def _mesh_lines(mesh: Mesh, offsets: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Iterator[str]:
    yield from (f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in (mesh.vertices + 0.0).tolist())
    faces = (mesh.faces + offsets[0]).tolist()
    offsets[0] += len(mesh.vertices)
    if mesh.uv is None:
        yield from (f"f {a} {b} {c}" for a, b, c in faces)
        return
    yield from (f"vt {u:.6f} {v:.6f}" for u, v in mesh.uv.tolist())
    pairs = zip(faces, (mesh.faces + offsets[1]).tolist(), strict=True)
    offsets[1] += len(mesh.uv)
    yield from ("f " + " ".join(f"{p}/{t}" for p, t in zip(f, g, strict=True)) for f, g in pairs)


def _mtl(material: Material, name: str, pictures: dict[bytes, str], stem: str) -> Iterator[str]:
    red, green, blue = (int(material.color[i : i + 2], 16) / 255 for i in (1, 3, 5))
    yield f"newmtl {name}"
    yield f"Kd {red:.4f} {green:.4f} {blue:.4f}"
    yield f"Ns {1000 * (1 - material.roughness) ** 2:.1f}"
    yield f"Pr {material.roughness:.3f}"
    yield f"Pm {material.metallic:.3f}"
    yield f"d {material.opacity:.3f}"
    if material.texture is not None:
        if material.texture not in pictures:
            ending = "jpg" if mime_type(material.texture) == "image/jpeg" else "png"
            pictures[material.texture] = f"{stem}-{len(pictures)}.{ending}"
        yield f"map_Kd {pictures[material.texture]}"
