"""Parts made of boxes and polygons in a facade piece's frame: what every detail is built from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..artifacts.building import Side
from .arrays import Floats, Points3, Triangles
from .mesh import Mesh

Box6 = tuple[float, float, float, float, float, float]  # u0, v0, w0, u1, v1, w1 metres
Parts = dict[str, list[Box6]]  # material -> boxes

# Corner i of a box takes bit 0 of i for u, bit 1 for v, bit 2 for w.
_CORNERS = np.array([[(i >> k) & 1 for k in range(3)] for i in range(8)], dtype=bool)
_FACES = np.array(
    [
        *[(4, 5, 7), (4, 7, 6)],  # +w, towards the viewer
        *[(1, 0, 2), (1, 2, 3)],  # -w
        *[(5, 1, 3), (5, 3, 7)],  # +u
        *[(0, 4, 6), (0, 6, 2)],  # -u
        *[(6, 7, 3), (6, 3, 2)],  # +v
        *[(0, 1, 5), (0, 5, 4)],  # -v
    ],
    dtype=np.int64,
)

_U: dict[Side, tuple[int, int]] = {
    "front": (1, 0),
    "right": (0, 1),
    "back": (-1, 0),
    "left": (0, -1),
}


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Right-handed frame: rows of `axes` are u (right), v (up), w (out of the wall).

    origin: world coordinates, metres.
    """

    origin: Floats
    axes: Floats

    def world(self, points: Points3) -> Points3:
        """Return world coordinates of points (n, 3) given as u, v, w."""
        return points @ self.axes + self.origin


WORLD = LocalFrame(np.zeros(3), np.eye(3))


def side_frame(side: Side, origin: Iterable[float]) -> LocalFrame:
    """Return the frame of a facade piece: u to the right seen from outside, v up, w outward."""
    x, y = _U[side]
    axes = np.array([[x, y, 0.0], [0.0, 0.0, 1.0], [y, -x, 0.0]])
    return LocalFrame(np.array(tuple(origin), dtype=np.float64), axes)


def box_triangles(boxes: Sequence[Box6]) -> tuple[Points3, Triangles]:
    """Return vertices (8n, 3) and outward triangles (12n, 3) of closed boxes; none gives none."""
    bounds = np.asarray(boxes, dtype=np.float64).reshape(-1, 2, 3)
    low, high = bounds[:, :1], bounds[:, 1:]
    vertices = np.where(_CORNERS, high, low).reshape(-1, 3)
    steps = 8 * np.arange(len(bounds))[:, None, None]
    return vertices, (_FACES + steps).reshape(-1, 3)


def meshes_of(name: str, parts: Mapping[str, Sequence[Box6]], frame: LocalFrame) -> list[Mesh]:
    """Return one mesh a material, all called `name`, in world coordinates.

    Boxes without a volume, into which the parts of a tiny element shrink, are left out.
    """
    out = []
    for material, boxes in parts.items():
        solid = [box for box in boxes if all(box[k + 3] - box[k] > 1e-6 for k in range(3))]
        if solid:
            vertices, faces = box_triangles(solid)
            out.append(Mesh(name, frame.world(vertices), faces, material))
    return out


def ring(
    u0: float, v0: float, u1: float, v1: float, width: float, w: tuple[float, float]
) -> list[Box6]:
    """Return four boxes that frame a rectangle from inside, `width` wide, between two depths."""
    back, front = w
    return [
        (u0, v0, back, u0 + width, v1, front),
        (u1 - width, v0, back, u1, v1, front),
        (u0 + width, v0, back, u1 - width, v0 + width, front),
        (u0 + width, v1 - width, back, u1 - width, v1, front),
    ]
