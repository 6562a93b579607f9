"""Line segments of a picture and the two vanishing points that most of them meet."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from .image_io import Picture, fitted
from .line_segments import Segments, line_segments

Vector = NDArray[np.float64]  # (3,) homogeneous

WORKING = 1000  # pixels of height at which segments are looked for
SHORTEST = 0.03  # of the working picture's shorter side
TRIES = 400  # pairs of segments
NEAR = np.sin(np.radians(2.0))  # angle between a segment and its vanishing point
STEEP = np.radians(40.0)  # how far the two families may lean
MOST_SEGMENTS = 2000
ENOUGH = 10  # segments of a family


def segments_of(picture: Picture) -> Segments:
    """Return the line segments of a picture in its pixels, longest first."""
    small = fitted(picture, WORKING, WORKING * WORKING)
    scale = picture.shape[0] / small.shape[0]
    grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.uint8)
    shortest = max(8.0, SHORTEST * min(small.shape[:2]))
    lines = (line_segments(grey, int(shortest)) + 0.5) * scale
    order = np.argsort(-_lengths(lines), kind="stable")
    longest: Segments = lines[order[:MOST_SEGMENTS]]
    return longest


def _lengths(lines: Segments) -> NDArray[np.float64]:
    return np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1]).astype(np.float64)


def vanishing_points(lines: Segments, shape: tuple[int, ...]) -> tuple[Vector, Vector, float]:
    """Return the horizontal and the vertical vanishing point, and a confidence in 0..1.

    The confidence is the share of all line length that meets one of the two, scaled down where
    a family has few segments.
    """
    angle = np.arctan2(np.abs(lines[:, 3] - lines[:, 1]), np.abs(lines[:, 2] - lines[:, 0]))
    centre = np.array([shape[1] / 2, shape[0] / 2])
    unit = float(max(shape[:2]))
    plain = (lines.reshape(-1, 2, 2) - centre) / unit
    points, agreed, few = [], 0.0, 1.0
    for family in (angle < STEEP, angle > np.pi / 2 - STEEP):
        point, inside = _meeting(plain[family])
        agreed += float(_lengths(lines[family])[inside].sum())
        few = min(few, inside.sum() / ENOUGH)
        back = np.array([[unit, 0, centre[0]], [0, unit, centre[1]], [0, 0, 1.0]])
        points.append(back @ point)
    total = float(_lengths(lines).sum())
    confidence = 0.0 if total == 0 else agreed / total * min(few, 1.0)
    return points[0], points[1], confidence


def straight_share(lines: Segments, shape: tuple[int, ...], points: Sequence[Vector]) -> float:
    """Return how much of what meets in two vanishing points is parallel, too.

    The lesser share of the two families: of line length that meets in the point, what agrees with
    the point's direction in the middle of the picture, or with the picture's own axis. 1 and more
    where the plane is seen from the front.
    """
    angle = np.arctan2(np.abs(lines[:, 3] - lines[:, 1]), np.abs(lines[:, 2] - lines[:, 0]))
    centre = np.array([shape[1] / 2, shape[0] / 2])
    plain = lines.reshape(-1, 2, 2) - centre
    shares = []
    for axis, family in enumerate((angle < STEEP, angle > np.pi / 2 - STEEP)):
        middles, ways = plain[family].mean(axis=1), plain[family, 1] - plain[family, 0]
        lengths = np.linalg.norm(ways, axis=1)
        ways /= lengths[:, None]
        x, y, w = points[axis]
        far = [np.array([x - w * centre[0], y - w * centre[1], 0.0]), np.eye(3)[axis]]
        near = np.array([*far[0][:2], w])
        met, *parallel = (float(lengths[_meets(p, middles, ways)].sum()) for p in (near, *far))
        shares.append(max(parallel) / met if met > 0 else 1.0)
    return min(shares)


def _meeting(plain: NDArray[np.float64]) -> tuple[Vector, NDArray[np.bool_]]:
    """Return the point that most segment length meets (n, 2, 2), and which segments do."""
    if len(plain) < 2:
        return np.array([1.0, 0.0, 0.0]), np.zeros(len(plain), np.bool_)
    ends = np.concatenate([plain, np.ones((len(plain), 2, 1))], axis=2)
    lines = np.cross(ends[:, 0], ends[:, 1])
    middles = plain.mean(axis=1)
    ways = plain[:, 1] - plain[:, 0]
    lengths = np.linalg.norm(ways, axis=1)
    ways /= lengths[:, None]
    rng = np.random.Generator(np.random.PCG64(len(plain)))
    chances = lengths / lengths.sum()
    pairs = rng.choice(len(plain), (TRIES, 2), p=chances)
    points = np.cross(lines[pairs[:, 0]], lines[pairs[:, 1]])
    points = points[np.linalg.norm(points, axis=1) > 1e-12]
    best, least = np.array([1.0, 0.0, 0.0]), -1.0
    for point in points:
        score = float(lengths[_meets(point, middles, ways)].sum())
        if score > least:
            best, least = point, score
    for _ in range(5):
        inside = _meets(best, middles, ways)
        if inside.sum() < 2:
            break
        best = _refined(lines[inside], lengths[inside])
    return best, _meets(best, middles, ways)


def _meets(
    point: Vector, middles: NDArray[np.float64], ways: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Tell which segments point to a vanishing point within the angle that counts as near."""
    towards = point[:2] - point[2] * middles
    size = np.maximum(np.linalg.norm(towards, axis=1), 1e-12)
    across = np.abs(towards[:, 0] * ways[:, 1] - towards[:, 1] * ways[:, 0])
    near: NDArray[np.bool_] = across / size < NEAR
    return near


def _refined(lines: NDArray[np.float64], lengths: NDArray[np.float64]) -> Vector:
    """Return the point nearest to all lines, weighted by length."""
    unit = lines / np.linalg.norm(lines[:, :2], axis=1, keepdims=True)
    point: Vector = np.linalg.svd(unit * lengths[:, None], full_matrices=False)[2][-1]
    return point
