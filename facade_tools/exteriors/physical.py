"""What a row of free coordinates must satisfy to be a building; draws are moved onto it.

Transforms keep most coordinates in range by themselves. What ties several coordinates together is
settled here: the nearest possible value takes the place of an impossible one (docs/sample.md).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .coordinates import Bits, Floats
from .dataset import Masks
from .full_plans import Part, rectangle_exposure, snapped_garage, touching
from .groups import ABSENT, ATOM_TOLERANCE
from .layout import Layout
from .relations import MOST_FLOORS

MIDDLE = 0.5
GAP = 1e-3  # how far a porch keeps from the middle line, relative
LEAST_STOREY = 2.3  # m: of houses with floors above each other
HIGHEST_STOREY = 5.0  # m: a house higher than its floors allow has another one
LOWEST = 2.1  # m: lower eaves leave no room for a door


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
    """Mark r2 as absent where r1 is 0; what is that near to 0 is 0."""
    floors = Columns(values, layout).get("r1", "r2")
    if floors:
        r1, r2 = floors
        for share in floors:
            share[np.abs(share) <= ATOM_TOLERANCE] = 0.0
        r2[r1 == 0] = ABSENT


def storey_heights(values: tuple[Floats, ...], layout: Layout, typical: float) -> Floats:
    """Return a storey height (n,) for each row, metres: `typical`, moved to suit its floors.

    Where the uppermost of typical storeys would be lower than a person needs, and storeys of equal
    height would not, all are equal: they are those of a lower kind of house.
    """
    height = Columns(values, layout).get("height")
    if not height:
        return np.full(len(values[0]), typical)
    floors, least, most = storey_ranges(values, layout)
    count = np.where(floors < MOST_FLOORS, floors, np.floor(height[0] / typical + 0.5))
    count = np.maximum(count, floors)
    low = height[0] - (count - 1) * typical < LEAST_STOREY
    equal = height[0] / count
    usual = np.where(low & (equal >= LEAST_STOREY), equal, typical)
    return np.asarray(np.clip(usual, least, most))


def storey_ranges(values: tuple[Floats, ...], layout: Layout) -> tuple[Floats, Floats, Floats]:
    """Return for each row (n,) its floors and the least and greatest storey height (m) they allow.

    Floor i exists where the house reaches above (i + 1/2) storeys, so that a house of N floors is
    (N − 1/2) to (N + 1/2) storeys high; with three floors it may be higher. Where the layout has
    no floors any height is possible.
    """
    found = Columns(values, layout).get("height", "r1", "r2")
    if not found:
        one = np.ones(len(values[0]))
        return one, 0.0 * one, np.inf * one
    height, r1, r2 = found
    floors = 1.0 + (r1 > ATOM_TOLERANCE) + (np.isfinite(r2) & (r2 > ATOM_TOLERANCE))
    least = np.where(floors < MOST_FLOORS, height / (floors + 0.5), 0.0) * (1 + 1e-6)
    return floors, least, height / (floors - 0.5) * (1 - 1e-6)


def _floors_under_eaves(
    values: tuple[Floats, ...], layout: Layout, fixed: tuple[Bits, ...] | None
) -> None:
    """Suit floors and eaves, in place, where a storey would be no storey.

    A floor for which the eaves are too low is none; where it is given, the eaves are raised. Eaves
    too high for the floors that there are (few rows know what they lack) get floors as large as
    the one below.
    """
    found = Columns(values, layout).get("height", "r1", "r2")
    if not found:
        return
    height, r1, r2 = found
    held = Columns(fixed, layout) if fixed else None
    for floors, share in ((3, r2), (2, r1)):
        low = np.isfinite(share) & (height < LEAST_STOREY * (floors - 0.5))
        name = {2: "r1", 3: "r2"}[floors]
        _put(share, np.where(low, 0.0, share), held, name)
    no_second_floor(values, layout)
    _floors_that_lack(height, r1, r2, held)
    above = (r1 > ATOM_TOLERANCE) + (np.isfinite(r2) & (r2 > ATOM_TOLERANCE)).astype(np.int64)
    least = np.where(above > 0, LEAST_STOREY * (above + 0.5), LOWEST) * (1 + 1e-5)
    _put(height, np.maximum(height, least), held, "height")


def _floors_that_lack(height: Floats, r1: Floats, r2: Floats, held: Columns | None) -> None:
    """Give houses whose storeys would be above `HIGHEST_STOREY` another floor, in place."""
    one = (r1 <= ATOM_TOLERANCE) & (height > 1.5 * HIGHEST_STOREY)
    _put(r1, np.where(one, 1.0, r1), held, "r1")
    r2[one & (r1 > ATOM_TOLERANCE) & ~np.isfinite(r2)] = 0.0
    two = (r1 > ATOM_TOLERANCE) & (r2 <= ATOM_TOLERANCE) & (height > 2.5 * HIGHEST_STOREY)
    _put(r2, np.where(two, 1.0, r2), held, "r2")


def settle(
    values: tuple[Floats, ...], layout: Layout, fixed: tuple[Bits, ...] | None = None
) -> None:
    """Move complete rows, in place, to what is possible.

    Ranges; r2 only above an r1; the garage inside the bounding box and not higher; porches on
    their side of the middle, at the bounding box or in it, outside the garage, no wider than the
    house and open to one side; at a full rectangle, exposures as places fix them (`full_plans`).
    fixed (n, d) a group: 1 where a value is given and must stay.
    """
    _ranges(values, layout, fixed)
    no_second_floor(values, layout)
    _floors_under_eaves(values, layout, fixed)
    columns, held = Columns(values, layout), Columns(fixed or (), layout) if fixed else None
    _garage(columns, held)
    _settle_garage(columns, held)
    for name, sign in (("porch_front", -1), ("porch_back", 1)):
        place = columns.get(f"{name}.py")
        if place:
            limit = MIDDLE + sign * GAP
            moved = np.minimum(place[0], limit) if sign < 0 else np.maximum(place[0], limit)
            _put(place[0], moved, held, f"{name}.py")
            _along_house(columns, held, name, sign)
            _at_house(columns, held, name)
            _out_of_garage(columns, held, name, sign)
            _open_side(columns, held, name)
            _settle_porch(columns, held, name, sign)


def _along_house(columns: Columns, held: Columns | None, name: str, sign: int) -> None:
    """Keep a porch that stands before the house within the house's width: it leans on its wall.

    One that stands beside the house, or in a recess of its plan, stays.
    """
    house, porch = columns.get(*HOUSE), columns.get(f"{name}.px", f"{name}.py", f"{name}.width")
    if not house or not porch:
        return
    width, _, bcr = house
    px, py, size = porch
    with np.errstate(invalid="ignore"):  # absent parts are infinite and left alone
        before = ((py - MIDDLE) * sign > MIDDLE) | (np.abs(bcr - 1) <= ATOM_TOLERANCE)
        before &= np.abs(px - MIDDLE) < MIDDLE + size / width / 2
        _put(size, np.where(before, np.minimum(size, width), size), held, f"{name}.width")
        half = np.minimum(size / width / 2, MIDDLE)
        _put(px, np.where(before, np.clip(px, half, 1 - half), px), held, f"{name}.px")


def _at_house(columns: Columns, held: Columns | None, name: str) -> None:
    """Push a porch that stands apart from the bounding box to it: no house could touch it."""
    for place, size in SIZES:
        found = columns.get(size, f"{name}.{place}", f"{name}.{size}")
        if found:
            house, at, porch = found
            half = porch / house / 2
            _put(at, np.clip(at, -half, 1 + half), held, f"{name}.{place}")


HOUSE = ("width", "depth", "bcr")
EXPOSED = ("px", "py", "width", "depth", "exposure")


def _full_part(
    columns: Columns, held: Columns | None, name: str
) -> tuple[tuple[Floats, Floats], Part, Masks] | None:
    """Return houses and parts of the rows whose plan is a full rectangle and no value given.

    None where the layout lacks a column or there is no such row.
    """
    house, part = columns.get(*HOUSE), columns.get(*(f"{name}.{c}" for c in EXPOSED))
    if not house or not part:
        return None
    width, depth, bcr = house
    rows = (np.abs(bcr - 1) <= ATOM_TOLERANCE) & np.isfinite(part[2])
    if held is not None:
        given = held.get(*(f"{name}.{c}" for c in EXPOSED)) or []
        rows &= ~np.any([column != 0 for column in given], axis=0)
    if not rows.any():
        return None
    return (width[rows], depth[rows]), Part(*(column[rows] for column in part)), rows


def _settle_garage(columns: Columns, held: Columns | None) -> None:
    found = _full_part(columns, held, "garage")
    if found:
        house, part, rows = found
        places = columns.get("garage.px", "garage.py", "garage.exposure") or []
        for column, value in zip(places, snapped_garage(house, part), strict=True):
            column[rows] = value


def _settle_porch(columns: Columns, held: Columns | None, name: str, sign: int) -> None:
    found = _full_part(columns, held, name)
    if found:
        house, part, rows = found
        (py, exposure) = columns.get(f"{name}.py", f"{name}.exposure") or (part.py, part.exposure)
        py[rows] = touching(house, part, sign)
        exposure[rows] = rectangle_exposure(house, part._replace(py=py[rows]))


def _open_side(columns: Columns, held: Columns | None, name: str) -> None:
    """Leave a porch as much exposure as its shorter side has: it opens to somewhere."""
    found = columns.get(f"{name}.width", f"{name}.depth", f"{name}.exposure")
    if found:
        width, depth, exposure = found
        with np.errstate(invalid="ignore"):  # absent parts are infinite and left alone
            least = np.minimum(width, depth) / (2 * (width + depth))
        _put(exposure, np.maximum(exposure, least), held, f"{name}.exposure")


def _out_of_garage(columns: Columns, held: Columns | None, name: str, sign: int) -> None:
    """Push a porch that meets the garage in plan aside or outwards, whichever is nearer.

    A porch cannot stand in a garage; no coordinate by itself says so.
    """
    found = columns.get("width", "depth", *(f"garage.{c}" for c in PLAN))
    porch = columns.get(*(f"{name}.{c}" for c in PLAN))
    if not found or not porch:
        return
    w, d, gx, gy, gw, gd = found
    px, py, pw, pd = porch
    here = np.isfinite(gw) & np.isfinite(pw)
    side = np.where(px >= gx, 1.0, -1.0)
    with np.errstate(invalid="ignore"):  # absent parts are infinite and left alone
        aside = gx + side * (gw + pw) / 2 / w
        outside = gy + sign * (gd + pd) / 2 / d
        across, along = (aside - px) * side * w, (outside - py) * sign * d
        meets = here & (across > 0) & (along > 0)
        least = np.minimum(across, along)
    _put(px, np.where(meets & (across <= least), aside, px), held, f"{name}.px")
    _put(py, np.where(meets & (along <= least), outside, py), held, f"{name}.py")


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


PLAN = ("px", "py", "width", "depth")
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
