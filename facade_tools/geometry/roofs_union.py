"""The roof of a union of boxes, each with a roof of its own (docs/roofs.md, section 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from facade_tools.artifacts.building import Box, Roof

from .polygons import rings_of, shape_of
from .roofs_box import Sides, box_roof, rectangle_of, sloping_sides
from .roofs_patch import FLAT, Patch, Rectangle
from .roofs_polygon import sloped_patches

SAME = 1e-6  # metres: heights and edges closer than this are equal
FLUSH = 0.3  # metres: a gable nearer than this to a neighbour's wall stands in that wall
RIDGED = ("gable", "hip", "mansard")


@dataclass(frozen=True, slots=True)
class _Wing:
    """One box of the union."""

    id: str
    rectangle: Rectangle
    roof: Roof
    rise: float  # of its roof, were it alone (m)

    @classmethod
    def of(cls, box: Box) -> _Wing:
        rectangle, roof = rectangle_of(box), box.roof or FLAT
        heights = [
            patch.plane[0] * x + patch.plane[1] * y + patch.plane[2]
            for patch in box_roof(rectangle, roof, box.id, 0)
            for x, y in patch.rings[0].tolist()
        ]
        return cls(box.id, rectangle, roof, max(heights) - rectangle.eaves)

    @property
    def shape(self) -> shapely.Polygon:
        return _shape(self.rectangle)


def union_patches(boxes: Sequence[Box]) -> list[Patch]:
    """Return patches whose upper envelope is the roof of the union of the boxes.

    Each box has its roof over its rectangle; a ridged roof runs on into neighbours that are not
    lower, up to their far side, and ends there in a hip. Hips (or mansards) of one pitch at one
    height that touch are one roof over their common outline.
    """
    wings = [_Wing.of(box) for box in boxes]
    spires = [wing for wing in wings if wing.roof.style == "cone"]
    wings = [wing for wing in wings if wing.roof.style != "cone"]
    patches = _ordinary(wings)
    for spire in spires:
        rectangle = _lifted(spire, wings, patches)
        patches += box_roof(rectangle, spire.roof, spire.id, len(patches))
    return patches


def _ordinary(wings: list[_Wing]) -> list[Patch]:
    """Return the patches of all roofs that are no spires."""
    patches: list[Patch] = []
    covered: dict[str, shapely.Geometry] = {}
    for members in _groups(wings):
        outline = shapely.union_all([wing.shape for wing in members], grid_size=SAME)
        covered |= dict.fromkeys((wing.id for wing in members), outline)
        for polygon in shapely.get_parts(outline):
            patches += _common_roof(polygon, members, len(patches))
    for wing in wings:
        for rectangle, sides in _extended(wing, wings):
            if wing.id not in covered or not shapely.covers(covered[wing.id], _shape(rectangle)):
                patches += box_roof(rectangle, wing.roof, wing.id, len(patches), sides)
    return patches


# --- spires ---------------------------------------------------------------------------------------
def _lifted(spire: _Wing, wings: list[_Wing], patches: list[Patch]) -> Rectangle:
    """Return the rectangle of a tower, raised where a roof beside it would swallow its spire.

    Its walls go on up to where that roof stands above the tower's middle; only roofs count whose
    eaves are not higher than the tower's.
    """
    r = spire.rectangle
    x, y = (r.x0 + r.x1) / 2, (r.y0 + r.y1) / 2
    low = {wing.id for wing in wings if wing.rectangle.eaves <= r.eaves + SAME}
    heights = [
        patch.plane[0] * x + patch.plane[1] * y + patch.plane[2]
        for patch in patches
        if patch.owner in low and shapely.intersects_xy(shape_of(patch.rings), x, y)
    ]
    return replace(r, eaves=round(max([r.eaves, *heights]), 6))


def _shape(r: Rectangle) -> shapely.Polygon:
    return shapely.box(r.x0, r.y0, r.x1, r.y1)


# --- common roofs ---------------------------------------------------------------------------------
def _groups(wings: list[_Wing]) -> list[list[_Wing]]:
    """Return sets of at least two touching wings whose hips or mansards are alike."""
    left = [wing for wing in wings if wing.roof.style in ("hip", "mansard")]
    groups = []
    while left:
        group, front = [], [left.pop(0)]
        while front:
            wing = front.pop()
            group.append(wing)
            joined = [other for other in left if _alike(wing, other)]
            left = [other for other in left if other not in joined]
            front += joined
        if len(group) > 1:
            groups.append(group)
    return groups


def _alike(a: _Wing, b: _Wing) -> bool:
    """Whether two wings share an edge or an area and one kind of roof at one height."""
    same = a.roof.style == b.roof.style and abs(a.roof.pitch - b.roof.pitch) <= 1e-9
    if not same or abs(a.rectangle.eaves - b.rectangle.eaves) > SAME:
        return False
    p, q = a.rectangle, b.rectangle
    across = min(p.x1, q.x1) - max(p.x0, q.x0)
    along = min(p.y1, q.y1) - max(p.y0, q.y0)
    return min(across, along) >= -SAME and max(across, along) > SAME


def _common_roof(polygon: shapely.Polygon, members: list[_Wing], group: int) -> list[Patch]:
    rings = rings_of(shapely.simplify(polygon, 0))
    wing = members[0]
    patches = sloped_patches(rings, wing.rectangle.eaves, wing.roof)
    return [replace(patch, owner=_owner(patch, members), group=group) for patch in patches]


def _owner(patch: Patch, members: list[_Wing]) -> str:
    """Return the wing nearest to the middle of the patch's lowest edge."""
    ring = patch.rings[0]
    middles = (ring + np.roll(ring, -1, axis=0)) / 2
    low = middles[int(np.argmin(middles @ np.array(patch.plane[:2])))]
    distances = [float(shapely.distance(wing.shape, shapely.Point(low))) for wing in members]
    return members[int(np.argmin(distances))].id


# --- wings that run into one another --------------------------------------------------------------
def _extended(wing: _Wing, wings: list[_Wing]) -> list[tuple[Rectangle, Sides]]:
    """Return the rectangles over which a wing's roof is laid, and where it slopes there."""
    others = [other for other in wings if other is not wing]
    own = sloping_sides(wing.roof)
    if wing.roof.style == "shed":
        return [(wing.rectangle, _turned(wing, others))]
    hosts = [other for other in others if _carries(other, wing)]
    found = [(wing.rectangle, _hidden_ends(wing, hosts, own))]
    for axis in (0, 1):
        if wing.roof.style in RIDGED and not (wing.roof.style == "gable" and own[2 * axis]):
            low, high = (_reach(wing.rectangle, axis, end, hosts) for end in (0, 1))
            if low or high:
                found.append(_grown(wing, axis, low, high))
    return found


def _carries(host: _Wing, wing: _Wing) -> bool:
    """Whether a wing's roof may run on over (or hidden inside) a neighbour."""
    difference = host.rectangle.eaves - wing.rectangle.eaves
    return difference >= -SAME and (host.roof.style in RIDGED or difference >= wing.rise)


def _hidden_ends(wing: _Wing, hosts: list[_Wing], sides: Sides) -> Sides:
    """Return the slopes of a gable, hipped at ends that vanish in a neighbour's roof that way.

    A gable there would come out of that roof again, like a dormer that nobody asked for.
    """
    if wing.roof.style != "gable":
        return sides
    found = sides
    for end in (k for k in range(4) if not sides[k]):
        patches = box_roof(wing.rectangle, wing.roof, wing.id, 0, _hipped(sides, end))
        slope = patches[-1] if end > 1 else patches[0]
        within = [host for host in hosts if host.roof.style in RIDGED and _inside(wing, end, host)]
        if any(_under(slope, host) for host in within):
            found = _hipped(found, end)
    return found


def _hipped(sides: Sides, end: int) -> Sides:
    left, right, front, back = (slopes or k == end for k, slopes in enumerate(sides))
    return left, right, front, back


def _inside(wing: _Wing, end: int, host: _Wing) -> bool:
    """Whether an end of a wing lies well within a neighbour, not flush with its wall."""
    r, h = wing.rectangle, host.rectangle
    depth = (r.x0 - h.x0, h.x1 - r.x1, r.y0 - h.y0, h.y1 - r.y1)
    return depth[end] > FLUSH


def _under(patch: Patch, host: _Wing) -> bool:
    """Whether a patch lies under a roof that is the lowest of its planes, so that corners tell."""
    ring, r = patch.rings[0], host.rectangle
    inside = (ring >= (r.x0 - SAME, r.y0 - SAME)) & (ring <= (r.x1 + SAME, r.y1 + SAME))
    points = np.column_stack([ring, np.ones(len(ring))])
    planes = np.array([other.plane for other in box_roof(r, host.roof, host.id, 0)])
    surface = (points @ planes.T).min(axis=1)
    return bool(inside.all() and (points @ np.array(patch.plane) <= surface + SAME).all())


def _turned(wing: _Wing, others: list[_Wing]) -> Sides:
    """Return the slope of a shed: away from the wall where only its low side stands at one."""
    left, right, front, back = sloping_sides(wing.roof)
    axis = 0 if left else 1
    walls = [o for o in others if o.rectangle.eaves > wing.rectangle.eaves + SAME]
    if _reach(wing.rectangle, axis, 0, walls) and not _reach(wing.rectangle, axis, 1, walls):
        return right, left, back, front
    return left, right, front, back


def _grown(wing: _Wing, axis: int, low: float, high: float) -> tuple[Rectangle, Sides]:
    """Return the rectangle longer by `low` and `high` (m) along the axis, hipped where it is."""
    r = wing.rectangle
    bounds = [r.x0, r.x1, r.y0, r.y1]
    bounds[2 * axis] -= low
    bounds[2 * axis + 1] += high
    sides = list(sloping_sides(wing.roof))
    sides[2 * axis] |= low > 0
    sides[2 * axis + 1] |= high > 0
    x0, x1, y0, y1 = bounds
    return Rectangle(x0, y0, x1, y1, r.eaves), (sides[0], sides[1], sides[2], sides[3])


def _reach(r: Rectangle, axis: int, end: int, hosts: list[_Wing]) -> float:
    """Return how far (m) the rectangle can grow at one end and stay over the hosts.

    axis: 0 for x, 1 for y; end: 0 for the low side. 0 unless the whole side is carried.
    """
    spans = [(h.rectangle.x0, h.rectangle.x1, h.rectangle.y0, h.rectangle.y1) for h in hosts]
    own = (r.x0, r.x1, r.y0, r.y1)
    sign = 1.0 if end else -1.0
    edge = sign * own[2 * axis + end]
    ahead = []  # across from, across to, along from, along to; along grows away from the edge
    for span in spans:
        along = sorted((sign * span[2 * axis], sign * span[2 * axis + 1]))
        ahead.append((span[2 - 2 * axis], span[3 - 2 * axis], along[0], along[1]))
    limit = edge
    while True:
        strips = [a for a in ahead if a[2] <= limit + SAME and a[3] > limit + SAME]
        if not _covers(strips, own[2 - 2 * axis], own[3 - 2 * axis]):
            return limit - edge
        limit = min(strip[3] for strip in strips)


def _covers(strips: list[tuple[float, float, float, float]], low: float, high: float) -> bool:
    """Whether the strips' extents across cover the interval without a gap."""
    for strip in sorted(strips):
        if strip[0] > low + SAME:
            return False
        low = max(low, strip[1])
    return low >= high - SAME
