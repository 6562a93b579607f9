"""What a row of free coordinates must satisfy to be a building; draws are moved onto it.

Transforms keep most coordinates in range by themselves. What ties several coordinates together is
settled here: the nearest possible value takes the place of an impossible one (docs/sample.md).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .coordinates import Bits, Floats
from .groups import ABSENT, ATOM_TOLERANCE
from .layout import Layout

MIDDLE = 0.5
GAP = 1e-3  # how far a porch keeps from the middle line, relative


class Columns:
    """Looks up coordinates of rows by name; what a layout lacks is None."""

    def __init__(self, values: tuple[NDArray[Any], ...], layout: Layout) -> None:
        """Keep views of the arrays: writing to a column writes to the row."""
        self._columns = {
            c.name: values[g][:, i]
            for g, group in enumerate(layout.groups)
            for i, c in enumerate(group.coordinates)
        }

    def get(self, *names: str) -> list[NDArray[Any]] | None:
        """Return the columns, or None where the layout lacks one."""
        if any(name not in self._columns for name in names):
            return None
        return [self._columns[name] for name in names]


def no_second_floor(values: tuple[Floats, ...], layout: Layout) -> None:
    """Mark r2 as absent where r1 is 0."""
    floors = Columns(values, layout).get("r1", "r2")
    if floors:
        r1, r2 = floors
        r2[np.abs(r1) <= ATOM_TOLERANCE] = ABSENT


def settle(
    values: tuple[Floats, ...], layout: Layout, fixed: tuple[Bits, ...] | None = None
) -> None:
    """Move complete rows, in place, to what is possible.

    Ranges; r2 only above an r1; the garage inside the bounding box and not higher; porches on
    their side of the middle. fixed (n, d) a group: 1 where a value is given and must stay.
    """
    _ranges(values, layout, fixed)
    no_second_floor(values, layout)
    columns, held = Columns(values, layout), Columns(fixed or (), layout) if fixed else None
    _garage(columns, held)
    for name, sign in (("porch_front", -1), ("porch_back", 1)):
        place = columns.get(f"{name}.py")
        if place:
            limit = MIDDLE + sign * GAP
            moved = np.minimum(place[0], limit) if sign < 0 else np.maximum(place[0], limit)
            _put(place[0], moved, held, f"{name}.py")


def _ranges(values: tuple[Floats, ...], layout: Layout, fixed: tuple[Bits, ...] | None) -> None:
    for g, group in enumerate(layout.groups):
        least = np.array([c.least for c in group.coordinates])
        most = np.array([c.most for c in group.coordinates])
        free = np.isfinite(values[g])
        if fixed is not None:
            free &= fixed[g] == 0
        np.copyto(values[g], np.clip(values[g], least, most), where=free)


def _put(column: Floats, moved: Floats, held: Columns | None, name: str) -> None:
    free = np.isfinite(column)
    if held is not None:
        free &= held.get(name)[0] == 0  # type: ignore[index]
    column[free] = moved[free]


SIZES = (("px", "width"), ("py", "depth"))


def _garage(columns: Columns, held: Columns | None) -> None:
    """Shrink the garage to the house, then push it inside; a given garage widens the house."""
    for place, size in (*SIZES, ("", "height")):
        pair = columns.get(size, f"garage.{size}")
        if pair is None:
            return
        house, garage = pair
        here = np.isfinite(garage)
        _put(garage, np.minimum(garage, house), held, f"garage.{size}")
        needed = np.where(here, garage, 0.0)
        if place:
            (at,) = columns.get(f"garage.{place}") or [house]
            half = np.where(here, garage / house / 2, 0.0)
            inside = np.clip(at, np.minimum(half, 0.5), np.maximum(1 - half, 0.5))
            _put(at, inside, held, f"garage.{place}")
            room = np.clip(np.minimum(at, 1 - at), 1e-3, 0.5)
            needed = np.where(here, garage / (2 * room), 0.0)
        _put(house, np.where(needed > house * (1 + 1e-12), needed, house), held, size)
