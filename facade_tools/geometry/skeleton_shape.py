"""What goes into a straight skeleton and what comes out of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facade_tools.errors import InvalidInput

from .arrays import Floats, Integers, Points2
from .polygons import Rings, signed_area


@dataclass(frozen=True, slots=True)
class Skeleton:
    """Straight skeleton of a polygon with n edges, edge k from point k to the next of its ring.

    points: (m, 2) nodes, metres; the first n are the polygon's own points. times: (m,) when the
    wavefront reaches the node: the distance to the edges of speed 1. faces: per edge the ring of
    its face, counter-clockwise, beginning with the edge itself; a face of speed 0 stands upright.
    holes: (edge, clockwise ring) of the faces that surround another, which needs unequal speeds.
    """

    points: Points2
    times: Floats
    faces: tuple[Integers, ...]
    holes: tuple[tuple[int, Integers], ...] = ()

    def polygon(self, edge: int) -> Rings:
        """Return the plan rings of one face: the outer one, then holes."""
        rings = [self.faces[edge], *(ring for k, ring in self.holes if k == edge)]
        return [self.points[ring] for ring in rings]

    def rings(self) -> tuple[Integers, list[Integers]]:
        """Return the edge of every ring of the faces, and the rings."""
        edges = [*range(len(self.faces)), *(edge for edge, _ in self.holes)]
        return np.array(edges), [*self.faces, *(ring for _, ring in self.holes)]


@dataclass(frozen=True, slots=True)
class Contour:
    """Edges of a polygon: points (n, 2), the next point of each, the speed of each edge."""

    points: Points2
    following: Integers
    speeds: Floats
    area: float

    @classmethod
    def of(cls, rings: Rings, speeds: Sequence[float] | Floats | None = None) -> Contour:
        """Concatenate rings; raise InvalidInput for what has no inside or no direction."""
        if not rings or min(len(ring) for ring in rings) < 3:
            raise InvalidInput("a ring needs at least three points")
        points = np.concatenate(rings)
        starts = np.cumsum([0, *(len(ring) for ring in rings)])
        following = np.arange(1, len(points) + 1)
        following[starts[1:] - 1] = starts[:-1]
        areas = [signed_area(ring) for ring in rings]
        if areas[0] <= 0 or max(areas[1:], default=-1.0) >= 0:
            raise InvalidInput("outer rings run counter-clockwise and holes clockwise")
        if not np.all(np.hypot(*(points[following] - points).T) > 0):
            raise InvalidInput("a ring has the same point twice in a row")
        pace = np.ones(len(points)) if speeds is None else np.asarray(speeds, dtype=np.float64)
        if pace.shape != (len(points),) or not np.all(pace >= 0) or not np.any(pace > 0):
            raise InvalidInput("one speed an edge is needed, none negative, not all zero")
        return cls(points, following, pace, sum(areas))

    def frames(self) -> tuple[Points2, Points2, Floats]:
        """Return unit directions (n, 2), inner unit normals (n, 2) and offsets (n,) of edges."""
        along = self.points[self.following] - self.points
        along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
        normal = np.column_stack([-along[:, 1], along[:, 0]])
        return along, normal, np.asarray(np.sum(normal * self.points, axis=1))
