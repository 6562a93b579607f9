"""Source blocks put onto target blocks: along each axis a map from old places to new ones.

The corners of a block are its correspondences (LNSW13 5.1.2). Between them the maps are linear
until walls are flattened (overhangs) or snapped (vertical edges); storeys are inserted, not
stretched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..artifacts.blocks import Block, Blocks
from ..artifacts.stylesheet import StyleBlock, StyleSheet
from .placed import TOUCH, Knots, Placed, sides_of
from .stacking import (
    ACROSS,
    FLUSH,
    OUTER,
    snapped_onto,
    stacked,
    stands_as_source,
    supported,
    wall_thickness,
)
from .storeys import cells, storeys
from .structure import candidates, match_blocks

FULL = 0.9  # of a block's plan, that a floor under a roof made for the block must fill
LINTEL = 0.2  # m: over niches right under a roof
LEDGE = 0.25  # m: cornices and bases stand at most so far before a wall that is flush


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
    for pair in stacked(placed):
        if not stands_as_source(own, placed[pair[0]], placed[pair[1]]):
            supported(sheet, placed, pair)
    order = sorted(stacked(placed), key=lambda pair: placed[pair[1]].target.z)
    for lower, upper in order:
        if not stands_as_source(own, placed[lower], placed[upper]):
            placed[upper] = snapped_onto(sheet, placed[lower], placed[upper])
    if not flush:
        return placed
    covered = {lower for lower, _ in stacked(placed)}
    filled = [_boxed(sheet, item) for item in placed]
    return [item if k in covered else _closed(item) for k, item in enumerate(filled)]


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
    first, second = (wall_thickness(sheet, source.id, side)[1] for side in ACROSS[axis])
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
    xs, ys = sides_of(placed.target)
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
