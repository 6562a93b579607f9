"""From a building or a footprint to a scene: closed mass, roof slabs, openings, porches."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..artifacts.building import Building, Colors, Element, Piece, Side
from ..artifacts.footprint import Footprint
from .detail_boxes import Box6, LocalFrame, meshes_of, side_frame
from .detail_cladding import cladding, corner_boards, wall_pattern
from .detail_doors import door_parts, garage_door_parts
from .detail_roofs import roof_slabs
from .detail_volumes import bay_window, chimney, porch
from .detail_windows import CASING, window_parts
from .mesh import Material, Mesh, Scene
from .pieces import named_elements, named_pieces
from .solids import Solid, building_solid, footprint_solid, triangulated

SCHEMES = (  # of what has no colours of its own
    Colors("#d9d3c3", "#f4f2ec", "#54575c", "#7a2e2a"),
    Colors("#9fb0b5", "#f5f5f2", "#4a4744", "#2e4057"),
    Colors("#c9b79c", "#fbf8f0", "#6b4a3a", "#36523f"),
    Colors("#b5543f", "#f1ebdf", "#4d4f55", "#22313f"),
    Colors("#e9e6df", "#ffffff", "#5d5f66", "#8c3b2e"),
    Colors("#8d9b7f", "#f3efe2", "#574a42", "#5b2f22"),
    Colors("#dcc48e", "#fffaf0", "#5a5148", "#274b45"),
    Colors("#7d8ea3", "#f2f4f5", "#3f4247", "#a8702a"),
)
PLINTH = 0.22  # height of the foundation that shows, metres


def building_scene(building: Building) -> Scene:
    """Return the scene of a building: `mass` is its closed solid, all else named parts.

    Raises InvalidInput where no mass can be built, as of a partial building without heights.
    """
    solid = building_solid(building)
    colors = building.colors or _own_colors(building.id)
    pattern = wall_pattern(building, colors.wall)
    meshes = [
        mass_mesh(solid),
        *cladding(solid, pattern),
        *corner_boards(solid, pattern),
        *_roofs(building, solid),
    ]
    for name, side, piece in named_pieces(building):
        meshes += _piece(name, side, piece)
    meshes += _attached(building)
    return Scene(building.id, tuple(meshes), materials(colors, pattern))


def crown_scene(building: Building, solid: Solid | None) -> Scene:
    """Return what stands over and before a building's walls: roof slabs, porches, chimneys.

    solid: of the building, for the slabs of its roofs; None leaves them out.
    """
    meshes = [] if solid is None else _roofs(building, solid)
    colors = building.colors or _own_colors(building.id)
    return Scene(building.id, (*meshes, *_attached(building)), materials(colors))


def _roofs(building: Building, solid: Solid) -> list[Mesh]:
    overhang = {box.id: box.roof.overhang for box in building.boxes if box.roof is not None}
    return roof_slabs(solid, overhang)


def _attached(building: Building) -> list[Mesh]:
    meshes = []
    porches = [box for box in building.boxes if box.kind == "porch"]
    for index, box in enumerate(porches, 1):
        meshes += porch(f"porch-{index}", box, building)
    for index, stack in enumerate(building.chimneys, 1):
        meshes += chimney(f"chimney-{index}", stack, 0.0)
    return meshes


def building_sketch(building: Building) -> Scene:
    """Return the scene of a building, whole or partial: unknown heights are one storey."""
    boxes = tuple(
        box if box.height else replace(box, height=building.storey_height) for box in building.boxes
    )
    return building_scene(replace(building, boxes=boxes))


def footprint_scene(footprint: Footprint) -> Scene:
    """Return the scene of a footprint: its extrusion with roof, and the roof's slab."""
    solid = footprint_solid(footprint)
    overhang = 0.0 if footprint.roof is None else footprint.roof.overhang
    meshes = (mass_mesh(solid), *roof_slabs(solid, {"": overhang}))
    return Scene(footprint.id, meshes, materials(_own_colors(footprint.id), ""))


def _own_colors(identity: str) -> Colors:
    """Return colours for what knows none: its name picks them, so that streets are mixed."""
    return SCHEMES[zlib.crc32(identity.encode()) % len(SCHEMES)]


def mass_mesh(solid: Solid) -> Mesh:
    """Return the closed solid as the mesh `mass`."""
    vertices, triangles, _ = triangulated(solid)
    return Mesh("mass", vertices, triangles, "wall")


def materials(colors: Colors, pattern: str = "siding") -> dict[str, Material]:
    """Return the materials of a building by name; pattern: of the walls."""
    rows = (
        Material("wall", colors.wall, roughness=0.85, pattern=pattern),
        Material("roof", colors.roof, roughness=0.95, pattern="shingle"),
        Material("fascia", colors.trim, roughness=0.7),
        Material("trim", colors.trim, roughness=0.6),
        Material("door", colors.door, roughness=0.5),
        Material("garage-door", _mixed(colors.trim, "#d8d8d4"), roughness=0.6),
        Material("shadow", "#3c3a37", roughness=0.95),
        Material("glass", "#2c3a45", roughness=0.08),
        Material("metal", "#b9a06a", roughness=0.36, metallic=0.8),
        Material("stone", "#a9a59c", roughness=0.9),
        Material("plinth", "#8f8b83", roughness=0.95),
        Material("brick", "#97503e", roughness=0.9, pattern="brick"),
        Material("clay", "#b0694a", roughness=0.9),
        Material("wood", "#9a8a74", roughness=0.85),
    )
    return {material.name: material for material in rows}


def _mixed(first: str, second: str) -> str:
    pairs = zip(bytes.fromhex(first[1:]), bytes.fromhex(second[1:]), strict=True)
    return "#" + bytes((a + b) // 2 for a, b in pairs).hex()


def _piece(name: str, side: Side, piece: Piece) -> Iterator[Mesh]:
    frame = side_frame(side, piece.origin)
    for part, element in named_elements(name, piece):
        yield from element_meshes(part, element, frame)
    yield from _plinth(f"{name}/plinth", piece, frame)


def element_meshes(name: str, element: Element, frame: LocalFrame) -> list[Mesh]:
    """Return a window, door or garage door, one mesh a material; frame: of its piece."""
    if element.kind == "window" and element.style == "bay":
        return list(bay_window(name, element, frame, 0.0))
    if element.kind == "window":
        return meshes_of(name, window_parts(element), frame)
    if element.kind == "door":
        return meshes_of(name, door_parts(element), frame)
    return meshes_of(name, garage_door_parts(element), frame)


def _plinth(name: str, piece: Piece, frame: LocalFrame) -> list[Mesh]:
    """Return the foundation's band along a piece on the ground, open at doors."""
    if piece.origin[2] > 1e-6:
        return []
    gaps = sorted(
        (element.u - CASING, element.u + element.width + CASING)
        for element in piece.elements
        if element.v < PLINTH
    )
    boxes: list[Box6] = [
        (a, 0.0, 0.0, b, PLINTH, 0.03) for a, b in _between(gaps, piece.width) if b - a > 1e-3
    ]
    return meshes_of(name, {"plinth": boxes}, frame)


def _between(gaps: Sequence[tuple[float, float]], width: float) -> Iterator[tuple[float, float]]:
    at = 0.0
    for low, high in gaps:
        yield at, min(low, width)
        at = max(at, high)
    yield at, width


def signed_volume(mesh: Mesh) -> float:
    """Return the volume (m³) that a closed mesh encloses, positive when it faces outward."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)
