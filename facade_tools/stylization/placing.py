"""Source blocks put onto target blocks: along each axis a map from old places to new ones.

The corners of a block are its correspondences (LNSW13 5.1.2). Between them the maps are linear
until walls are flattened (overhangs) or snapped (vertical edges); storeys are inserted, not
stretched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..artifacts.blocks import Block, Blocks
from ..artifacts.stylesheet import StyleBlock, StyleFace, StyleSheet
from ..geometry.arrays import Floats
from .remesh import Slab, on_grid, trimmed
from .snapping import snapped, unsqueezed
from .storeys import Storey, cells, storeys
from .structure import candidates, match_blocks

TOUCH = 1e-6  # m
SUPPORT = 0.9  # of the distance of the outer boundaries: thickness of a wall under an overhang
FLUSH = 0.05  # m: walls nearer than that stand in one plane, and thinning would take all relief
OUTER = 0.25  # of a block, in which its walls stand
FULL = 0.9  # of a block's plan, that a floor under a roof made for the block must fill
LINTEL = 0.2  # m: over niches right under a roof
LEDGE = 0.25  # m: cornices and bases stand at most so far before a wall that is flush
ACROSS = (("left", "right"), ("front", "back"))  # the sides where the axes x and y begin and end
Knots = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True)
class Placed:
    """A source block on a target block.

    maps: for x and y, places in the source block (m) and where they go (m, absolute).
    """

    target: Block
    source: StyleBlock
    storeys: tuple[Storey, ...]
    maps: tuple[Knots, Knots]

    def moved(self, axis: int, places: Floats) -> Floats:
        """Return where places (m) of the source block go along an axis (0 x, 1 y)."""
        old, new = self.maps[axis]
        inside: Floats = np.interp(places, old, new)
        return inside


def matched_blocks(sheet: StyleSheet, own: Blocks, target: Blocks) -> list[str]:
    """Return the id of the source block of least Ψ for every target block (eq. 6, 7)."""
    sources = {block.id for block in sheet.blocks}
    known = [block for block in own.blocks if block.id in sources]
    chosen = match_blocks(candidates(known), candidates(target.blocks))
    return [known[index].id for index in chosen]


def outset_blocks(sheet: StyleSheet, target: Blocks, chosen: Sequence[str]) -> Blocks:
    """Return the target's blocks as wide and deep as sources whose walls stand flush with them.

    chosen: ids of the source blocks. What stands before the plane of most wall comes on top.
    """
    sources = {block.id: block for block in sheet.blocks}
    blocks = []
    for block, name in zip(target.blocks, chosen, strict=True):
        x, y = (sum(_planes(sheet, sources[name], axis)) for axis in (0, 1))
        blocks.append(replace(block, width=block.width + x, depth=block.depth + y))
    return replace(target, blocks=tuple(blocks))


def placed_blocks(
    sheet: StyleSheet,
    own: Blocks,
    target: Blocks,
    chosen: Sequence[str] | None = None,
    *,
    flush: bool = False,
) -> list[Placed]:
    """Return the source block of every target block, mapped to its corners.

    chosen: ids of the source blocks, if they are not those of least Ψ. flush: the plane of most
    wall stands on each side of a block, what stands before it at most LEDGE outside, and floors
    that would leave much of the block open fill it. From the ground up, walls under overhangs are
    thinned and edges snapped to the blocks below as far as nothing between them is squeezed or
    widened (5.1.2, 5.2.1), unless the two source blocks stand on each other like that themselves.
    """
    sources = {block.id: block for block in sheet.blocks}
    ids = matched_blocks(sheet, own, target) if chosen is None else chosen
    placed = [
        _stretched(sheet, sources[name], block)
        for block, name in zip(target.blocks, ids, strict=True)
    ]
    placed = [_flush(sheet, item) for item in placed] if flush else placed
    for pair in _stacked(placed):
        if not _native(own, placed[pair[0]], placed[pair[1]]):
            _supported(sheet, placed, pair)
    order = sorted(_stacked(placed), key=lambda pair: placed[pair[1]].target.z)
    for lower, upper in order:
        if not _native(own, placed[lower], placed[upper]):
            placed[upper] = _snapped(sheet, placed[lower], placed[upper])
    if not flush:
        return placed
    covered = {lower for lower, _ in _stacked(placed)}
    filled = [_boxed(sheet, item) for item in placed]
    return [item if k in covered else _closed(item) for k, item in enumerate(filled)]


def foreign_blocks(own: Blocks, placed: Sequence[Placed]) -> list[int]:
    """Return the placed blocks that stand on others unlike their sources do."""
    return [j for i, j in _stacked(placed) if not _native(own, placed[i], placed[j])]


def placed_slabs(sheet: StyleSheet, placed: Placed) -> list[Slab]:
    """Return the plans of a placed block's storeys, in the target's coordinates."""
    slabs = []
    for storey in placed.storeys:
        floor = sheet.floors[storey.floor]
        xs, ys = (placed.moved(a, np.array(v)) for a, v in enumerate((floor.xs, floor.ys)))
        plan = _without_nothing(Slab(storey.bottom, storey.top, xs, ys, cells(floor)))
        if storey.boxed:
            sides = _sides(placed.target)
            plan = Slab(storey.bottom, storey.top, *sides, np.ones((1, 1), dtype=bool))
        if not plan.cells.any():
            continue
        closed = _with_box(plan, *_sides(placed.target)) if storey.lintel else plan
        if closed.area > plan.area + TOUCH:
            foot = storey.top - storey.lintel
            slabs.append(replace(plan, top=foot))
            plan = replace(closed, bottom=foot)
        slabs.append(plan)
    return slabs


def _with_box(plan: Slab, xs: Floats, ys: Floats) -> Slab:
    """Return a plan with a box (its ends along x and y) added to it."""
    lines, rows = np.union1d(plan.xs, xs), np.union1d(plan.ys, ys)
    x, y = (0.5 * (v[1:] + v[:-1]) for v in (lines, rows))
    inside = ((y > ys[0]) & (y < ys[-1]))[:, None] & ((x > xs[0]) & (x < xs[-1]))
    whole = Slab(plan.bottom, plan.top, lines, rows, on_grid(plan, lines, rows) | inside)
    return _without_nothing(whole)


def _sides(block: Block) -> tuple[Floats, Floats]:
    """Return where a block begins and ends along x and y (m)."""
    xs, ys = (block.x, block.x + block.width), (block.y, block.y + block.depth)
    return np.array(xs), np.array(ys)


def _without_nothing(slab: Slab) -> Slab:
    """Drop rows and columns that are squeezed to nothing."""
    columns, rows = np.diff(slab.xs) > TOUCH, np.diff(slab.ys) > TOUCH
    xs = np.append(slab.xs[:-1][columns], slab.xs[-1])
    ys = np.append(slab.ys[:-1][rows], slab.ys[-1])
    return trimmed(replace(slab, xs=xs, ys=ys, cells=slab.cells[np.ix_(rows, columns)]))


def _stretched(sheet: StyleSheet, source: StyleBlock, block: Block) -> Placed:
    maps = (
        _kept_relief(sheet, source, 0, block.x, block.width),
        _kept_relief(sheet, source, 1, block.y, block.depth),
    )
    return Placed(block, source, storeys(sheet, source, block), maps)


def _kept_relief(
    sheet: StyleSheet, source: StyleBlock, axis: int, low: float, length: float
) -> Knots:
    """Return the map from a source block to a stretch of an axis that it may have to fill.

    Where it grows, what stands before and behind its walls is as deep as in the source. What is
    deeper than the outer quarter of the block is a court or a wing, no wall.
    """
    size = source.size[axis]
    first, second = (_thickness(sheet, source.id, side)[1] for side in ACROSS[axis])
    knots = [(0.0, low)]
    if length > size:
        knots += [(first, low + first)] * (TOUCH < first <= OUTER * size)
        knots += [(size - second, low + length - second)] * (TOUCH < second <= OUTER * size)
    knots.append((size, low + length))
    return np.array([old for old, _ in knots]), np.array([new for _, new in knots])


def _flush(sheet: StyleSheet, placed: Placed) -> Placed:
    """Bring the planes of most wall to the sides of the target's block."""
    maps = []
    for axis in (0, 1):
        size = placed.source.size[axis]
        low, high = _planes(sheet, placed.source, axis)
        old, new = placed.maps[axis]
        start, end = float(new[0]), float(new[-1])
        relief = [k for k in old[1:-1].tolist() if low + TOUCH < k < size - high - TOUCH]
        kept = [(k, start + k - low if k < size / 2 else end - size + high + k) for k in relief]
        knots = [(low, start), *kept, (size - high, end)]
        knots = [(0.0, start - min(low, LEDGE))] * (low > TOUCH) + knots
        knots += [(size, end + min(high, LEDGE))] * (high > TOUCH)
        maps.append((np.array([k for k, _ in knots]), np.array([v for _, v in knots])))
    return replace(placed, maps=(maps[0], maps[1]))


def _boxed(sheet: StyleSheet, placed: Placed) -> Placed:
    """Let floors that fill less than FULL of their block fill all of it."""
    xs, ys = _sides(placed.target)
    least = FULL * float(np.ptp(xs) * np.ptp(ys))
    found = []
    for storey in placed.storeys:
        floor = sheet.floors[storey.floor]
        widths, depths = (
            np.diff(np.clip(placed.moved(axis, np.array(lines)), sides[0], sides[1]))
            for axis, (lines, sides) in enumerate(((floor.xs, xs), (floor.ys, ys)))
        )
        found.append(replace(storey, boxed=bool(depths @ cells(floor) @ widths < least)))
    return replace(placed, storeys=tuple(found))


def _closed(placed: Placed) -> Placed:
    """Close niches of the highest storey below its top."""
    *rest, last = placed.storeys
    if last.boxed or last.top - last.bottom < 2 * LINTEL:
        return placed
    return replace(placed, storeys=(*rest, replace(last, lintel=LINTEL)))


def _planes(sheet: StyleSheet, source: StyleBlock, axis: int) -> tuple[float, float]:
    """Return how far inside a block's two sides across an axis most of their wall stands (m)."""
    size = source.size[axis]
    low, high = (_main_plane(sheet, source.id, side, size) for side in ACROSS[axis])
    return low, high


def _main_plane(sheet: StyleSheet, block: str, side: str, size: float) -> float:
    """Return how far inside a block's side (m) most of its wall stands, within FLUSH.

    It is looked for in the outer quarter of the block; a wall that is all further in stays there.
    """
    wall = next(w for w in sheet.walls if w.block == block and w.side == side)
    depths = np.array(
        [f.place if side in ("left", "front") else size - f.place for f in wall.faces]
    )
    areas = np.array([abs(f.end - f.start) * (f.top - f.bottom) for f in wall.faces])
    near = depths < OUTER * size
    if not near.any():
        return 0.0
    depths, areas = depths[near], areas[near]
    shares = (np.abs(depths[:, None] - depths) < FLUSH) @ areas
    return float(max(0.0, depths[int(np.argmax(shares))]))


# --- stacks ---------------------------------------------------------------------------------------
def _stacked(placed: Sequence[Placed]) -> list[tuple[int, int]]:
    """Return the pairs (lower, upper) of blocks that stand on each other."""
    pairs = []
    for i, lower in enumerate(placed):
        for j, upper in enumerate(placed):
            a, b = lower.target, upper.target
            if abs(a.z + a.height - b.z) < 1e-3 and _overlap(a, b):
                pairs.append((i, j))
    return pairs


def _overlap(a: Block, b: Block) -> bool:
    return (
        min(a.x + a.width, b.x + b.width) - max(a.x, b.x) > TOUCH
        and min(a.y + a.depth, b.y + b.depth) - max(a.y, b.y) > TOUCH
    )


def _native(own: Blocks, lower: Placed, upper: Placed) -> bool:
    """Tell whether two blocks stand on each other as their sources do, up to scale."""
    sources = {block.id: block for block in own.blocks}
    a, b = sources[lower.source.id], sources[upper.source.id]
    if abs(a.z + a.height - b.z) > 1e-3 * max(a.height, b.height) or not _overlap(a, b):
        return False
    return all(
        np.allclose(_relation(lower.target, upper.target, k), _relation(a, b, k), atol=1e-3)
        for k in (0, 1)
    )


def _relation(lower: Block, upper: Block, axis: int) -> tuple[float, float]:
    """Return where an upper block begins and ends along an axis, as shares of the lower one."""
    start, size = (lower.x, lower.width) if axis == 0 else (lower.y, lower.depth)
    low, length = (upper.x, upper.width) if axis == 0 else (upper.y, upper.depth)
    return (low - start) / size, (low + length - start) / size


def _supported(sheet: StyleSheet, placed: list[Placed], pair: tuple[int, int]) -> None:
    """Thin the lower block's walls where the upper one would reach over them (Fig. 11)."""
    lower, upper = placed[pair[0]], placed[pair[1]]
    reaching = _overhanging(sheet, lower, upper)
    maps = []
    for axis, sides in enumerate(ACROSS):
        old, new = lower.maps[axis]
        size = float(old[-1])
        thickness = [_thickness(sheet, lower.source.id, side) for side in sides]
        ends = [_outer(sheet, upper, axis, side) for side in sides]
        low = _thinned(lower, axis, thickness[0], ends[0]) if sides[0] in reaching else []
        inside = (size - thickness[1][0], size - thickness[1][1])
        high = _thinned(lower, axis, inside, ends[1]) if sides[1] in reaching else []
        knots = [*low, *high[::-1]]
        places = [place for place, _ in knots]
        ordered = all(a < b for a, b in pairwise(places))
        if knots and ordered and places[0] > 0 and places[-1] < size:
            old = np.array([old[0], *places, old[-1]])
            new = np.array([new[0], *(value for _, value in knots), new[-1]])
        maps.append((old, np.maximum.accumulate(new)))
    placed[pair[0]] = replace(lower, maps=(maps[0], maps[1]))


def _overhanging(sheet: StyleSheet, lower: Placed, upper: Placed) -> set[str]:
    """Return the sides on which an upper block stands over what the floor below it leaves open."""
    below, above = placed_slabs(sheet, lower), placed_slabs(sheet, upper)
    if not below or not above:
        return set()
    lines = (below[-1].xs, above[0].xs), (below[-1].ys, above[0].ys)
    xs, ys = (
        np.unique(np.clip(np.union1d(*pair), *sides))
        for pair, sides in zip(lines, _sides(lower.target), strict=True)
    )
    filled, over = on_grid(below[-1], xs, ys), on_grid(above[0], xs, ys)
    least = FLUSH * max(lower.target.width, lower.target.depth)
    found = set()
    for side, axis, step in (("left", 1, 1), ("right", 1, -1), ("front", 0, 1), ("back", 0, -1)):
        # seen from the side, before the lower floor's wall
        order = np.s_[::step, :] if axis == 0 else np.s_[:, ::step]
        before = ~np.logical_or.accumulate(filled[order], axis=axis)[order]
        if float(np.diff(ys) @ (over & before) @ np.diff(xs)) > least:
            found.add(side)
    return found


def _thickness(sheet: StyleSheet, block: str, side: str) -> tuple[float, float]:
    wall = next(w for w in sheet.walls if w.block == block and w.side == side)
    return wall.thickness.outer, wall.thickness.inner


def _outer(sheet: StyleSheet, upper: Placed, axis: int, side: str) -> float:
    """Return where the upper block's outer boundary on a side is (m, absolute)."""
    outer = _thickness(sheet, upper.source.id, side)[0]
    size = upper.source.size[axis]
    place = outer if side in ("left", "front") else size - outer
    return float(upper.moved(axis, np.array([place]))[0])


def _thinned(
    lower: Placed, axis: int, bounds: tuple[float, float], reach: float
) -> list[tuple[float, float]]:
    """Return knots of a wall's inner boundary where the upper wall lies within its thickness.

    What is deeper than the outer quarter of the block is a court or a wing, no wall.
    """
    if abs(bounds[1] - bounds[0]) > OUTER * float(lower.maps[axis][0][-1]):
        return []
    outer, inner = lower.moved(axis, np.array(bounds)).tolist()
    distance = reach - outer if bounds[1] > bounds[0] else outer - reach
    thickness = abs(inner - outer)
    if not FLUSH < distance < thickness:
        return []
    sign = 1.0 if bounds[1] > bounds[0] else -1.0
    knots = [(bounds[0], outer), (bounds[1], outer + sign * SUPPORT * distance)]
    return [knot for knot in knots if 0 < knot[0] < float(lower.maps[axis][0][-1])]


def _snapped(sheet: StyleSheet, lower: Placed, upper: Placed) -> Placed:
    """Snap the vertical edges of an upper block to those of the block below, view by view."""
    below, above = placed_slabs(sheet, lower), placed_slabs(sheet, upper)
    if not below or not above:
        return upper
    maps = []
    for axis in (0, 1):
        old, new = upper.maps[axis]
        places = _edges(sheet, upper, axis)
        start, end = float(new[0]), float(new[-1])
        goal = below[-1].xs if axis == 0 else below[-1].ys
        goal = goal[(goal > start + TOUCH) & (goal < end - TOUCH)]
        stood = upper.moved(axis, places)
        moved = unsqueezed(stood, snapped(stood, goal, end - start), (start, end))
        maps.append(
            (
                np.concatenate([old[:1], places, old[-1:]]),
                np.concatenate([new[:1], moved, new[-1:]]),
            )
        )
    return replace(upper, maps=(maps[0], maps[1]))


def _edges(sheet: StyleSheet, placed: Placed, axis: int) -> Floats:
    """Return all places of a block's vertical edges strictly between its ends (m, source)."""
    lines = [
        floor.xs if axis == 0 else floor.ys
        for floor in sheet.floors
        if floor.block == placed.source.id
    ]
    places = np.unique(np.concatenate([np.array(line) for line in lines]))
    size = placed.source.size[axis]
    return np.asarray(places[(places > TOUCH) & (places < size - TOUCH)])


def face_corners(placed: Placed, storey: Storey, face: StyleFace, side: str) -> Floats:
    """Return the corners (4, 3) of a face in the target: lower left, lower right, upper ones.

    On a storey that fills its block a face is the whole side.
    """
    axis = 0 if side in ("front", "back") else 1
    corners = np.empty((4, 3))
    if storey.boxed:
        sides = _sides(placed.target)
        start, end = sides[axis].tolist()[:: 1 if side in ("front", "right") else -1]
        place = sides[1 - axis][0 if side in ("front", "left") else 1]
    else:
        start, end = placed.moved(axis, np.array([face.start, face.end])).tolist()
        place = placed.moved(1 - axis, np.array([face.place]))[0]
    corners[:, axis] = [start, end, end, start]
    corners[:, 1 - axis] = place
    corners[:, 2] = [storey.bottom, storey.bottom, storey.top, storey.top]
    return corners
