"""What stands in the way of windows: roofs of lower boxes, porch roofs and porch posts.

All rectangles lie in a facade piece's frame: u to the right as seen from outside, v up, metres.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..artifacts.building import Box, Building, Piece, Side
from .arrays import Floats, Points2, Rectangles
from .boxes import box_rectangles
from .floors import mass_boxes
from .polygons import shape_of
from .roofs_patch import Plane
from .roofs_union import union_patches

POST_SPACING = 3.6  # longest free span between two posts of a porch (m)
POST_INSET = 0.1  # from the porch's edge to the middle of a post (m)
POST_HALF = 0.1  # half a post's thickness with a little air (m)
STRIP = 0.25  # a sloping roof line is covered by strips of at most this width (m)
OUTSIDE = 0.02  # how far in front of the wall the roofs are cut (m)
UNDER = 0.12  # thickness of a roof below its eaves (m)
OVER = 0.05  # air above a roof (m)
SLAB = 0.15  # thickness of the slab on a roof that runs into the wall (m)
BESIDE = 1e-3  # roofs are cut this far within a strip: at its ends a neighbour may begin (m)
NEAR = 1e-6


@dataclass(frozen=True, slots=True)
class Wall:
    """The line of a piece in plan: start and unit direction along u, unit normal outwards."""

    start: tuple[float, float]
    along: tuple[float, float]
    outwards: tuple[float, float]


_DIRECTIONS: dict[Side, tuple[tuple[float, float], tuple[float, float]]] = {
    "front": ((1.0, 0.0), (0.0, -1.0)),
    "back": ((-1.0, 0.0), (0.0, 1.0)),
    "left": ((0.0, -1.0), (-1.0, 0.0)),
    "right": ((0.0, 1.0), (1.0, 0.0)),
}


def wall_of(side: Side, piece: Piece) -> Wall:
    """Return the plan line of a piece of `side`."""
    along, outwards = _DIRECTIONS[side]
    return Wall((piece.origin[0], piece.origin[1]), along, outwards)


@dataclass(frozen=True, slots=True)
class BuiltRoof:
    """The planes of the roof of a mass, z = a·x + b·y + c, and what each lies over, prepared."""

    shapes: tuple[shapely.Polygon, ...]
    planes: tuple[Plane, ...]

    @classmethod
    def of(cls, building: Building) -> BuiltRoof:
        """Return the roof over the general and garage boxes of a building."""
        patches = union_patches(mass_boxes(building))
        shapes = [shape_of(patch.rings) for patch in patches]
        shapely.prepare(shapes)
        return cls(tuple(shapes), tuple(patch.plane for patch in patches))

    def heights(self, points: Points2) -> Floats:
        """Return the height (m) over plan points (n, 2); −inf beside the mass."""
        heights = np.full(len(points), -np.inf)
        for shape, (a, b, c) in zip(self.shapes, self.planes, strict=True):
            over = shapely.intersects_xy(shape, points[:, 0], points[:, 1])
            if over.any():
                np.maximum(heights, points @ np.array([a, b]) + c, out=heights, where=over)
        return heights


def blocked_walls(
    building: Building, pieces: Mapping[Side, Iterable[Piece]]
) -> dict[str, Rectangles]:
    """Return by piece id the parts of all walls where no element may be: `blocked_rectangles`."""
    roof = BuiltRoof.of(building)
    return {
        piece.id: blocked_rectangles(building, roof, side, piece)
        for side, row in pieces.items()
        for piece in row
    }


def porch_roofs(building: Building, side: Side, piece: Piece) -> Rectangles:
    """Return what the roofs of porches hide of a piece (n, 4): u0, v0, u1, v1, metres."""
    wall = wall_of(side, piece)
    porches = [box for box in building.boxes if box.kind == "porch"]
    rows = [row for porch in porches for row in _roof_strips(porch, wall, piece)]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def blocked_rectangles(building: Building, roof: BuiltRoof, side: Side, piece: Piece) -> Rectangles:
    """Return the parts (n, 4) of a piece where no element may be: u0, v0, u1, v1, metres.

    Roofs of other boxes that meet the wall (a sloping line as strips), porch roofs, and the wall
    right behind a porch post. A roof that runs on into the wall's box counts as it is built:
    `roof` is that of the building, made once for all its walls. Rectangles may stick out of the
    piece, and overlap.
    """
    wall = wall_of(side, piece)
    rows = [row for box in building.boxes for row in _roof_strips(box, wall, piece)]
    rows += _buried_strips(roof, wall, piece, rows)
    porches = [box for box in building.boxes if box.kind == "porch"]
    rows += [row for porch in porches for row in _post_strips(building, porch, wall, piece)]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def porch_strips(building: Building, porch: Box, side: Side, piece: Piece) -> Rectangles:
    """Return the parts (n, 4) of a piece behind the posts and the roof of a porch: u0, v0, u1, v1.

    >>> from facade_tools.artifacts.building import Roof
    >>> house = Box("h", "general", 5, 4, 10, 8, 3)
    >>> porch = Box("p", "porch", 5, -1, 4, 2, 2.5, Roof("flat"))
    >>> wall = Piece("front-1", "h", (0, 0, 0), 10, 3)
    >>> posts = porch_strips(Building("b", (house, porch)), porch, "front", wall)[-2:]
    >>> posts.round(1).tolist()
    [[5.5, 0.0, 5.7, 2.5], [6.8, 0.0, 7.0, 2.5]]
    """
    wall = wall_of(side, piece)
    rows = [*_roof_strips(porch, wall, piece), *_post_strips(building, porch, wall, piece)]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def roof_height(box: Box, points: Points2) -> Floats:
    """Return the height (m) of a box's roof over plan points (n, 2); NaN beyond its overhang.

    Cones are taken as pyramids and mansards as hips of at least 60°: never lower than built.
    """
    roof, eaves = box.roof, box.height or 0.0
    if roof is None:
        return np.full(len(points), np.nan)
    dx = box.width / 2 - np.abs(points[:, 0] - box.x)
    dy = box.depth / 2 - np.abs(points[:, 1] - box.y)
    slope = float(np.tan(np.radians(max(roof.pitch, 60.0 if roof.style == "mansard" else 0.0))))
    if roof.style == "flat":
        rise = np.zeros(len(points))
    elif roof.style == "gable":
        rise = slope * (dy if roof.direction == "x" else dx)
    elif roof.style == "shed":
        rise = slope * (points - [box.x - box.width / 2, box.y - box.depth / 2]) @ _axis(box)
    else:
        rise = slope * np.minimum(dx, dy)
    inside = np.minimum(dx, dy) >= -roof.overhang - NEAR
    return np.where(inside, eaves + rise, np.nan)


def _axis(box: Box) -> Floats:
    falls_along_y = box.roof is not None and box.roof.direction == "y"
    return np.array([0.0, 1.0] if falls_along_y else [1.0, 0.0])


def _roof_strips(box: Box, wall: Wall, piece: Piece) -> Iterator[tuple[float, ...]]:
    """Yield the strips of a piece that the roof of `box` covers."""
    bottom, top = piece.origin[2], piece.origin[2] + piece.height
    if box.roof is None or box.height is None or box.height >= top - NEAR:
        return
    # A mass well below the wall reaches it with its roof only, which is cut as it is built.
    if box.kind != "porch" and box.height <= bottom - 1.0:
        return
    if not _line_meets(box, wall, piece):
        return
    count = max(int(np.ceil(piece.width / STRIP)), 1)
    us = np.linspace(0.0, piece.width, 2 * count + 1)
    at = np.array(wall.start) + OUTSIDE * np.array(wall.outwards)
    heights = roof_height(box, at + us[:, None] * np.array(wall.along))
    points = np.stack([heights[:-1:2], heights[1::2], heights[2::2]])  # (3, count)
    highs = np.fmax.reduce(points) + OVER  # NaN, above nothing, where all three are off the roof
    lows = np.fmin(np.fmin.reduce(points), box.height) - UNDER
    for k in np.flatnonzero((highs > bottom) & (lows < top)):
        yield us[2 * k], lows[k] - bottom, us[2 * k + 2], highs[k] - bottom


def _buried_strips(
    roof: BuiltRoof, wall: Wall, piece: Piece, known: Sequence[tuple[float, ...]]
) -> Iterator[tuple[float, ...]]:
    """Yield strips of a piece, from its bottom, that lie inside the roofs of the mass.

    Only those that stand out of the `known` ones: a roof's own rectangle tells nothing of where
    it runs on into the wall as a ridge.
    """
    count = max(int(np.ceil(piece.width / STRIP)), 1)
    edges = np.linspace(0.0, piece.width, count + 1)
    beside = min(BESIDE, piece.width / count / 4)
    cuts = np.stack([edges[:-1] + beside, (edges[:-1] + edges[1:]) / 2, edges[1:] - beside], 1)
    at = np.array(wall.start) + OUTSIDE * np.array(wall.outwards)
    points = at + cuts.reshape(-1, 1) * np.array(wall.along)
    highs = roof.heights(points).reshape(-1, 3).max(axis=1) - piece.origin[2]
    for left, right, high in zip(edges[:-1], edges[1:], highs.tolist(), strict=True):
        if high > NEAR and not any(
            u0 <= left + NEAR and right <= u1 + NEAR and v0 <= 0.0 and v1 >= high + OVER - BESIDE
            for u0, v0, u1, v1 in known
        ):
            yield left, -UNDER, right, high + SLAB + OVER


def _line_meets(box: Box, wall: Wall, piece: Piece) -> bool:
    """Tell whether a piece's line, just outside, passes under or over the roof's plan."""
    overhang = 0.0 if box.roof is None else box.roof.overhang
    ends = np.array([wall.start, wall.start]) + OUTSIDE * np.array(wall.outwards)
    ends[1] += piece.width * np.array(wall.along)
    low, high = ends.min(axis=0), ends.max(axis=0)
    reach = np.array([box.width / 2 + overhang, box.depth / 2 + overhang])
    centre = np.array([box.x, box.y])
    return bool((low < centre + reach).all() and (high > centre - reach).all())


def porch_posts(building: Building, porch: Box) -> Points2:
    """Return the plan centres (n, 2) of a porch's posts, metres.

    Posts stand at its corners and at most 3.6 m apart along its edges (an odd number of bays, so
    that the middle is free), wherever that is at least 0.3 m clear of the mass.
    """
    x0, y0, x1, y1 = box_rectangles([porch])[0]
    xs = _spread(x0 + POST_INSET, x1 - POST_INSET)
    ys = _spread(y0 + POST_INSET, y1 - POST_INSET)
    rim = [(x, y) for x in xs for y in ys if x in (xs[0], xs[-1]) or y in (ys[0], ys[-1])]
    solid = box_rectangles(mass_boxes(building))
    return np.array([p for p in rim if _clear(p, solid, 0.3)], dtype=np.float64).reshape(-1, 2)


def _spread(low: float, high: float) -> list[float]:
    count = max(int(np.ceil((high - low) / POST_SPACING - NEAR)), 1)
    count += 1 - count % 2
    return [float(value) for value in np.linspace(low, max(high, low), count + 1)]


def _clear(point: tuple[float, float], solid: Rectangles, distance: float) -> bool:
    x, y = point
    gap_x = np.maximum(solid[:, 0] - x, x - solid[:, 2])
    gap_y = np.maximum(solid[:, 1] - y, y - solid[:, 3])
    return bool((np.maximum(gap_x, gap_y) >= distance).all())


def _post_strips(
    building: Building, porch: Box, wall: Wall, piece: Piece
) -> Iterator[tuple[float, ...]]:
    """Yield the strips of a piece right behind the posts of a porch that touches its wall."""
    eaves, bottom = porch.height or 0.0, piece.origin[2]
    if bottom >= eaves - NEAR or not _line_meets(porch, wall, piece):
        return
    for u, out in _in_frame(porch_posts(building, porch), wall):
        reach = abs(wall.outwards[0]) * porch.width + abs(wall.outwards[1]) * porch.depth
        if 0 < out <= reach and -POST_HALF < u < piece.width + POST_HALF:
            yield u - POST_HALF, -bottom, u + POST_HALF, eaves - bottom


def _in_frame(points: Points2, wall: Wall) -> Iterable[tuple[float, float]]:
    offsets = points - np.array(wall.start)
    along, out = offsets @ np.array(wall.along), offsets @ np.array(wall.outwards)
    return [(float(u), float(d)) for u, d in zip(along, out, strict=True)]
