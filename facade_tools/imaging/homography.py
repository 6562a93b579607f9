"""Homographies of the plane: fitting, applying, warping."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidInput
from .image_io import Picture

Homography = NDArray[np.float64]  # (3, 3), columns are homogeneous pixels (x, y, 1)
Points = NDArray[np.float64]  # (n, 2) pixels

LEAST_DETERMINANT = 1e-12


def applied(homography: Homography, points: Points) -> Points:
    """Return transformed points, (n, 2).

    >>> applied(np.diag([2.0, 3.0, 1.0]), np.array([[1.0, 1.0]])).tolist()
    [[2.0, 3.0]]
    """
    mapped = np.column_stack([points, np.ones(len(points))]) @ homography.T
    shares: Points = mapped[:, :2] / mapped[:, 2:]
    return shares


def fitted_homography(source: Points, target: Points) -> Homography:
    """Return the homography from `source` to `target`, four points or more (normalised DLT).

    Raises InvalidInput where three of four points lie on a line.
    """
    one, other = _normaliser(source), _normaliser(target)
    a, b = applied(one, source), applied(other, target)
    zero, unit = np.zeros(len(a)), np.ones(len(a))
    x, y, u, v = a[:, 0], a[:, 1], b[:, 0], b[:, 1]
    rows = np.concatenate([
        np.column_stack([-x, -y, -unit, zero, zero, zero, u * x, u * y, u]),
        np.column_stack([zero, zero, zero, -x, -y, -unit, v * x, v * y, v]),
    ])  # fmt: skip
    values, vectors = np.linalg.svd(rows)[1:]
    if values[7] < 1e-9 * values[0]:
        raise InvalidInput("the points do not fix a homography (three on a line)")
    plain: Homography = np.linalg.inv(other) @ vectors[-1].reshape(3, 3) @ one
    if abs(np.linalg.det(plain / np.linalg.norm(plain))) < LEAST_DETERMINANT:
        raise InvalidInput("the points do not fix a homography (three on a line)")
    return plain / plain[2, 2] if abs(plain[2, 2]) > LEAST_DETERMINANT else plain


def _normaliser(points: Points) -> Homography:
    """Return the similarity that moves points to the origin at mean distance √2 (Hartley)."""
    centre = points.mean(axis=0)
    spread = float(np.mean(np.linalg.norm(points - centre, axis=1)))
    scale = np.sqrt(2) / max(spread, 1e-12)
    return np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1.0]])


def warped(picture: Picture, homography: Homography, size: tuple[int, int]) -> Picture:
    """Return the picture under a homography of pixel corners, `size` = (width, height)."""
    # OpenCV counts pixel centres, we count their corners
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    matrix = np.linalg.inv(half) @ homography @ half
    out = cv2.warpPerspective(picture, matrix, size, flags=cv2.INTER_LINEAR)
    return out.astype(np.uint8)
