"""The ground floor: a shop, or a floor with windows like those above.

A shop's openings and pillars differ from its wall as windows do, and some stand in their columns
by chance; what they look like along the facade is another thing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..geometry.arrays import Floats
from .evidence import along_columns
from .storeys import GROUND, Band

LEAST_FLOORS = 3  # fewer say little about what floors look like
ALIKE = 0.7  # correlation with the other floors from which a ground floor has windows as they have
SPLIT = 0.5  # and from which the floor above a shop is a floor, not its upper half
BLUR = 2.0  # cells


def with_shop(plane: NDArray[np.float32], bands: Sequence[Band]) -> list[Band]:
    """Return the bands from the ground; a ground floor unlike the floors above has no windows.

    plane: the evidence of windows, rows and columns of cells. Where the floor above the shop is
    unlike the others too, and both together are no higher than a ground floor may be, the chain
    has cut one high shop in two: they are one.
    """
    out = list(bands)
    floors = [band for band in out if band.kind == "floor" and band.high > band.low]
    ground = out[0]
    if len(floors) < LEAST_FLOORS or ground.kind != "ground" or ground.high <= ground.low:
        return out
    if _likeness(plane, ground, floors) >= ALIKE:
        return out
    above = floors[0]
    whole = above is out[1] and ground.y1 - above.y0 <= GROUND[1]
    if whole and _likeness(plane, above, floors[1:]) < SPLIT:
        del out[1]
        ground = replace(ground, y0=above.y0)
    out[0] = replace(ground, low=ground.y1, high=ground.y1)
    return out


def _likeness(plane: NDArray[np.float32], band: Band, floors: Sequence[Band]) -> float:
    """Return the correlation of a row of windows with the median of others, along the facade."""
    usual = np.median([_across(plane, floor) for floor in floors], axis=0)
    return float(_across(plane, band) @ usual / (np.linalg.norm(usual) + 1e-12))


def _across(plane: NDArray[np.float32], band: Band) -> Floats:
    """Return the profile of columns of a row of windows: mean 0, length 1."""
    across = along_columns(plane[band.low : band.high].mean(axis=0).astype(np.float64), BLUR)
    across = across - across.mean()
    out: Floats = across / (np.linalg.norm(across) + 1e-12)
    return out
