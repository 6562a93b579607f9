"""The compiled z-buffer: triangles to pixels."""

from __future__ import annotations

from math import ceil, floor, isfinite

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers


@compiled
def rasterise(corners: Floats, depth: Floats, owner: Integers) -> None:
    """Draw triangles (m, 3, 3) of pixel x, y and a depth value that is linear on the screen.

    depth (h, w) keeps the largest value, owner (h, w) the index of its triangle. A pixel counts
    when its centre lies inside or on an edge.
    """
    height, width = depth.shape
    for t in range(len(corners)):
        ax, ay, az = corners[t, 0]
        bx, by, bz = corners[t, 1]
        cx, cy, cz = corners[t, 2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0 or not isfinite(area):
            continue
        for j in range(max(0, floor(min(ay, by, cy))), min(height, ceil(max(ay, by, cy)))):
            py = j + 0.5
            for i in range(max(0, floor(min(ax, bx, cx))), min(width, ceil(max(ax, bx, cx)))):
                px = i + 0.5
                wa = ((bx - px) * (cy - py) - (cx - px) * (by - py)) / area
                wb = ((cx - px) * (ay - py) - (ax - px) * (cy - py)) / area
                wc = 1.0 - wa - wb
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                value = wa * az + wb * bz + wc * cz
                if value > depth[j, i]:
                    depth[j, i] = value
                    owner[j, i] = t
