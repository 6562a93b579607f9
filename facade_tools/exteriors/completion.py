"""Completions of a partly observed building: draws given it, constraints met, values untouched."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..artifacts.attributes import Attributes
from ..errors import Infeasible
from .conditioning import draw_given, resampled
from .coordinates import Bits, Floats, Readings, read_attributes
from .dataset import Masks
from .groups import Group, least_bdry
from .layout import Layout
from .network import Network
from .physical import Columns, settle
from .sampling import Draws
from .shared_values import SharedValues, take_up

BLOCK = 1024  # weighted draws of one resampling
ATTEMPTS = 40  # blocks without one possible draw before completion gives up


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
    row = read_attributes([given], network.layout, groups)
    fixed = tuple((~np.isnan(v)).astype(np.int8) for v in row.values)
    failures = 0
    while True:
        particles = draw_given(network, row, BLOCK, rng=rng, style=style)
        draws = resampled(particles, rng=rng)
        held = tuple(np.tile(f, (len(draws.style), 1)) for f in fixed)
        take_up(draws.readings.values, shared, rng=rng, fixed=held)
        possible = accept(draws.readings, network, given, held)
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
    """Settle rows in place and tell which (n,) are possible with what is given (`held`)."""
    layout = network.layout
    _solve(rows, layout_columns(rows, network), given)
    settle(rows.values, layout, _with_solved(held, layout, given))
    columns = layout_columns(rows, network)
    good = np.ones(len(rows), dtype=np.bool_)
    sizes = columns.get("width", "depth", "height")
    if given.bounds is not None and sizes:
        for column, least in zip(sizes, given.bounds.bbox_min, strict=True):
            good &= column >= least * (1 - 1e-12)
    for name in ("r1", "x"):
        found = columns.get(name)
        if found:
            low, high = (0.0, 1.0) if name == "r1" else (1.0, np.inf)
            good &= (found[0] >= low - 1e-9) & (found[0] <= high + 1e-9)
    return good & _garage_fits(columns)


def layout_columns(rows: Readings, network: Network) -> Columns:
    """Return the rows' coordinates by name."""
    return Columns(rows.values, network.layout)


def _garage_fits(columns: Columns) -> Masks:
    good: Any = True
    for size in ("width", "depth", "height"):
        pair = columns.get(size, f"garage.{size}")
        if pair:
            house, garage = pair
            good = good & (~np.isfinite(garage) | (garage <= house * (1 + 1e-9)))
    return np.asarray(good)


def _solve(rows: Readings, columns: Columns, given: Attributes) -> None:
    """Meet given numbers that only together with drawn ones fix a free coordinate.

    far without arf fixes r1, bdry without w, d or bcr fixes x, once the others are drawn.
    """
    floors = columns.get("bcr", "r1", "r2")
    if floors and given.mass.far is not None and given.mass.arf[1] is None:
        bcr, r1, r2 = floors
        upper = 1.0 + np.where(np.isfinite(r2), r2, 0.0)
        r1[:] = (given.mass.far / bcr - 1.0) / upper
    sides = columns.get("width", "depth", "bcr", "x")
    known = (*given.mass.bbox[:2], given.mass.bcr)
    if sides and given.mass.bdry is not None and None in known:
        w, d, bcr, x = sides
        x[:] = given.mass.bdry / least_bdry(w, d, bcr)


def _with_solved(held: tuple[Bits, ...], layout: Layout, given: Attributes) -> tuple[Bits, ...]:
    """Return what must stay, with the floors that `_solve` has found for a given far."""
    if given.mass.far is None or given.mass.arf[1] is not None:
        return held
    floors = [[c.name in ("r1", "r2") for c in group.coordinates] for group in layout.groups]
    return tuple(
        np.maximum(mask, np.array(row, dtype=np.int8))
        for mask, row in zip(held, floors, strict=True)
    )


# --- values as they came ------------------------------------------------------------------------


def overlaid(sample: Attributes, given: Attributes) -> Attributes:
    """Return the sample with every observed number of `given` in its own digits."""
    return replace(
        sample,
        mass=_merge(sample.mass, given.mass),
        facade=_merge(sample.facade, given.facade),
        element=_merge(sample.element, given.element),
        storey_height=given.storey_height,
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
