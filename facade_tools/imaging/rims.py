"""Parts of a photograph that show no building: what lies outside it, and sky that is burnt out."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from .image_io import Picture

Mask = NDArray[np.bool_]  # (height, width)

CORNER = 0.01  # of the shorter side: so near to a corner compression and crops blur the fill
LEAST = 0.004  # of the picture: what is smaller is no rim
BURNT = 235  # of 255, the darkest channel of a sky that is burnt out


def rim(picture: Picture) -> Mask:
    """Return where a rectified picture was filled up: flat black or mid-grey from a corner on.

    The photograph is a convex quadrilateral in it, so whatever lies outside holds a corner.
    """
    values = picture.astype(np.int16)
    flat = (values.max(axis=2) < 14) | (np.abs(values - 128).max(axis=2) < 6)
    _, marks, stats, _ = cv2.connectedComponentsWithStats(flat.astype(np.uint8), connectivity=4)
    near = max(2, round(CORNER * min(flat.shape)))
    ends = slice(near), slice(-near, None)
    corners = [marks[y, x].ravel() for y in ends for x in ends]
    chosen = np.isin(np.arange(len(stats)), np.concatenate(corners))
    chosen &= stats[:, cv2.CC_STAT_AREA] > LEAST * flat.size
    chosen[0] = False
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
