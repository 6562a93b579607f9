"""Features of single pixels at the picture's own resolution: where exactly an edge runs.

The last stage of the classifier looks at these planes, at the coarse planes of the working
resolution under the pixel, and at the coarse beliefs interpolated.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from .features import CONTRAST, Features, Picture, Plane, blurred, boxed, shifted, stacked
from .features_context import Probabilities

RUNS = (9, 25, 61)  # pixels along an edge
OFFSETS = (-6, -3, -1, 0, 1, 3, 6)  # pixels across it
SIDES = (2, 6)  # pixels to either side of an edge


def fine_features(picture: Picture) -> Features:
    """Return planes that tell where edges run, (count, height, width).

    >>> fine_features(np.zeros((4, 6, 3), np.uint8)).shape[1:]
    (4, 6)
    """
    return stacked(list(_planes(picture)))


def _planes(picture: Picture) -> Iterator[Plane]:
    lab = cv2.cvtColor(picture, cv2.COLOR_RGB2LAB).astype(np.float32)
    light = np.ascontiguousarray(lab[:, :, 0])
    yield light
    for k in (0, 1, 2):
        gain = np.float32(4.0 if k else 1.0)
        plane = np.ascontiguousarray(lab[:, :, k])
        yield 128 + gain * (boxed(plane, (3, 3)) - np.float32(np.median(plane)))
    for turned in (False, True):
        for plane in _edges(light.T if turned else light):
            yield plane.T if turned else plane


def _edges(light: Plane) -> Iterator[Plane]:
    """Planes about upright edges: their strength along runs, at offsets, and what lies beside."""
    smooth = blurred(light, 0.7)
    step = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=0.25).astype(np.float32, copy=False)
    yield 128 + 3 * step
    for run in RUNS:
        along = boxed(step, (1, run))
        for offset in OFFSETS:
            yield 128 + 4 * shifted(along, offset, 0)
    strength = np.abs(step)
    whole = np.broadcast_to(strength.mean(0, keepdims=True), light.shape)
    for offset in OFFSETS:
        yield 6 * shifted(whole, offset, 0)
    level = boxed(light, (3, RUNS[1]))
    for side in SIDES:
        yield 128 + CONTRAST * (shifted(level, side, 0) - light)
        yield 128 + CONTRAST * (shifted(level, -side, 0) - light)


def enlarged(probabilities: Probabilities, shape: tuple[int, int]) -> Probabilities:
    """Return coarse beliefs interpolated to (height, width)."""
    size = (shape[1], shape[0])
    planes = [cv2.resize(one, size, interpolation=cv2.INTER_LINEAR) for one in probabilities]
    return np.stack(planes).astype(np.float32, copy=False)
