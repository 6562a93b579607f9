"""Where the building ends and where its roof begins (KSTTP09 3.4).

The line is the one whose two sides have the most different colours: the earth mover's distance
between the histograms of a picture's segments above and below it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..imaging.image_io import Picture

Histograms = NDArray[np.float64]  # (rows + 1, colours): running sums of pixels from the top

COLORS = 12
ROUNDS = 8
SPATIAL, RANGE = 5, 12  # radii of the mean shift, pixels and grey levels


@dataclass(frozen=True, slots=True)
class Segments:
    """counts: pixels of each colour above every row. palette: the colours, CIELAB (k, 3)."""

    counts: Histograms
    palette: NDArray[np.float32]


def segments(picture: Picture, seen: NDArray[np.float32]) -> Segments:
    """Return the pre-segmentation of a picture: mean shift, then a palette of a few colours."""
    calm = cv2.pyrMeanShiftFiltering(np.ascontiguousarray(picture), SPATIAL, RANGE, maxLevel=1)
    lab = cv2.cvtColor(calm.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    palette, index = _palette(lab.reshape(-1, 3).astype(np.float32))
    height, width = picture.shape[:2]
    member = (index.reshape(height, width)[:, :, None] == np.arange(len(palette))) * seen[..., None]
    counts = np.zeros((height + 1, len(palette)))
    np.cumsum(member.sum(axis=1), axis=0, out=counts[1:])
    return Segments(counts, palette)


def _palette(colors: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return k-means centres from quantiles of lightness, and the centre of each colour."""
    order = np.argsort(colors[:, 0], kind="stable")
    centres = np.array([part.mean(axis=0) for part in np.array_split(colors[order], COLORS)])
    index = np.zeros(len(colors), np.int64)
    for _ in range(ROUNDS):
        products = colors @ centres.T
        index = np.argmin((centres**2).sum(axis=1) - 2 * products, axis=1)
        for k in range(COLORS):
            if (index == k).any():
                centres[k] = colors[index == k].mean(axis=0)
    return centres.astype(np.float32), index


def differences(found: Segments, reach: int, top: int = 0) -> NDArray[np.float64]:
    """Return how different the `reach` rows above and below every row's upper border are.

    (rows + 1,), CIELAB units (eq. 9, of two consecutive regions); 0 at the picture's borders and
    down to `top`, above which nothing is looked at.
    """
    counts = found.counts
    rows = len(counts) - 1
    out = np.zeros(rows + 1)
    for row in range(top + 1, rows):
        above = counts[row] - counts[max(top, row - reach)]
        below = counts[min(rows, row + reach)] - counts[row]
        out[row] = earth_movers(above, below, found.palette)
    return out


def earth_movers(
    one: NDArray[np.float64], two: NDArray[np.float64], palette: NDArray[np.float32]
) -> float:
    """Return the earth mover's distance between two histograms over the same palette.

    Histograms are brought to sum 1; 0 where one of them is empty.
    """
    if one.sum() <= 0 or two.sum() <= 0:
        return 0.0
    piles = []
    for counts in (one, two):
        share = (counts / counts.sum()).astype(np.float32)
        piles.append(np.ascontiguousarray(np.column_stack([share, palette])[share > 0]))
    return float(cv2.EMD(piles[0], piles[1], cv2.DIST_L2)[0])
