"""Triangle meshes with names and materials: what every format writes and every view draws."""

from __future__ import annotations

from dataclasses import dataclass, field

from .arrays import Points2, Points3, Triangles


@dataclass(frozen=True, slots=True)
class Material:
    """Surface of a mesh: sRGB colour #rrggbb, opacity, roughness and metalness in 0..1.

    texture: an encoded PNG or JPEG picture (its bytes), multiplied with the colour. cutout: one
    sees through where the texture is more than half transparent. pattern: `siding`, `shingle`,
    `brick` or nothing, drawn on the colour; in files only where the mesh has texture coordinates.
    """

    name: str
    color: str
    opacity: float = 1.0
    roughness: float = 0.9
    metallic: float = 0.0
    texture: bytes | None = None
    pattern: str = ""
    cutout: bool = False


@dataclass(frozen=True, slots=True)
class Mesh:
    """A named part; faces (m, 3) run counter-clockwise seen from outside, z is up.

    Neighbours in a scene that share a name are one part in several materials.

    uv: (n, 2) texture coordinates, origin at the picture's lower left, or None.
    """

    name: str
    vertices: Points3
    faces: Triangles
    material: str
    uv: Points2 | None = None


@dataclass(frozen=True, slots=True)
class Scene:
    """Meshes and the materials they name; the mesh called `mass` is the closed solid.

    note: the artifact as one line of JSON, for formats that carry comments.
    """

    name: str
    meshes: tuple[Mesh, ...]
    materials: dict[str, Material] = field(default_factory=dict)
    note: str = ""
