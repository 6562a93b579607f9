"""How the 49 numbers depend on one another: what follows from known ones, what contradicts.

Of F floors' area, in areas of floor 0, arf is (1, r1, r1·r2) / F and far is bcr · F, with
F = 1 + r1 + r1·r2. No plan has less bdry than a rectangle's or an orthogonally convex one's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import sqrt
from typing import NamedTuple

from ..artifacts.attributes import Attributes, MassAttributes, Number
from ..artifacts.building import Building
from .groups import PART

ROUNDED = 1e-3  # numbers that people state are rounded
MOST_FLOORS = 3
DEFAULT_STOREY = Attributes("").storey_height  # m, what a file says that says nothing
SQUARE = 4.0  # bdry of a square: no rectilinear plan has less
PORCHES = ("front", "back")


class Contradiction(NamedTuple):
    """JSON pointer into the attributes, and what cannot be."""

    pointer: str
    message: str


def completed(row: Attributes) -> Attributes:
    """Return a row with what follows: arf of two shares, arf₀ and bcr with far, parts of size 0."""
    mass = row.mass
    bcr, far, arf = mass.bcr, mass.far, _third(mass.arf)
    if arf[0] is None and far and bcr:
        arf = _third((min(max(bcr / far, 1 / MOST_FLOORS), 1.0), *arf[1:]))
    if bcr is None and far and arf[0]:
        bcr = min(far * arf[0], 1.0)
    garage, porch = _whole(mass.garage), tuple(map(_whole, mass.porch))
    return replace(row, mass=replace(mass, bcr=bcr, arf=arf, garage=garage, porch=porch))


def _whole(part: tuple[Number, ...]) -> tuple[Number, ...]:
    """Return a part of which one size is 0, and nothing else known, as the absent one it is."""
    return (0.0,) * len(part) if 0 in part[2:5] and not any(part) else part


def _third(arf: tuple[Number, ...]) -> tuple[Number, ...]:
    """Return the shares of three floors, the third filled in where two are known."""
    first, second, third = arf
    if first is not None and first >= 1.0:
        second, third = second or 0.0, third or 0.0
    if second == 0.0:
        third = third or 0.0
    if first is None and second is not None and third is not None:
        first = max(1.0 - second - third, 0.0)
    if second is None and first is not None and third is not None:
        second = max(1.0 - first - third, 0.0)
    if third is None and first is not None and second is not None:
        third = max(1.0 - first - second, 0.0)
    return first, second, third


def states_storeys(row: Attributes | Building) -> bool:
    """Tell whether a storey height is stated; the default, 3 m, counts as not stated."""
    return row.storey_height != DEFAULT_STOREY


def contradictions(row: Attributes) -> Iterator[Contradiction]:
    """Yield what the known numbers of a row say against each other; the unknown ones are free.

    Sums and products are compared as far as people round (0.001).
    """
    mass, filled = row.mass, completed(row).mass
    yield from _floor_contradictions(filled)
    yield from _boundary_contradictions(filled)
    yield from _part_contradictions("/mass/garage", filled.garage)
    yield from _garage_contradictions(mass)
    for i, (porch, name) in enumerate(zip(filled.porch, PORCHES, strict=True)):
        yield from _part_contradictions(f"/mass/porch/{i}", porch)
        py = porch[1]
        if (
            py is not None
            and any(porch)
            and (py >= 0.5 + ROUNDED if i == 0 else py < 0.5 - ROUNDED)
        ):
            message = (
                f"{py:g}; a {name} porch has its centre {'before' if i == 0 else 'behind'} 0.5"
            )
            yield Contradiction(f"/mass/porch/{i}/1", message)
    yield from _presence_contradictions(row)
    roof = row.element.roof.values()
    if roof and all(bit == 0 for bit in roof):
        yield Contradiction("/element/roof", "no kind of roof; expected at least one 1")


def _floor_contradictions(mass: MassAttributes) -> Iterator[Contradiction]:
    bcr, far, arf = mass.bcr, mass.far, mass.arf
    for i, least in enumerate((1 / MOST_FLOORS, 0.0, 0.0)):
        share = arf[i]
        if share is not None and not least - ROUNDED <= share <= 1 / (i + 1) + ROUNDED:
            message = f"{share:g}; expected {least:.3g} to {1 / (i + 1):.3g}"
            yield Contradiction(f"/mass/arf/{i}", message)
    known = [share for share in arf if share is not None]
    if any(after > before + ROUNDED for before, after in pairwise(known)):
        yield Contradiction("/mass/arf", f"{_list(arf)}; a floor is larger than the one below")
    if len(known) == MOST_FLOORS and abs(sum(known) - 1) > ROUNDED:
        yield Contradiction("/mass/arf", f"{_list(arf)} sum to {sum(known):.4g}; expected 1")
    if far is not None and bcr is not None:
        if not 1 - ROUNDED <= far / bcr <= MOST_FLOORS + ROUNDED:
            message = f"{far:g} at a bcr of {bcr:.4g}; expected 1 to {MOST_FLOORS} times as much"
            yield Contradiction("/mass/far", message)
        elif arf[0] is not None and abs(far * arf[0] - bcr) > ROUNDED * max(1.0, far):
            message = f"{far:g}; far · arf₀ = {far * arf[0]:.4g}, but bcr is {bcr:.4g}"
            yield Contradiction("/mass/far", message)
    elif far is not None and far > MOST_FLOORS:
        yield Contradiction("/mass/far", f"{far:g}; expected at most {MOST_FLOORS}")


def _boundary_contradictions(mass: MassAttributes) -> Iterator[Contradiction]:
    if mass.bdry is None:
        return
    width, depth, _ = mass.bbox
    least = SQUARE
    if width and depth:
        least = 2 * (width + depth) / sqrt(width * depth * (mass.bcr or 1.0))
    if mass.bdry < least * (1 - ROUNDED):
        yield Contradiction("/mass/bdry", f"{mass.bdry:g}; no such plan has less than {least:.4g}")


def _part_contradictions(pointer: str, part: tuple[Number, ...]) -> Iterator[Contradiction]:
    if all(value == 0 for value in part):
        return
    for i, name in enumerate(PART[2:5], start=2):
        size = part[i]
        if size is not None and size <= 0:
            yield Contradiction(
                f"{pointer}/{i}", f"{name} {size:g}; expected more than 0, or all 0"
            )
    exposure = part[5]
    if exposure is not None and not 0 <= exposure <= 1:
        yield Contradiction(f"{pointer}/5", f"exposure {exposure:g}; expected 0 to 1")


def _garage_contradictions(mass: MassAttributes) -> Iterator[Contradiction]:
    """Yield where a garage is larger than the house's bounding box or leaves it."""
    for i, house in enumerate(mass.bbox):
        size = mass.garage[2 + i]
        if not house or not size:
            continue
        if size > house * (1 + ROUNDED):
            message = f"{size:g} m in a house of {house:g} m"
            yield Contradiction(f"/mass/garage/{2 + i}", message)
            continue
        at = mass.garage[i] if i < 2 else None
        if at is not None and not -ROUNDED <= at - size / house / 2 <= 1 - size / house + ROUNDED:
            yield Contradiction(f"/mass/garage/{i}", f"{at:g}; the garage leaves the house")


def _presence_contradictions(row: Attributes) -> Iterator[Contradiction]:
    if row.present is None:
        return
    parts = {
        "garage": (row.present.garage, row.mass.garage),
        "porch_front": (row.present.porch_front, row.mass.porch[0]),
        "porch_back": (row.present.porch_back, row.mass.porch[1]),
    }
    for name, (there, part) in parts.items():
        if there is False and any(part):
            yield Contradiction(f"/present/{name}", "false, but the part has measures")
        if there and all(value == 0 for value in part):
            yield Contradiction(f"/present/{name}", "true, but all its measures are 0")


def _list(arf: tuple[Number, ...]) -> str:
    return "[" + ", ".join("null" if v is None else f"{v:.4g}" for v in arf) + "]"
