"""Atomic shapes: a symbol, a scope in space, and an outline inside it (KSTTP09 2.1).

A scope is a box with three axes: x to the right, y to the back, z up. A footprint lies in its xy
plane; a wall seen from outside lies in its xz plane, y pointing into the building.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ..geometry.arrays import Floats, Points3
from ..geometry.polygons import Rings, rings_of, shape_of

AXES = {"x": 0, "y": 1, "z": 2}
FLAT = 1e-9  # metres: a thinner scope is flat
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Scope:
    """A box in space: origin (3,), rows of axes (3, 3) are x, y, z, size (3,) metres, none < 0."""

    origin: Floats
    axes: Floats
    size: Floats

    def world(self, points: Points3) -> Points3:
        """Return world coordinates of local points (n, 3), metres."""
        return points @ self.axes + self.origin

    def moved(self, step: Floats, size: Floats) -> Scope:
        """Return a scope of a new size whose origin lies `step` (local, metres) away."""
        return Scope(self.origin + step @ self.axes, self.axes, size)

    def turned(self, axes: Floats, origin: Floats, size: Floats) -> Scope:
        """Return the scope whose axes (rows) and origin are given in this one's coordinates."""
        return Scope(self.origin + origin @ self.axes, axes @ self.axes, size)

    def bounds(self) -> tuple[float, ...]:
        """Return the least and the greatest corner in the world, six numbers."""
        corners = self.world(np.array(list(np.ndindex(2, 2, 2))) * self.size)
        return (*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())

    @property
    def mirrored(self) -> bool:
        """Whether the axes are left-handed."""
        return bool(np.linalg.det(self.axes) < 0.0)


@dataclass(frozen=True, slots=True)
class Shape:
    """A symbol and its geometry.

    outline: rings (local, metres) in the plane across `normal` (y: xz, z: xy), or None for the
    whole scope. side: which way a face looks. index, count: place in the latest repeat.
    """

    symbol: str
    scope: Scope
    outline: Rings | None = None
    normal: str = "z"
    side: str = ""
    index: int = 0
    count: int = 1

    @property
    def plane(self) -> str:
        """The axis across which the outline lies; of a whole scope the one it is flat along."""
        if self.outline is not None:
            return self.normal
        size = self.scope.size
        return "y" if size[1] <= FLAT < size[2] else "z"

    @property
    def thickness(self) -> float:
        """Size across the outline's plane, metres."""
        return float(self.scope.size[AXES[self.plane]])

    def rings(self) -> Rings:
        """Return the outline, of a whole scope its rectangle."""
        if self.outline is not None:
            return self.outline
        w = self.scope.size[0]
        h = self.scope.size[2 if self.plane == "y" else 1]
        return [np.array([[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]])]

    def spatial(self, ring: Floats, across: float) -> Points3:
        """Return world points of a ring (n, 2) of the outline's plane at a place across it."""
        local = np.zeros((len(ring), 3))
        local[:, 0] = ring[:, 0]
        local[:, 2 if self.plane == "y" else 1] = ring[:, 1]
        local[:, AXES[self.plane]] = across
        return self.scope.world(local)

    def names(self) -> dict[str, float | str]:
        """Return what expressions may read of a shape."""
        width, depth, height = (float(v) for v in self.scope.size)
        area = abs(sum(shapely.area(shape_of([r])) * (-1 if k else 1)
                       for k, r in enumerate(self.rings())))  # fmt: skip
        return {
            "width": width, "depth": depth, "height": height, "area": float(area),
            "side": self.side, "index": float(self.index), "count": float(self.count),
            "z": float(self.scope.origin[2]),
        }  # fmt: skip


@dataclass(frozen=True, slots=True)
class Faces:
    """Planar faces in space: points (n, 3) and rings of indices, outer first, seen from outside."""

    points: Points3
    faces: tuple[tuple[tuple[int, ...], ...], ...]


def faces_of(shape: Shape) -> Faces:
    """Return the faces of a shape: one if it is flat, a closed prism otherwise; none if empty."""
    rings, thick = shape.rings(), shape.thickness
    if min(np.ptp(rings[0], axis=0)) <= FLAT:
        return Faces(np.zeros((0, 3)), ())
    # Seen along y a wall's outline runs counter-clockwise at y = 0, a plan's at the top.
    outer = 0.0 if shape.plane == "y" else thick
    shown, index = _ring_points(shape, rings, outer, 0)
    if thick <= FLAT:
        return _oriented(Faces(shown, (index,)), shape.scope.mirrored)
    hidden, back = _ring_points(shape, rings, thick - outer, len(shown))
    sides = [
        ((b[k], b[(k + 1) % len(b)], a[(k + 1) % len(a)], a[k]),)
        for a, b in zip(index, back, strict=True)
        for k in range(len(a))
    ]
    reverse = tuple(ring[::-1] for ring in back)
    faces = Faces(np.concatenate([shown, hidden]), (index, reverse, *sides))
    return _oriented(faces, shape.scope.mirrored)


def _ring_points(
    shape: Shape, rings: Rings, across: float, first: int
) -> tuple[Points3, tuple[tuple[int, ...], ...]]:
    points = np.concatenate([shape.spatial(ring, across) for ring in rings])
    index, at = [], first
    for ring in rings:
        index.append(tuple(range(at, at + len(ring))))
        at += len(ring)
    return points, tuple(index)


def _oriented(faces: Faces, mirrored: bool) -> Faces:
    if not mirrored:
        return faces
    return replace(faces, faces=tuple(tuple(r[::-1] for r in face) for face in faces.faces))


def cut(shape: Shape, axis: int, start: float, stop: float) -> Iterator[Shape]:
    """Yield the part of a shape between two places along an axis of its scope; may be several."""
    step, size = np.zeros(3), shape.scope.size.copy()
    step[axis], size[axis] = start, stop - start
    scope = shape.scope.moved(step, size)
    if shape.outline is None or axis == AXES[shape.plane]:
        yield replace(shape, scope=scope)
        return
    column = 0 if axis == 0 else 1
    low, high = np.full(2, -1e9), np.full(2, 1e9)
    low[column], high[column] = start, stop
    part = shapely.clip_by_rect(shape_of(shape.outline), *low, *high)
    for polygon in shapely.get_parts(part):
        if isinstance(polygon, shapely.Polygon) and polygon.area > 1e-9:
            rings = [ring - step[[0, 2 if shape.plane == "y" else 1]] for ring in rings_of(polygon)]
            yield simplified(replace(shape, scope=scope, outline=rings))


def simplified(shape: Shape) -> Shape:
    """Return a shape whose outline is left out where it is the whole rectangle of its scope."""
    if shape.outline is None or len(shape.outline) > 1:
        return shape
    whole = float(shape.scope.size[0] * shape.scope.size[2 if shape.normal == "y" else 1])
    area = float(shapely.area(shape_of(shape.outline)))
    solid = shape.scope.size[AXES[shape.normal]] > FLAT
    if abs(whole - area) > 1e-7 * max(whole, 1e-9) or (solid and shape.normal == "y"):
        return shape
    return replace(shape, outline=None)
