"""Parts of a photograph that show no building: what lies outside it, and sky that is burnt out."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from .image_io import Picture

Mask = NDArray[np.bool_]  # (height, width)

BURNT = 235  # of 255, the darkest channel of a sky that is burnt out


def rim(picture: Picture) -> Mask:
    """Return where a rectified picture was filled up: flat black or mid-grey at its border."""
    values = picture.astype(np.int16)
    flat = (values.max(axis=2) < 14) | (np.abs(values - 128).max(axis=2) < 6)
    count, marks, stats, _ = cv2.connectedComponentsWithStats(flat.astype(np.uint8), connectivity=4)
    height, width = flat.shape
    x, y, w, h, area = stats.T
    outer = (x == 0) | (y == 0) | (x + w == width) | (y + h == height)
    chosen = outer & (area > 0.004 * height * width) & (np.arange(count) > 0)
    grown = cv2.dilate(chosen[marks].astype(np.uint8), np.ones((5, 5), np.uint8))
    return grown > 0


def burnt_sky(picture: Picture, outside: Mask) -> Mask:
    """Return where a picture is white from its top border on, or from what lies outside it there.

    outside: (height, width), the picture's rim (see `rim`).

    >>> street = np.full((4, 3, 3), (255, 90, 255), np.uint8)
    >>> street[:2] = 250
    >>> burnt_sky(street, np.zeros((4, 3), bool))[:, 0].tolist()
    [True, True, False, False]
    """
    white = picture.min(axis=2) >= BURNT
    _, marks = cv2.connectedComponents((white | outside).astype(np.uint8), connectivity=4)
    return np.asarray(white & ~outside & np.isin(marks, marks[0]))
