"""Repeating surface patterns (boards, shingles, bricks): their sizes and texture coordinates."""

from __future__ import annotations

import numpy as np

from .arrays import Floats, Points2, Points3

# Pattern -> width and height of one tile (m); tiles across and up of what repeats seamlessly.
TILES: dict[str, tuple[float, float]] = {
    "siding": (1.36, 0.17),
    "shingle": (0.33, 0.26),
    "brick": (0.26, 0.085),
}
REPEAT = {"siding": (1, 4), "shingle": (8, 8), "brick": (8, 8)}


def period(pattern: str) -> tuple[float, float]:
    """Return width and height (m) after which a pattern repeats."""
    (width, height), (across, up) = TILES[pattern], REPEAT[pattern]
    return width * across, height * up


def pattern_uv(pattern: str, points: Points3, normal: Floats) -> Points2:
    """Return texture coordinates (n, 2) of points on a plane: u level, v up the plane."""
    slope = float(np.hypot(normal[0], normal[1]))
    if slope < 0.05:
        metres = points[:, :2]
    else:
        across = np.array([-normal[1], normal[0]]) / slope
        metres = np.column_stack([points[:, :2] @ across, points[:, 2] / slope])
    return np.asarray(metres / np.array(period(pattern)))
