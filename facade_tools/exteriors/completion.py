"""Completions of a partly observed building: draws given it, constraints met, values untouched."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..artifacts.attributes import Attributes, Bounds, MassAttributes
from ..errors import Infeasible
from .conditioning import draw_given, resampled
from .coordinates import Bits, Floats, Readings, read_attributes
from .dataset import Masks
from .groups import ABSENT, ATOM_TOLERANCE, Group, least_bdry
from .layout import Layout
from .network import Network
from .physical import Columns, settle, storey_ranges
from .relations import ROUNDED, completed, contradictions, states_storeys
from .sampling import Draws
from .shared_values import SharedValues, take_up

BLOCK = 1024  # weighted draws of one resampling
ATTEMPTS = 40  # blocks without one possible draw before completion gives up
NEAR = 1e-9  # relative: what is off by less fits


@dataclass(frozen=True, slots=True)
class Completion:
    """A block of complete rows that keep what is given; effective: None where exact."""

    draws: Draws
    effective: float | None


def completions(
    network: Network,
    given: Attributes,
    groups: tuple[Group, ...],
    *,
    rng: np.random.Generator,
    style: int | None = None,
    shared: tuple[SharedValues, ...] = (),
) -> Iterator[Completion]:
    """Yield blocks of completions without end. Raises Infeasible where none is found.

    shared: values that what is not given takes up again.
    """
    for pointer, message in contradictions(given):
        raise Infeasible(f"{given.id}: {pointer}: {message}")
    known = completed(given)
    row = read_attributes([known], network.layout, groups)
    fixed = tuple((~np.isnan(v)).astype(np.int8) for v in row.values)
    failures = 0
    while True:
        particles = draw_given(network, row, BLOCK, rng=rng, style=style)
        draws = resampled(particles, rng=rng)
        held = tuple(np.tile(f, (len(draws.style), 1)) for f in fixed)
        take_up(draws.readings.values, shared, rng=rng, fixed=held)
        possible = accept(draws.readings, network, known, held)
        if possible.any():
            failures = 0
            kept = replace(
                draws, readings=draws.readings.take(possible), style=draws.style[possible]
            )
            yield Completion(kept, None if particles.exact else particles.effective)
            continue
        failures += 1
        if failures >= ATTEMPTS:
            tried = ATTEMPTS * BLOCK
            raise Infeasible(f"{given.id}: none of {tried} draws meets what is given")


def accept(rows: Readings, network: Network, given: Attributes, held: tuple[Bits, ...]) -> Masks:
    """Settle rows in place and tell which (n,) are possible with what is given (`held`).

    given: with what follows from it (`relations.completed`).
    """
    layout = network.layout
    columns = layout_columns(rows, network)
    good = np.ones(len(rows), dtype=np.bool_) & _solve_floors(columns, given.mass)
    settle(rows.values, layout, _with_solved(held, layout, given.mass))
    good &= _solve_boundary(columns, given.mass)
    if given.bounds is not None:
        good &= _in_bounds(columns, given.bounds)
    if states_storeys(given) and not _heights_known(given.mass):
        _, least, most = storey_ranges(rows.values, layout)
        good &= (least <= given.storey_height) & (given.storey_height <= most)
    return good & _garage_fits(columns)


def _in_bounds(columns: Columns, bounds: Bounds) -> Masks:
    """Tell where the house holds the listed boxes and nothing stands on the low ones."""
    good = np.asarray(True)
    sizes = columns.get("width", "depth", "height")
    for column, least in zip(sizes or (), bounds.bbox_min, strict=sizes is not None):
        good = good & (column >= least * (1 - 1e-12))
    plan = columns.get("width", "depth", "bcr", "r1", "r2")
    if plan:
        width, depth, bcr, r1, r2 = plan
        second = r1 * np.where(np.isfinite(r2), r2, 0.0)
        for share, low in zip((r1, second), bounds.low_area, strict=True):
            good = good & ((1 - share) * bcr * width * depth >= low * (1 - ROUNDED))
    return good


def _heights_known(mass: MassAttributes) -> bool:
    """Tell whether eaves and floors are given: a storey height has no more to decide."""
    return mass.bbox[2] is not None and None not in mass.arf


def layout_columns(rows: Readings, network: Network) -> Columns:
    """Return the rows' coordinates by name."""
    return Columns(rows.values, network.layout)


def _garage_fits(columns: Columns) -> Masks:
    """Tell where the garage, given or not, is no larger than the house and inside its plan."""
    good: Any = True
    for size, place in (("width", "px"), ("depth", "py"), ("height", "")):
        pair = columns.get(size, f"garage.{size}")
        if not pair:
            continue
        house, garage = pair
        here = np.isfinite(garage)
        good = good & (~here | (garage <= house * (1 + NEAR)))
        at = columns.get(f"garage.{place}") if place else None
        if at:
            share = np.where(here, garage, 0.0) / house
            off = np.abs(np.where(here, at[0], 0.5) - 0.5)
            good = good & (off + share / 2 <= 0.5 + ROUNDED)
    return np.asarray(good)


def _solve_floors(columns: Columns, mass: MassAttributes) -> Masks:
    """Meet given floors that only together with drawn ones fix a free coordinate, in place.

    Returns where that is possible. far and one of arf also fix a bcr that is not given.
    """
    floors = columns.get("bcr", "r1", "r2")
    if not floors or not _solves_floors(mass):
        return np.asarray(True)
    bcr, r1, r2 = floors
    ratios = _ratios(mass, bcr, r1, np.where(np.isfinite(r2), r2, 0.0))
    good = np.all([(share >= -NEAR) & (share <= 1 + NEAR) for share in ratios], axis=0)
    first, second = (np.clip(np.nan_to_num(share), 0.0, 1.0) for share in ratios)
    r1[:], r2[:] = first, np.where(first <= ATOM_TOLERANCE, ABSENT, second)
    if mass.far is not None and (mass.arf[1] is not None or mass.arf[2] is not None):
        found = mass.far / (1.0 + first + first * second)
        good &= found <= 1 + NEAR
        bcr[:] = np.minimum(found, 1.0)
    return np.asarray(good)


def _solves_floors(mass: MassAttributes) -> bool:
    """Tell whether floors are given, but not all: with `relations.completed` one share or far."""
    return None in mass.arf and (mass.far is not None or any(v is not None for v in mass.arf))


def _ratios(mass: MassAttributes, bcr: Floats, r1: Floats, r2: Floats) -> tuple[Floats, Floats]:
    """Return r1 and r2 that meet the given share of a floor, or far, the other one as drawn."""
    first, second, third = mass.arf
    with np.errstate(divide="ignore", invalid="ignore"):
        if third is not None:
            needed = third * (1.0 + r1) / (r1 * (1.0 - third))
            return r1, np.where(r1 > ATOM_TOLERANCE, needed, 0.0 if third == 0 else np.inf)
        if second is not None:
            return second / (1.0 - second * (1.0 + r2)), r2
        far = bcr / first if first is not None else mass.far or 0.0
        return (far / bcr - 1.0) / (1.0 + r2), r2


def _solve_boundary(columns: Columns, mass: MassAttributes) -> Masks:
    """Meet a given bdry by x, in place, and tell where the plan allows as little as that."""
    sides = columns.get("width", "depth", "bcr")
    if not sides or mass.bdry is None:
        return np.asarray(True)
    ratio = mass.bdry / least_bdry(*sides)
    free = None in (*mass.bbox[:2], mass.bcr)
    x = columns.get("x")
    if x and free:
        x[0][:] = np.maximum(ratio, 1.0)
    return np.asarray(ratio >= 1 - (NEAR if free else ROUNDED))


def _with_solved(held: tuple[Bits, ...], layout: Layout, mass: MassAttributes) -> tuple[Bits, ...]:
    """Return what must stay, with the floors that `_solve_floors` has found."""
    if not _solves_floors(mass):
        return held
    floors = [[c.name in ("bcr", "r1", "r2") for c in group.coordinates] for group in layout.groups]
    return tuple(
        np.maximum(mask, np.array(row, dtype=np.int8))
        for mask, row in zip(held, floors, strict=True)
    )


# --- values as they came ------------------------------------------------------------------------


def overlaid(sample: Attributes, given: Attributes) -> Attributes:
    """Return the sample with every observed number of `given` in its own digits.

    A storey height that is not stated stays the sample's, which suits its floors.
    """
    return replace(
        sample,
        mass=_merge(sample.mass, given.mass),
        facade=_merge(sample.facade, given.facade),
        element=_merge(sample.element, given.element),
        storey_height=given.storey_height if states_storeys(given) else sample.storey_height,
        bounds=given.bounds,
        tags={**sample.tags, **given.tags},
    )


def _merge(drawn: Any, given: Any) -> Any:
    """Return `given` where it is observed, `drawn` elsewhere, field by field."""
    if given is None:
        return drawn
    if isinstance(given, dict):
        return {key: _merge(drawn[key], item) for key, item in given.items()}
    if isinstance(given, tuple):
        return tuple(_merge(a, b) for a, b in zip(drawn, given, strict=True))
    if hasattr(given, "__dataclass_fields__"):
        names = [f.name for f in fields(given)]
        return replace(drawn, **{n: _merge(getattr(drawn, n), getattr(given, n)) for n in names})
    return given


def distances(points: Floats, others: Floats) -> Floats:
    """Return root mean square distances (n, m) over the coordinates that both show.

    Each coordinate is a pair of columns (`neighbours.embed`); NaN where nobody observed it.
    """
    known = np.isfinite(others)
    filled = np.where(known, others, 0.0)
    square = (points**2) @ known.T - 2 * points @ filled.T + (filled**2).sum(axis=1)
    shared = np.maximum(known.sum(axis=1) / 2, 1)
    return np.asarray(np.sqrt(np.maximum(square, 0.0) / shared))
