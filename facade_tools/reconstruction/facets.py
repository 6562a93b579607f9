"""Curves of a footprint that are drawn in walls too short for a window."""

from __future__ import annotations

import math

import numpy as np

from ..geometry.arrays import Points2

SHORT = 1.5  # metres: walls below carry no axis of windows
AXIS = 2.5  # metres that a wall of a curve is to have
BEND = math.radians(35.0)  # most between two walls of a curve, that bends one way
FLAT = 0.3  # metres that a corner may lie off the wall that takes its place


def faceted(ring: Points2) -> Points2:
    """Return a ring (n, 2), metres, whose curves of short walls have fewer, wider ones.

    Corners are left out, none is moved, and none that lies further than FLAT off its new wall.

    >>> turn = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    >>> len(faceted(8.0 * np.column_stack([np.cos(turn), np.sin(turn)])))
    16
    """
    count = len(ring)
    steps = np.roll(ring, -1, axis=0) - ring
    lengths = np.hypot(*steps.T)
    before = np.roll(steps, 1, axis=0)
    turns = np.arctan2(
        before[:, 0] * steps[:, 1] - before[:, 1] * steps[:, 0], (before * steps).sum(axis=1)
    )
    short = lengths < SHORT
    inner = short & np.roll(short, 1) & (np.abs(turns) < BEND)
    start = next((k for k in range(count) if not inner[k]), 0)
    kept = [start]
    for k in range(start + 1, start + count):
        corner, last = k % count, kept[-1]
        run = ring[[i % count for i in range(last, k + 2)]]
        way = run[-1] - run[0]
        length = float(np.hypot(*way))
        off = np.abs((run - run[0]) @ np.array([-way[1], way[0]])) / max(length, 1e-9)
        bends = [turns[i % count] for i in range(last + 1, k + 1)]
        one_way = min(bends) > 0 or max(bends) < 0
        if not (inner[corner] and one_way and length < AXIS + SHORT / 2 and off.max() <= FLAT):
            kept.append(k)
    found: Points2 = ring[[k % count for k in kept]]
    return found if len(found) > 3 else ring
