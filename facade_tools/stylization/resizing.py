"""Blocks with new sizes: what stands on or beside them moves along."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..artifacts.blocks import Block, Blocks
from ..errors import InvalidInput
from ..geometry.arrays import Floats

TOUCH = 1e-6  # m


def resized(blocks: Blocks, sizes: Mapping[str, tuple[float, float, float]]) -> Blocks:
    """Return blocks with some given new width, depth and height (m).

    What stands on a block that changes keeps its place on it, as shares of its width and depth;
    what stands beside it to the right or behind moves by what it grows. Raises InvalidInput for
    an unknown block.
    """
    known = {block.id for block in blocks.blocks}
    if unknown := set(sizes) - known:
        raise InvalidInput(f"no block {min(unknown)!r}; expected one of {', '.join(sorted(known))}")
    done: dict[str, Block] = {}
    for block in sorted(blocks.blocks, key=lambda b: (b.z, b.x, b.y)):
        size = sizes.get(block.id, (block.width, block.depth, block.height))
        place = _place(block, size, blocks.blocks, done)
        x, y, z = place
        width, depth, height = size
        done[block.id] = replace(block, x=x, y=y, z=z, width=width, depth=depth, height=height)
    return replace(blocks, blocks=tuple(done[block.id] for block in blocks.blocks))


def _place(
    block: Block, size: Sequence[float], blocks: Sequence[Block], done: Mapping[str, Block]
) -> list[float]:
    """Return the new corner of a block, after those below and before it are placed."""
    own = _box(block)
    below = [b for b in blocks if b.id in done and abs(b.z + b.height - block.z) < 1e-3]
    below = [b for b in below if _meet(_box(b), own, (0, 1))]
    corner: list[float] = own[0].tolist()
    for axis in (0, 1):
        if below:  # the widest carries it
            old = _box(max(below, key=lambda b: b.width * b.depth))
            new = _box(done[max(below, key=lambda b: b.width * b.depth).id])
            share = (own[:, axis].mean() - old[0, axis]) / np.ptp(old[:, axis])
            corner[axis] = new[0, axis] + share * np.ptp(new[:, axis]) - 0.5 * size[axis]
            continue
        before = [
            b
            for b in blocks
            if b.id in done
            and _box(b)[1, axis] <= own[0, axis] + 1e-3
            and _meet(_box(b), own, (1 - axis, 2))
        ]
        grown = [_box(done[b.id])[1, axis] - _box(b)[1, axis] for b in before]
        corner[axis] += max(grown, key=abs, default=0.0)
    if below:
        corner[2] = max(_box(done[b.id])[1, 2] for b in below)
    return corner


def _box(block: Block) -> Floats:
    low = np.array([block.x, block.y, block.z])
    return np.array([low, low + np.array([block.width, block.depth, block.height])])


def _meet(a: Floats, b: Floats, axes: tuple[int, int]) -> bool:
    return all(min(a[1, k], b[1, k]) - max(a[0, k], b[0, k]) > TOUCH for k in axes)
