"""The compiled z-buffer: triangles to pixels."""

from __future__ import annotations

from math import ceil, floor, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..geometry.arrays import Booleans, Floats, Integers

FLAT = 1e-6  # pixels: an edge that rises less does not narrow a row
SEEN = 128  # opacity, of 255, from which a texel hides what is behind it


class Cutouts(NamedTuple):
    """Pictures with holes on triangles.

    pictures (m, 3): a triangle's first row in `texels`, its picture's height and width. cut (m,):
    whether the picture has holes. uv (m, 3, 2) at corners and their weight (m, 3): the inverse
    depth in perspective, otherwise 1. texels (n, 4): sRGB and opacity.
    """

    cut: Booleans
    pictures: Integers
    uv: Floats
    weight: Floats
    texels: NDArray[np.uint8]


NONE_CUT = Cutouts(
    np.zeros(0, dtype=bool),
    np.zeros((0, 3), dtype=np.int64),
    np.zeros((0, 3, 2)),
    np.zeros((0, 3)),
    np.zeros((0, 4), dtype=np.uint8),
)


@compiled
def rasterise(corners: Floats, depth: Floats, owner: Integers, cutouts: Cutouts) -> None:
    """Draw triangles (m, 3, 3) of pixel x, y and a depth value that is linear on the screen.

    depth (h, w) keeps the largest value, owner (h, w) the index of its triangle; an owner without
    pixels is left alone. A pixel counts when its centre lies inside or on an edge, and not in a
    hole of `cutouts`, which has a row a triangle or none at all.
    """
    height, width = depth.shape
    owned = owner.size > 0
    cut = cutouts.cut
    for t in range(len(corners)):
        ax, ay, az = corners[t, 0]
        bx, by, bz = corners[t, 1]
        cx, cy, cz = corners[t, 2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0 or not isfinite(area):
            continue
        left, right = max(0, floor(min(ax, bx, cx))), min(width, ceil(max(ax, bx, cx)))
        holed = len(cut) > 0 and cut[t]
        for j in range(max(0, floor(min(ay, by, cy))), min(height, ceil(max(ay, by, cy)))):
            py = j + 0.5
            low, high = float(left), float(right)
            low, high = _within(bx, by, cx, cy, py, area, low, high)
            low, high = _within(cx, cy, ax, ay, py, area, low, high)
            low, high = _within(ax, ay, bx, by, py, area, low, high)
            for i in range(int(low), int(high)):
                px = i + 0.5
                wa = ((bx - px) * (cy - py) - (cx - px) * (by - py)) / area
                wb = ((cx - px) * (ay - py) - (ax - px) * (cy - py)) / area
                wc = 1.0 - wa - wb
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                value = wa * az + wb * bz + wc * cz
                if value > depth[j, i] and not (holed and _hole(t, wa, wb, wc, cutouts)):
                    depth[j, i] = value
                    if owned:
                        owner[j, i] = t


@compiled
def _within(
    ax: float, ay: float, bx: float, by: float, y: float, area: float, low: float, high: float
) -> tuple[float, float]:
    """Narrow a row's columns to the inner side of a triangle's edge from a to b, and a pixel more.

    area: of the triangle, twice; its sign tells on which side the inside lies.
    """
    rise = ay - by
    if abs(rise) < FLAT:
        return low, high
    crossing = ax + (bx - ax) * (ay - y) / rise
    if (rise > 0.0) == (area > 0.0):
        return max(low, crossing - 1.5), high
    return low, min(high, crossing + 1.5)


@compiled
def _hole(t: int, wa: float, wb: float, wc: float, cutouts: Cutouts) -> bool:
    """Return whether the picture has a hole at barycentric weights of triangle t."""
    weight, uv = cutouts.weight[t], cutouts.uv[t]
    wa, wb, wc = wa * weight[0], wb * weight[1], wc * weight[2]
    total = wa + wb + wc
    u = (wa * uv[0, 0] + wb * uv[1, 0] + wc * uv[2, 0]) / total
    v = (wa * uv[0, 1] + wb * uv[1, 1] + wc * uv[2, 1]) / total
    first, height, width = cutouts.pictures[t]
    return bool(cutouts.texels[first + texel(u, v, height, width), 3] < SEEN)


@compiled
def texel(u: float, v: float, height: int, width: int) -> int:
    """Return the nearest pixel of a picture that repeats, counted along its rows."""
    column = min(int((u - floor(u)) * width), width - 1)
    row = min(int((1.0 - (v - floor(v))) * height), height - 1)
    return row * width + column
