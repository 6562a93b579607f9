"""What the renderer needs to know of a scene's surfaces: triangle soup, colours, patterns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.arrays import Floats, Integers
from ..geometry.mesh import Material, Scene

PATTERNS = ("", "siding", "shingle", "brick", "grass", "stone")
GLOSSY = 0.35  # materials smoother than this mirror the sky


@dataclass(frozen=True, slots=True)
class Soup:
    """Triangles (m, 3, 3) in metres with unit normals (m, 3) and a row of `looks` each.

    colors: linear RGB a look (k, 3). patterns: index into PATTERNS (k,). gloss: 1 mirrors the
    sky, 0 does not (k,). textures: pictures in linear RGB (h, w, 3) or None a look. uv (m, 3, 2).
    parts: number of the part a triangle belongs to (m,).
    """

    corners: Floats
    normals: Floats
    looks: Integers
    parts: Integers
    uv: Floats
    colors: Floats
    patterns: Integers
    gloss: Floats
    textures: tuple[Floats | None, ...]


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
    return Soup(
        corners,
        cross / np.where(length > 0.0, length, 1.0),
        np.repeat(np.array([row[m.material] for m in meshes], dtype=np.int64), counts),
        np.repeat(np.array([number[m.name] for m in meshes], dtype=np.int64), counts),
        _stacked(flat, (0, 3, 2)),
        np.array([linear_rgb(look.color) for look in looks]).reshape(-1, 3),
        np.array([PATTERNS.index(look.pattern) for look in looks], dtype=np.int64),
        np.array([float(look.roughness < GLOSSY) for look in looks]),
        tuple(_texture(look) for look in looks),
    )


def _stacked(rows: list[Floats], shape: tuple[int, ...]) -> Floats:
    return np.concatenate(rows) if rows else np.zeros(shape)


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


def _texture(material: Material) -> Floats | None:
    if material.texture is None:
        return None
    import cv2

    picture = cv2.imdecode(np.frombuffer(material.texture, np.uint8), cv2.IMREAD_COLOR)
    return None if picture is None else to_linear(picture[:, :, ::-1] / 255.0)


def patterned(pattern: int, points: Floats, normals: Floats) -> Floats:
    """Return the brightness factor (n,) of a pattern at points (n, 3) of faces with normals."""
    name = PATTERNS[pattern]
    if name == "siding":
        return _rows(points[:, 2] / 0.17, 0.16, 0.22)
    if name == "shingle":
        return _courses(points, normals, (0.33, 0.26), 0.3)
    if name == "brick":
        return _courses(points, normals, (0.26, 0.085), 0.22)
    if name == "stone":
        return _courses(points, normals, (0.55, 0.28), 0.25)
    return np.ones(len(points))


def _rows(position: Floats, line: float, depth: float) -> Floats:
    """Boards: a dark line under each, a soft gradient on it."""
    within = position - np.floor(position)
    return np.where(within < line, 1.0 - depth, 1.0 + 0.06 * (within - 0.5))


def _courses(points: Floats, normals: Floats, size: tuple[float, float], depth: float) -> Floats:
    """Staggered tiles in rows across the face, each a little lighter or darker than the next."""
    across = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = np.where(length > 1e-6, across / np.where(length > 0, length, 1.0), [[1.0, 0.0]])
    along = np.sum(points[:, :2] * across, axis=1)
    slope = np.maximum(np.linalg.norm(normals[:, :2], axis=1), 1e-3)
    flat = slope < 0.05
    up = np.where(flat, points[:, 1], points[:, 2] / np.where(flat, 1.0, slope)) / size[1]
    row = np.floor(up)
    column = along / size[0] + 0.5 * (row % 2)
    cell = np.floor(column)
    noise = np.sin(cell * 12.9898 + row * 78.233) * 43758.5453
    tint = 1.0 + 0.16 * (noise - np.floor(noise) - 0.5)
    joint = (up - row < 0.16) | (column - cell < 0.05)
    return tint * np.where(joint, 1.0 - depth, 1.0)
