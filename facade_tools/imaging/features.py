"""Pixel features of a facade picture: colour, gradients, texture, position, rows and columns.

Every feature is a plane of bytes, scaled by fixed constants (never by the picture's own range),
so that a classifier's thresholds mean the same in every picture.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]  # (height, width, 3) RGB
Plane = NDArray[np.float32]  # (height, width), values meant for 0..255
Features = NDArray[np.uint8]  # (count, height, width)
Value = TypeVar("Value", np.float32, np.uint8)

BLURS = (1.0, 2.0, 4.0, 8.0)  # pixels
TEXTURE_WINDOWS = (5, 11, 23)  # pixels
RUNS = (15, 41)  # pixels
STEPS = (4, 9, 18, 34)  # pixels: where neighbours are looked at
CONTRAST = 128.0 / 60.0  # grey levels of a difference to bytes


def pixel_features(picture: Picture) -> Features:
    """Return the planes of features of a picture at working resolution.

    >>> pixel_features(np.zeros((4, 6, 3), np.uint8)).shape[1:]
    (4, 6)
    """
    return stacked(list(_planes(picture)))


def stacked(planes: Sequence[Plane | Features], into: Features | None = None) -> Features:
    """Return planes clipped to bytes and stacked, (count, height, width), in `into` if given."""
    out = np.empty((len(planes), *planes[0].shape), np.uint8) if into is None else into
    for row, plane in zip(out, planes, strict=True):
        if plane.dtype == np.uint8:
            row[:] = plane
            continue
        np.clip(plane, 0.0, 255.0, out=row, casting="unsafe")
    return out


def _planes(picture: Picture) -> Iterator[Plane]:
    lab = [
        plane.astype(np.float32) for plane in cv2.split(cv2.cvtColor(picture, cv2.COLOR_RGB2LAB))
    ]
    light = lab[0]
    across, down = _gradients(light)
    yield from _colours(lab)
    yield from _textures(light, across, down)
    yield from _positions(light.shape)
    for plane in (light, lab[1], lab[2], 3 * across, 3 * down):
        yield from _lines(plane)
    yield from _neighbours(blurred(light, 1.5))
    yield from _neighbours(3 * boxed(across, (5, 5)), STEPS[1:3])
    yield from _neighbours(3 * boxed(down, (5, 5)), STEPS[1:3])


def _gradients(light: Plane) -> tuple[Plane, Plane]:
    smooth = blurred(light, 0.7)
    across = np.abs(cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=0.25))
    down = np.abs(cv2.Sobel(smooth, cv2.CV_32F, 0, 1, scale=0.25))
    return across, down


def _colours(lab: list[Plane]) -> Iterator[Plane]:
    means = [np.median(plane) for plane in lab]
    yield from lab
    for plane, mean, gain in zip(lab, means, (1.0, 4.0, 4.0), strict=True):
        for sigma in BLURS:
            smooth = blurred(plane, sigma)
            yield 128 + gain * (smooth - np.float32(mean))
            if gain > 1:
                yield 128 + 4 * (smooth - 128)
    for sigma in BLURS[1:]:
        yield 128 + CONTRAST * (lab[0] - blurred(lab[0], 2 * sigma))


def _textures(light: Plane, across: Plane, down: Plane) -> Iterator[Plane]:
    yield 4 * across
    yield 4 * down
    for size in TEXTURE_WINDOWS:
        mean = boxed(light, (size, size))
        yield 3 * np.sqrt(np.maximum(boxed(light * light, (size, size)) - mean * mean, 0))
        yield 6 * boxed(across, (size, size))
        yield 6 * boxed(down, (size, size))
        yield mean
    for run in RUNS:
        for shape in ((run, 3), (3, run)):
            yield from (boxed(light, shape), 6 * boxed(across, shape))
            yield 6 * boxed(down, shape)
            yield 128 + CONTRAST * (light - boxed(light, shape))


def _positions(shape: tuple[int, ...]) -> Iterator[Plane]:
    height, width = shape
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    yield 255 * y / height
    yield height - 1 - y
    yield 510 * np.minimum(x, width - 1 - x) / width
    yield np.minimum(x, width - 1 - x)


def _lines(plane: Plane) -> Iterator[Plane]:
    """Mean and spread of the whole row and column, and how far the pixel is from them."""
    for axis in (0, 1):
        mean = np.broadcast_to(plane.mean(axis, keepdims=True), plane.shape)
        yield mean
        yield 2 * np.broadcast_to(plane.std(axis, keepdims=True), plane.shape)
        yield 128 + CONTRAST * (boxed(plane, (3, 3)) - mean)
        near = blurred(mean, 6.0)
        yield 128 + 2 * CONTRAST * (mean - near)


def _neighbours(plane: Plane, steps: Sequence[int] = STEPS) -> Iterator[Plane]:
    for step in steps:
        for dx, dy in ((step, 0), (-step, 0), (0, step), (0, -step)):
            yield 128 + CONTRAST * (shifted(plane, dx, dy) - plane)


def blurred(plane: Plane, sigma: float) -> Plane:
    """Return a plane under a Gaussian of `sigma` pixels."""
    whole = np.ascontiguousarray(plane)  # OpenCV takes no broadcast views
    return cv2.GaussianBlur(whole, (0, 0), sigma).astype(np.float32, copy=False)


def boxed(plane: Plane, size: tuple[int, int]) -> Plane:
    """Return the means of a plane over boxes of (width, height) pixels."""
    return cv2.blur(plane, size).astype(np.float32, copy=False)


def shifted(plane: NDArray[Value], dx: int, dy: int) -> NDArray[Value]:
    """Return the plane whose pixel (x, y) is the given one's (x + dx, y + dy); edges repeat."""
    height, width = plane.shape
    edges = (max(-dy, 0), max(dy, 0), max(-dx, 0), max(dx, 0))
    wider = cv2.copyMakeBorder(np.ascontiguousarray(plane), *edges, cv2.BORDER_REPLICATE)
    top, left = max(dy, 0), max(dx, 0)
    moved = wider[top : top + height, left : left + width]
    return moved.astype(plane.dtype, copy=False)
