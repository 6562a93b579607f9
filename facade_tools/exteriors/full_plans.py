"""Houses that fill their bounding box: garage and porches leave no choice of exposure.

Where bcr is 1 the plan is a rectangle, so that place and size of garage and porches fix how much of
their outline is free. Draws are moved onto that; nothing else in the model says so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .coordinates import Floats

FLUSH = 1e-6  # closer than this to the bounding box counts as on it (m)


class Part(NamedTuple):
    """Columns (n,) of a garage or porch: relative centre, size (m), exposure."""

    px: Floats
    py: Floats
    width: Floats
    depth: Floats
    exposure: Floats


def snapped_garage(house: tuple[Floats, Floats], part: Part) -> tuple[Floats, Floats, Floats]:
    """Return px, py and exposure of garages on the walls that suit the draw best.

    house: width and depth (m). Of all ways to stand at the sides of the rectangle (one in x, one
    in y, but not neither) the one nearest in the three coordinates is taken: the terms that the
    energy of FW16 eq. 3 would miss.
    """
    w, d = house
    half_x, half_y = part.width / w / 2, part.depth / d / 2
    best = np.full(len(w), np.inf)
    chosen = tuple(column.copy() for column in (part.px, part.py, part.exposure))
    for x in (part.px, half_x, 1 - half_x):
        for y in (part.py, half_y, 1 - half_y):
            exposure = rectangle_exposure(house, part._replace(px=x, py=y))
            terms = (x - part.px, y - part.py, exposure - part.exposure)
            cost = sum(np.square(term) for term in terms)
            better = (exposure > 0) & (cost < best)
            best = np.where(better, cost, best)
            for column, value in zip(chosen, (x, y, exposure), strict=True):
                column[better] = value[better]
    return chosen  # type: ignore[return-value]


def touching(house: tuple[Floats, Floats], part: Part, sign: int) -> Floats:
    """Return py of porches at the wall; sign: −1 front, 1 back.

    Moved there are those that reach into the house from its front or back, or do not reach it: a
    plan that is full has no recess for them. One that stands beside the house stays.
    """
    w, d = house
    limit = np.where(sign < 0, 0.0, 1.0) + sign * part.depth / d / 2
    before = np.abs(part.px - 0.5) < 0.5 + (part.width / 2 - FLUSH) / w
    return np.where(before, limit, part.py)


def rectangle_exposure(house: tuple[Floats, Floats], part: Part) -> Floats:
    """Return the exposure of parts (rectangles) at or in houses that are rectangles themselves.

    It is the share of the part's outline that lies on the outline of both together: an edge is
    covered where the house goes on behind it (FW16 appendix A).
    """
    covered = np.zeros(len(part.px))
    spans = []
    for size, at, length in zip(house, (part.px, part.py), (part.width, part.depth), strict=True):
        spans.append((size, at * size - length / 2, at * size + length / 2))
    for (size, low, high), (other, first, last) in (tuple(spans), tuple(spans[::-1])):
        beside = np.maximum(np.minimum(last, other) - np.maximum(first, 0.0), 0.0)
        covered += np.where((low > FLUSH) & (low <= size + FLUSH), beside, 0.0)
        covered += np.where((high < size - FLUSH) & (high >= -FLUSH), beside, 0.0)
    return np.asarray(np.clip(1 - covered / (2 * (part.width + part.depth)), 0.0, 1.0))
