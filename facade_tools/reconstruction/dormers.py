"""Dormers of a thin roof: a low row between the bright sky and floors full of windows.

Beside these its profile of rows is no peak, so that the chain sees no row there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from .storeys import Band, Facade

# cells: a lower roof is a cornice or a balustrade, in a higher one the chain sees a row itself
ROOF = (11, 24)
SKY = (8, 40)  # cells of sky above: with fewer the roof's edge, with more the skyline is doubtful
ENOUGH = 0.5  # of what the median floor's windows show: from here a roof holds dormers
BLUR = 2.0  # cells
MARGIN = 0.2  # share of the roof over and under its dormers


def with_dormers(facade: Facade, bands: Sequence[Band]) -> list[Band]:
    """Return the bands, a roof without windows with a row of them where it holds as much.

    What stands beside the wall counts there, whatever its columns. Only a roof seen against the
    sky is asked.
    """
    roofs = [band for band in bands if band.kind == "roof"]
    rows = [band for band in bands if band.kind != "roof" and band.high > band.low]
    if not roofs or not rows or any(band.high > band.low for band in roofs):
        return list(bands)
    top, foot = min(band.y0 for band in roofs), max(band.y1 for band in roofs)
    if not (ROOF[0] <= foot - top <= ROOF[1] and SKY[0] <= facade.sky <= SKY[1]):
        return list(bands)
    usual = float(np.median([_relief(facade.shown[band.low : band.high]) for band in rows]))
    if _relief(facade.shown[top:foot]) < ENOUGH * usual:
        return list(bands)
    margin = int(MARGIN * (foot - top))
    roof = replace(roofs[0], y0=top, y1=foot, low=top + margin, high=foot - margin)
    return [*(band for band in bands if band.kind != "roof"), roof]


def _relief(part: NDArray[np.float32]) -> float:
    """Return how much rows of evidence hold beside the wall: the root mean square."""
    return float(np.sqrt((cv2.GaussianBlur(part, (0, 0), BLUR) ** 2).mean()))
