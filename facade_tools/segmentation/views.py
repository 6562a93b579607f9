"""Views of training pictures for the network: parts, stretched a little, in another light."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from ..imaging.features import Picture
from .augmentation import relit
from .autocontext import Labels

Sizes = Sequence[tuple[int, int]]  # (height, width) of views, pixels
Positions = NDArray[np.float64]

DOWN, ACROSS = 0.35, 0.15  # spread of the logarithm of the scale along a view
KNOTS = 8  # at which the scale along a view is drawn


def random_view(
    picture: Picture, labels: Labels, sizes: Sizes, *, rng: np.random.Generator
) -> tuple[Picture, Labels]:
    """Return a part of a picture: scale, perspective, mirror, light and occluder vary.

    The scale also varies along the view: roofs and storeys become higher and lower than they are.
    It has the one of `sizes` that is nearest in shape. Labels of what hides a part, or lies outside
    of the picture, are 0.
    """
    part = _part(labels.shape, rng)
    stretch = np.exp(rng.normal(0, 0.15, 2))
    aspect = np.log((part[3] - part[1]) * stretch[1] / ((part[2] - part[0]) * stretch[0]))
    height, width = min(sizes, key=lambda size: abs(np.log(size[0] / size[1]) - aspect))
    warp = _warp(part, (height, width), rng)
    x, y = _uneven(width, ACROSS, rng), _uneven(height, DOWN, rng)
    at = _positions(warp, x, y)
    inside, outside = cv2.BORDER_REPLICATE, cv2.BORDER_CONSTANT
    pixels = cv2.remap(picture, *at, cv2.INTER_LINEAR, borderMode=inside).astype(np.uint8)
    known = cv2.remap(labels, *at, cv2.INTER_NEAREST, borderMode=outside).astype(np.uint8)
    pixels = relit(pixels, rng=rng)
    if rng.random() < 0.3:
        _hide(pixels, known, rng)
    return pixels, known


def _part(shape: tuple[int, ...], rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Return x0, y0, x1, y1: often the whole picture, else some of its width or height.

    What the photographer left out above or below makes roofs and shops lie elsewhere.
    """
    height, width = shape
    wide = width * (rng.uniform(0.55, 1.0) if rng.random() < 0.5 else 1.0)
    high = height * (rng.uniform(0.7, 1.0) if rng.random() < 0.5 else 1.0)
    x, y = rng.uniform(0, width - wide), rng.uniform(0, height - high)
    return x, y, x + wide, y + high


def _warp(
    part: tuple[float, float, float, float], size: tuple[int, int], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the homography from a view to a part of the picture."""
    x0, y0, x1, y1 = part
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    corners += rng.uniform(-0.025, 0.025, (4, 2)) * [x1 - x0, y1 - y0]
    if rng.random() < 0.5:
        corners = corners[[1, 0, 3, 2]]
    height, width = size
    frame = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    return cv2.getPerspectiveTransform(frame, corners.astype(np.float32)).astype(np.float64)


def _uneven(length: int, spread: float, rng: np.random.Generator) -> Positions:
    """Return where the pixels of a side lie when it is stretched here and pressed there."""
    logs = rng.normal(0, spread, KNOTS)
    scale = np.exp(np.interp(np.linspace(0, KNOTS - 1, length), np.arange(KNOTS), logs))
    borders = np.concatenate([[0], np.cumsum(scale)])
    borders *= length / borders[-1]
    middles: Positions = (borders[:-1] + borders[1:]) / 2
    return middles - 0.5


def _positions(
    warp: NDArray[np.float64], x: Positions, y: Positions
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the columns and the rows of the picture that a grid of a view shows."""
    u, v = np.meshgrid(x, y)
    across, down, along = (row[0] * u + row[1] * v + row[2] for row in warp)
    return (across / along).astype(np.float32), (down / along).astype(np.float32)


def _hide(picture: Picture, labels: Labels, rng: np.random.Generator) -> None:
    """Lay a box of one colour over a part of a view."""
    height, width = labels.shape
    high, wide = int(height * rng.uniform(0.05, 0.2)), int(width * rng.uniform(0.05, 0.25))
    y, x = int(rng.integers(0, height - high)), int(rng.integers(0, width - wide))
    picture[y : y + high, x : x + wide] = rng.integers(0, 255, 3)
    labels[y : y + high, x : x + wide] = 0
