"""The closed mass of a derivation: volumes and roofs under one upper envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ..geometry.arrays import Booleans, Points2, Points3
from ..geometry.polygons import Rings, oriented, shape_of, signed_area
from ..geometry.roofs import Patch
from ..geometry.solids import Solid
from ..geometry.solids_envelope import envelope_solid
from .roofing import Roof
from .scopes import Scope, Shape

GROUND = 1e-3  # metres: what starts below this stands on the ground
REST = 0.02  # metres that a volume may float above what it stands on
INWARD = 0.98  # share of the way from its middle at which a volume's corners are probed


@dataclass(frozen=True, slots=True)
class Volume:
    """Upright part of the mass in the world: its outline, bottom and top (m), its patches on top.

    style: of a roof, "" for a prism.
    """

    rings: Rings
    bottom: float
    top: float
    patches: tuple[Patch, ...]
    style: str = ""


def is_upright(scope: Scope) -> bool:
    """Return whether a scope's z runs straight up."""
    return bool(scope.axes[2, 2] > 1.0 - 1e-9)


def prism_volume(shape: Shape) -> Volume:
    """Return the volume of an upright solid."""
    bottom = float(shape.scope.origin[2])
    rings = oriented(shape.spatial(ring, 0.0)[:, :2] for ring in shape.rings())
    top = bottom + float(shape.scope.size[2])
    return Volume(rings, bottom, top, (Patch(rings, (0.0, 0.0, top)),))


def roof_volume(shape: Shape, roof: Roof, style: str) -> Volume:
    """Return the volume of a roof over the top of a shape."""
    base = shape.scope.moved(np.array([0.0, 0.0, shape.scope.size[2]]), np.zeros(3))
    patches = tuple(_placed(patch, base) for patch in roof.patches)
    rings = oriented(shape.spatial(ring, 0.0)[:, :2] for ring in shape.rings())
    height = float(base.origin[2])
    top = max((_height(patch, ring).max() for patch in patches for ring in patch.rings),
              default=height)  # fmt: skip
    return Volume(rings, height, float(top), patches, style)


def _placed(patch: Patch, base: Scope) -> Patch:
    """Return a patch of a roof's own coordinates in the world."""
    turn, origin = base.axes[:2, :2], base.origin
    rings = oriented(ring @ turn + origin[:2] for ring in patch.rings)
    gradient = np.array(patch.plane[:2]) @ turn
    level = patch.plane[2] + origin[2] - float(gradient @ origin[:2])
    return replace(patch, rings=rings, plane=(float(gradient[0]), float(gradient[1]), level))


def _height(patch: Patch, points: Points2) -> np.ndarray:
    a, b, c = patch.plane
    return np.asarray(points @ np.array([a, b]) + c)


def standing(volumes: Sequence[Volume]) -> list[Volume]:
    """Return the volumes that stand on the ground or on one another, the lower ones first."""
    kept: list[Volume] = []
    for volume in sorted(volumes, key=lambda v: v.bottom):
        if volume.bottom <= GROUND or _rests(volume, kept):
            kept.append(volume)
    return kept


def _rests(volume: Volume, others: Sequence[Volume]) -> bool:
    outer = volume.rings[0]
    middle = shapely.get_coordinates(shapely.point_on_surface(shape_of(volume.rings)))
    probes = np.concatenate([middle + INWARD * (outer - middle), middle])
    heights = np.full(len(probes), -np.inf)
    for other in others:
        for patch in other.patches:
            inside = shapely.intersects_xy(shape_of(patch.rings), probes[:, 0], probes[:, 1])
            heights[inside] = np.maximum(heights[inside], _height(patch, probes[inside]))
    return bool((heights >= volume.bottom - REST).all())


def inside_mass(points: Points3, volumes: Sequence[Volume]) -> Booleans:
    """Return whether points (n, 3) lie inside standing volumes."""
    inside = np.zeros(len(points), dtype=bool)
    for volume in volumes:
        for patch in volume.patches:
            over = shapely.intersects_xy(shape_of(patch.rings), points[:, 0], points[:, 1])
            inside |= over & (points[:, 2] < _height(patch, points[:, :2]) - GROUND)
    return inside


def mass_solid(volumes: Sequence[Volume]) -> Solid | None:
    """Return the closed solid under the upper envelope of standing volumes; None of none.

    Patches below a roof of the same outline are left out: the roof covers them.
    """
    patches = []
    for number, volume in enumerate(volumes):
        if volume.style or not any(_covers(other, volume) for other in volumes if other.style):
            patches += [replace(patch, group=number) for patch in volume.patches]
    patches = [p for p in patches if signed_area(p.rings[0]) > 1e-9]
    return envelope_solid(patches) if patches else None


def _covers(roof: Volume, prism: Volume) -> bool:
    same = abs(roof.bottom - prism.top) < 1e-6
    return same and bool(shape_of(roof.rings).buffer(1e-6).covers(shape_of(prism.rings)))
