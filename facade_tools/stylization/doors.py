"""Doors that a building has on the ground: a style is put onto the wall around them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..artifacts.building import Building, Element, Piece, Side
from ..geometry.arrays import Floats
from ..geometry.detail_boxes import Box6, LocalFrame, meshes_of, side_frame
from ..geometry.detail_windows import CASING
from ..geometry.details import element_meshes
from ..geometry.mesh import Mesh
from ..geometry.pieces import named_elements, named_pieces
from .placing import LEDGE
from .projection import SIDES
from .walling import Cover

GROUND = 1.0  # m above the ground: a door that stands higher belongs to a storey of the style
NICHE = 1.5  # m behind the wall: what lies deeper is a court
EVEN = 0.01  # m: walls that differ by less are one


def door_covers(building: Building) -> list[Cover]:
    """Return the doors on the ground, with their casings, as covers of a building's walls."""
    covers = []
    for _, side, piece, door in _ground_doors(building):
        along, direction, depth, _ = SIDES[side]
        ends = (door.u - CASING, door.u + door.width + CASING)
        low, high = sorted(piece.origin[along] + direction * u for u in ends)
        bottom = piece.origin[2] + door.v
        rectangle = (low, bottom, high, bottom + door.height + CASING)
        covers.append(Cover(side, piece.origin[depth], rectangle))
    return covers


def door_meshes(building: Building, walls: Sequence[Mesh]) -> list[Mesh]:
    """Return the doors on the ground before the textured walls of the building.

    walls: quads, four vertices each, in the building's own frame. A door stands on the foremost
    wall at its place (a plinth, a pilaster); a block in the colour of the trim closes what is open
    behind it.
    """
    corners = [mesh.vertices.reshape(-1, 4, 3) for mesh in walls]
    quads = np.concatenate(corners) if corners else np.zeros((0, 4, 3))
    meshes: list[Mesh] = []
    for name, side, piece, door in _ground_doors(building):
        frame = side_frame(side, piece.origin)
        rectangle = np.array([door.u, door.v, door.u + door.width, door.v + door.height])
        back, front = _depths(quads, frame, rectangle)
        if front - back > EVEN:
            u0, v0, u1, v1 = (rectangle + CASING * np.array([-1, 0, 1, 1])).tolist()
            block: Box6 = (u0, v0, back, u1, v1, front)
            meshes += meshes_of(name, {"trim": [block]}, frame)
        moved = LocalFrame(frame.world(np.array([[0.0, 0.0, front]]))[0], frame.axes)
        meshes += element_meshes(name, door, moved)
    return meshes


def _ground_doors(building: Building) -> Iterator[tuple[str, Side, Piece, Element]]:
    for start, side, piece in named_pieces(building):
        for name, element in named_elements(start, piece):
            if element.kind != "window" and piece.origin[2] + element.v < GROUND:
                yield name, side, piece, element


def _depths(quads: Floats, frame: LocalFrame, rectangle: Floats) -> tuple[float, float]:
    """Return how far the hindmost and the foremost wall stand before a rectangle's own plane (m).

    The foremost is at least that plane.
    """
    local = (quads - frame.origin) @ frame.axes.T
    low, high = local.min(axis=1), local.max(axis=1)
    across = np.minimum(high[:, :2], rectangle[2:]) - np.maximum(low[:, :2], rectangle[:2])
    upright = high[:, 2] - low[:, 2] < EVEN
    facing = local[:, 1, 0] > local[:, 0, 0]
    near = (low[:, 2] > -NICHE) & (high[:, 2] < LEDGE + EVEN)
    depths = high[upright & facing & near & (across > EVEN).all(axis=1), 2]
    back, front = min(depths, default=0.0), max(depths, default=0.0)
    return min(float(back), 0.0), max(float(front), 0.0)
