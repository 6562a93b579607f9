"""Roofs, gables, porches and chimneys of a building over walls in another style."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..artifacts.building import Building
from ..artifacts.stylesheet import StyleFace
from ..geometry.arrays import Floats, Points3, Triangles
from ..geometry.details import crown_scene
from ..geometry.mesh import Material, Mesh, Scene
from ..geometry.solids import Solid, building_solid, triangulated
from ..geometry.triangulate import newell_normal
from ..imaging.image_io import Picture
from .atlas import encoded_page
from .bases import frame_of
from .doors import door_meshes
from .placed import TOUCH
from .retarget import RAISED, framed
from .splitting import SplitRule
from .style import Style, group_rule
from .synthesis import resized_rule

if TYPE_CHECKING:
    from manifold3d import Manifold

WITHIN = 0.1  # of a plain section, left out at either end: lintels and sills reach into it
SLIVER = 1e-4  # m above the eaves: what stands lower is the rounding of the solid
LAP = 2e-3  # m that the attic reaches below the eaves where it would not hold otherwise
LONGEST = 512  # pixels of a plain wall's texture
Piece = tuple[Picture, tuple[float, float]]  # and its width and height, m


def crowned(scene: Scene, style: Style, building: Building) -> Scene:
    """Return a retargeted building under its own roofs, with its doors, porches and chimneys.

    Roofs keep the building's colour, those of a building without colours take the style's; gables
    take a plain piece of the style's wall, mirrored so that it repeats without seams. A building of
    flat roofs alone keeps the style's roofs.
    """
    solid = building_solid(building)
    pitched = any(box.roof is not None and box.roof.style != "flat" for box in building.boxes)
    crown = crown_scene(building, solid if pitched else None)
    meshes, materials = list(crown.meshes), dict(crown.materials)
    if building.colors is None:
        materials["roof"] = replace(materials["roof"], color=roof_colour(style))
    walls, *bare = scene.meshes  # the mass comes first
    frame = frame_of(building)
    home = None if frame is None else np.linalg.inv(np.array(frame)).tolist()
    meshes += door_meshes(building, [framed(mesh, home) for mesh in bare])
    walls = _under_roof(walls, building, solid) if pitched else _filled(walls)
    scene = replace(scene, meshes=(walls, *bare))
    if pitched:
        picture, size = plain_wall(style)
        meshes.append(_gables(building, solid, size))
        materials["gable"] = Material("gable", "#ffffff", texture=encoded_page(picture))
    meshes = [framed(mesh, frame) for mesh in meshes]
    used = {mesh.material for mesh in meshes}
    kept = {f"own-{name}": replace(materials[name], name=f"own-{name}") for name in sorted(used)}
    own = [replace(m, material=f"own-{m.material}") for m in meshes if len(m.faces)]
    return replace(scene, meshes=(*scene.meshes, *own), materials={**scene.materials, **kept})


def roof_colour(style: Style) -> str:
    """Return the median colour of a style's view from above, #rrggbb."""
    pixels = style.pictures[style.sheet.roof].reshape(-1, 3)
    r, g, b = np.median(pixels, axis=0).astype(int).tolist()
    return f"#{r:02x}{g:02x}{b:02x}"


# --- the closed solid -----------------------------------------------------------------------------
def _under_roof(walls: Mesh, building: Building, solid: Solid) -> Mesh:
    """Return the closed walls with the attic on them as one closed mesh.

    Walls end at heights rounded to a tenth of a millimetre, and boxes stand where rounding lets
    them. Where that leaves a slit below the attic or a film of it on a wall, which single precision
    closes, the boxes that are cut from it are a little wider, then lower.
    """
    found = walls
    for wider, lower in ((0.0, 0.0), (TOUCH, 0.0), (TOUCH, LAP)):
        top = framed(attic(building, solid, wider, lower), frame_of(building))
        found = _united(walls, top)
        if _simple(_as_written(found)):
            break
    return found


def attic(building: Building, solid: Solid, wider: float, lower: float) -> Mesh:
    """Return what of the solid lies above the eaves of its boxes, made wider and lower (m)."""
    from manifold3d import Manifold, OpType

    walls = [
        Manifold.cube(
            (box.width + 2 * wider, box.depth + 2 * wider, (box.height or 0.0) + 1.0 - lower)
        ).translate((box.x - box.width / 2 - wider, box.y - box.depth / 2 - wider, -1.0))
        for box in building.boxes
        if box.kind != "porch"
    ]
    vertices, triangles, _ = triangulated(solid)
    whole = _manifold(Mesh("mass", vertices, triangles, "mass"))
    return _mesh(Manifold.batch_boolean([whole, *walls], OpType.Subtract))


def _united(walls: Mesh, top: Mesh) -> Mesh:
    whole = _filled(_mesh((_manifold(walls) + _manifold(top)).simplify(SLIVER)))
    if _simple(_as_written(whole)):
        return replace(walls, vertices=whole.vertices, faces=whole.faces)
    used, faces = np.unique(_without_slivers(whole), return_inverse=True)
    return replace(walls, vertices=whole.vertices[used], faces=faces.reshape(-1, 3))


def _filled(mesh: Mesh) -> Mesh:
    """Return a closed mesh without the hollows inside it, which nobody sees."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(mesh.faces)
    edges = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edge = np.unique(edges, axis=0, return_inverse=True)[1].reshape(-1)
    links = coo_array(
        (np.ones(len(edge)), (np.arange(count).repeat(3), count + edge)),
        shape=(4 * count, 4 * count),
    )
    parts = connected_components(links, directed=False)[1][:count]
    corners = mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0)
    outside = np.bincount(parts, weights=np.linalg.det(corners))[parts] > 0
    if outside.all():
        return mesh
    used, faces = np.unique(mesh.faces[outside], return_inverse=True)
    return replace(mesh, vertices=mesh.vertices[used], faces=faces.reshape(-1, 3))


def _as_written(mesh: Mesh) -> Triangles:
    """Return the triangles over vertices that are one where single precision makes them one."""
    single = mesh.vertices.astype(np.float32)
    names = np.unique(single, axis=0, return_inverse=True)[1].reshape(-1)
    faces: Triangles = names[mesh.faces]
    return faces


def _without_slivers(mesh: Mesh) -> Triangles:
    """Return the triangles of a closed mesh with its edges shorter than SLIVER drawn together.

    Their ends would be one vertex where coordinates are written in single precision, and the mesh
    closed no more. An edge stays whose ends cannot meet without an edge of four triangles.
    """
    faces = mesh.faces
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
    lengths = np.linalg.norm(np.diff(mesh.vertices[edges], axis=1)[:, 0], axis=1)
    heirs = np.arange(len(mesh.vertices))
    for a, b in edges[lengths < SLIVER].tolist():
        drawn = np.where(heirs == heirs[b], heirs[a], heirs)
        found = drawn[mesh.faces]
        found = found[(found != np.roll(found, 1, axis=1)).all(axis=1)]
        if _simple(found):
            heirs, faces = drawn, found
    return faces


def _simple(faces: Triangles) -> bool:
    """Tell whether no two triangles run along an edge in the same direction."""
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return len(np.unique(edges, axis=0)) == len(edges)


def _mesh(solid: Manifold) -> Mesh:
    found = solid.to_mesh64()
    vertices = np.array(found.vert_properties, dtype=np.float64)[:, :3]
    return Mesh("mass", vertices, np.array(found.tri_verts, dtype=np.int64), "mass")


def _manifold(mesh: Mesh) -> Manifold:
    from manifold3d import Manifold, Mesh64

    return Manifold(Mesh64(np.ascontiguousarray(mesh.vertices), mesh.faces.astype(np.uint64)))


# --- gables ---------------------------------------------------------------------------------------
def _gables(building: Building, solid: Solid, period: tuple[float, float]) -> Mesh:
    """Return what of the solid's walls stands above the eaves, a little before it."""
    eaves = {box.id: float(box.height or 0.0) + SLIVER for box in building.boxes}
    vertices, triangles, owners = triangulated(solid)
    corners: list[Points3] = [np.zeros((0, 3))]
    uv = [np.zeros((0, 2))]
    for triangle, owner in zip(triangles, owners, strict=True):
        label = solid.labels[owner]
        if label.semantic != "wall":
            continue
        normal = newell_normal(vertices[triangle])
        normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
        for piece in _above(vertices[triangle], eaves.get(label.owner, math.inf)):
            corners.append(piece + RAISED * normal)
            along = piece[:, :2] @ np.array([-normal[1], normal[0]])
            uv.append(np.column_stack([along, piece[:, 2]]) / np.array(period))
    points = np.concatenate(corners)
    faces = np.arange(len(points), dtype=np.int64).reshape(-1, 3)
    return Mesh("gables", points, faces, "gable", np.concatenate(uv))


def _above(triangle: Points3, height: float) -> Iterator[Points3]:
    """Yield the triangles (3, 3) of what stands above a height."""
    ring: list[Floats] = []
    for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        if a[2] > height:
            ring.append(a)
        if (a[2] > height) != (b[2] > height):
            ring.append(a + (height - a[2]) / (b[2] - a[2]) * (b - a))
    for k in range(1, len(ring) - 1):
        yield np.array([ring[0], ring[k], ring[k + 1]])


# --- a plain piece of wall ------------------------------------------------------------------------
def plain_wall(style: Style) -> tuple[Picture, tuple[float, float]]:
    """Return a piece of wall without windows, mirrored to repeat, and its size (m).

    It stands beside windows where a face has any, otherwise it is the whole face. Of the faces
    between bottom and top, where there are any, the texture of the most wall gives it.
    """
    body = {block.id for block in style.sheet.blocks if block.role == "body"}
    walls = [wall for wall in style.sheet.walls if wall.block in body] or style.sheet.walls
    pieces: dict[str, list[Piece]] = {}
    for face in (face for wall in walls for face in wall.faces):
        pieces.setdefault(face.texture, []).append(_piece(style, face))
    found = max(pieces.values(), key=lambda some: math.fsum(math.prod(size) for _, size in some))
    picture, (width, height) = max(found, key=lambda piece: math.prod(piece[1]))
    row = np.concatenate([picture, picture[:, ::-1]], axis=1)
    return np.concatenate([row, row[::-1]]), (2 * width, 2 * height)


def _piece(style: Style, face: StyleFace) -> Piece:
    picture = style.pictures[face.texture]
    size = abs(face.end - face.start), face.top - face.bottom
    columns = _longest(group_rule(style.sheet, face.vertical), size[0], windows=False)
    rows = _longest(group_rule(style.sheet, face.horizontal), size[1], windows=True)
    (left, right), (upper, lower) = (
        (int(low / total * pixels), max(int(low / total * pixels) + 1, int(high / total * pixels)))
        for (low, high), total, pixels in (
            (columns, size[0], picture.shape[1]),
            (rows, size[1], picture.shape[0]),
        )
    )
    part = picture[upper:lower, left:right][:LONGEST, :LONGEST]
    metres = (
        size[0] * part.shape[1] / picture.shape[1],
        size[1] * part.shape[0] / picture.shape[0],
    )
    return part, metres


def _longest(rule: SplitRule, size: float, windows: bool) -> tuple[float, float]:
    """Return from where to where (m) the longest section of windows, or of wall, runs.

    A rule without windows is all wall, and all of it is returned.
    """
    own = resized_rule(rule, size)
    if not own.insertable:
        return 0.0, size
    widths = np.empty(2 * len(own.insertable) + 1)
    widths[::2], widths[1::2] = own.scalable, own.insertable
    starts = np.concatenate([[0.0], np.cumsum(widths)[:-1]])
    first = 1 if windows else 0
    index = first + 2 * int(np.argmax(widths[first::2]))
    rest = WITHIN * widths[index]
    return float(starts[index] + rest), float(starts[index] + widths[index] - rest)
