"""What the renderer needs to know of a scene's surfaces: triangle soup, colours, patterns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..geometry.arrays import Booleans, Floats, Integers
from ..geometry.mesh import Material, Scene

Bytes = NDArray[np.uint8]

PATTERNS = ("", "siding", "shingle", "brick", "stone")
GLOSSY = 0.35  # materials smoother than this mirror the sky
LARGEST_TEXTURE = 1024  # pixels along an edge; larger ones are scaled down before they are drawn


class Soup(NamedTuple):
    """Triangles (m, 3, 3) in metres with unit normals (m, 3), a look and a part each.

    looks, parts (m,): row of the tables below, number of the named part. uv (m, 3, 2). Of a look:
    colors (k, 3) linear light; patterns (k,) index into PATTERNS; gloss (k,) 1 mirrors the sky;
    pictures (k, 3) first row in `texels`, height and width, height 0 without a texture.
    cutouts (k,) whether one sees through the picture's holes. texels (n, 4): all textures' pixels,
    sRGB and opacity. tones (256,): linear light of the values of a texel.
    """

    corners: Floats
    normals: Floats
    looks: Integers
    parts: Integers
    uv: Floats
    colors: Floats
    patterns: Integers
    gloss: Floats
    pictures: Integers
    cutouts: Booleans
    texels: Bytes
    tones: Floats


def soup_of(scene: Scene) -> Soup:
    """Return the scene's triangles; degenerate ones keep a zero normal."""
    names = sorted(scene.materials)
    row = {name: index for index, name in enumerate(names)}
    meshes = [mesh for mesh in scene.meshes if len(mesh.faces)]
    corners = _stacked([mesh.vertices[mesh.faces] for mesh in meshes], (0, 3, 3))
    counts = [len(mesh.faces) for mesh in meshes]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    number = {name: index for index, name in enumerate(dict.fromkeys(m.name for m in meshes))}
    flat = [np.zeros((len(m.faces), 3, 2)) if m.uv is None else m.uv[m.faces] for m in meshes]
    looks = [scene.materials[name] for name in names]
    pictures, texels = _textures(looks)
    return Soup(
        corners,
        cross / np.where(length > 0.0, length, 1.0),
        np.repeat(np.array([row[m.material] for m in meshes], dtype=np.int64), counts),
        np.repeat(np.array([number[m.name] for m in meshes], dtype=np.int64), counts),
        _stacked(flat, (0, 3, 2)),
        np.array([linear_rgb(look.color) for look in looks]).reshape(-1, 3),
        np.array([PATTERNS.index(look.pattern) for look in looks], dtype=np.int64),
        np.array([float(look.roughness < GLOSSY) for look in looks]),
        pictures,
        np.array([look.cutout and pictures[k, 1] > 0 for k, look in enumerate(looks)], dtype=bool),
        texels,
        to_linear(np.arange(256) / 255.0),
    )


def _stacked(rows: list[Floats], shape: tuple[int, ...]) -> Floats:
    return np.ascontiguousarray(np.concatenate(rows)) if rows else np.zeros(shape)


def linear_rgb(color: str) -> tuple[float, float, float]:
    """Return linear-light red, green, blue in 0..1 of #rrggbb."""
    red, green, blue = to_linear(np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255)
    return float(red), float(green), float(blue)


def to_linear(values: Floats) -> Floats:
    """Return linear light of sRGB values in 0..1."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def to_srgb(values: Floats) -> Floats:
    """Return sRGB values in 0..1 of linear light, clipped."""
    v = np.clip(values, 0.0, 1.0)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)


def _textures(looks: list[Material]) -> tuple[Integers, Bytes]:
    """Return where each look's picture lies in the rows of all pictures' pixels, and those rows."""
    pictures = np.zeros((len(looks), 3), dtype=np.int64)
    rows = [np.zeros((1, 4), dtype=np.uint8)]
    known: dict[tuple[bytes, bool], tuple[int, int, int]] = {}
    for index, look in enumerate(looks):
        if look.texture is None or look.pattern:
            continue
        key = (look.texture, look.cutout)
        if key not in known:
            pixels = _decoded(look)
            known[key] = (sum(map(len, rows)), pixels.shape[0], pixels.shape[1])
            rows.append(pixels.reshape(-1, 4))
        pictures[index] = known[key]
    return pictures, np.concatenate(rows)


def _decoded(look: Material) -> Bytes:
    """Return a texture's pixels (h, w, 4), at most the largest size; white if it is broken."""
    import cv2

    data = np.frombuffer(look.texture or b"", np.uint8)
    read = cv2.imdecode(data, cv2.IMREAD_COLOR)
    if read is None:
        return np.full((1, 1, 4), 255, dtype=np.uint8)
    picture, opacity = read.astype(np.uint8), None
    if look.cutout:
        stored = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
        if stored is not None and stored.shape[2:] == (4,):
            opacity = stored[:, :, 3].astype(np.uint8)
    longest = max(picture.shape[:2])
    if longest > LARGEST_TEXTURE:
        height, width = (max(1, n * LARGEST_TEXTURE // longest) for n in picture.shape[:2])
        picture, opacity = _shrunk(picture, opacity, (width, height))
    if opacity is None:
        opacity = np.full(picture.shape[:2], 255, dtype=np.uint8)
    return np.dstack([picture[:, :, ::-1], opacity])


def _shrunk(
    picture: Bytes, opacity: Bytes | None, size: tuple[int, int]
) -> tuple[Bytes, Bytes | None]:
    """Return a picture and its opacity at a smaller size; what is hidden lends no colour."""
    import cv2

    if opacity is None:
        return cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.uint8), None
    share = opacity.astype(np.float32)[:, :, None]
    weighted = np.dstack([picture * share, share])
    small = cv2.resize(weighted, size, interpolation=cv2.INTER_AREA)
    color = small[:, :, :3] / np.maximum(small[:, :, 3:], 1e-6)
    return np.round(color).astype(np.uint8), np.round(small[:, :, 3]).astype(np.uint8)
