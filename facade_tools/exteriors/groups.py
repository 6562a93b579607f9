"""The groups of attributes: declared here and nowhere else.

A group names its free coordinates (transform, atoms, least standard deviation), its parts that
may be absent, and how both are read from and written to an attribute vector. Adding a patio or a
deck is one more `Group` (docs/model.md shows it).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, nan, sqrt
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..artifacts.attributes import (
    ROOF_BITS,
    SPECIAL_BITS,
    WINDOW_BITS,
    Attributes,
    ElementAttributes,
    FacadeAttributes,
    MassAttributes,
)

Level = Literal["mass", "facade", "table"]
Boundary = Literal["x", "bdry"]
TransformName = Literal["identity", "log", "logit", "log-above-1"]
Floats = NDArray[np.float64]
Written = dict[str, Floats]

ATOM_TOLERANCE = 1e-6
METRES = 0.05  # least standard deviation of a length
SHARE = 0.01  # and of everything else
UNKNOWN, ABSENT = nan, inf  # a free coordinate that nobody observed; one that does not exist


@dataclass(frozen=True, slots=True)
class Coordinate:
    """One free coordinate: `floor` its least standard deviation, `least` and `most` its range."""

    name: str
    transform: TransformName
    floor: float = SHARE
    atoms: tuple[float, ...] = ()
    least: float = 0.0
    most: float = 1.0


@dataclass(frozen=True, slots=True)
class Reading:
    """What one row shows of a group: 1, 0, −1 (unknown) a part; own units a coordinate."""

    values: tuple[float, ...]
    parts: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Group:
    """A group of continuous attributes under one hidden variable.

    parts: what may be absent (a garage), each with as many coordinates as the others, in order.
    read: from an attribute vector. write: values (n, coordinates), infinite where a part is absent,
    into columns (n, …) of attribute vectors; they hold what has been written so far.
    """

    name: str
    level: Level
    coordinates: tuple[Coordinate, ...]
    read: Callable[[Attributes], Reading]
    write: Callable[[Written, Floats], None]
    parts: tuple[str, ...] = ()

    def part_of(self, index: int) -> int:
        """Return which part coordinate `index` belongs to, −1 where there are none."""
        return index * len(self.parts) // len(self.coordinates) if self.parts else -1


@dataclass(frozen=True, slots=True)
class BitGroup:
    """A vector of bits that hangs on the root style."""

    name: str
    bits: tuple[str, ...]


def _open(value: float | None) -> float:
    return UNKNOWN if value is None else float(value)


# --- mass ---------------------------------------------------------------------------------------


def _read_bbox(a: Attributes) -> Reading:
    return Reading(tuple(map(_open, a.mass.bbox)))


def _write_bbox(columns: Written, values: Floats) -> None:
    columns["bbox"] = values


def _read_bcr(a: Attributes) -> Reading:
    return Reading((_open(a.mass.bcr),))


def _write_bcr(columns: Written, values: Floats) -> None:
    columns["bcr"] = values[:, 0]


def _read_x(a: Attributes) -> Reading:
    (w, d, _), bcr, bdry = a.mass.bbox, a.mass.bcr, a.mass.bdry
    if w is None or d is None or bcr is None or bdry is None:
        return Reading((UNKNOWN,))
    return Reading((max(bdry * sqrt(bcr * w * d) / (2 * (w + d)), 1.0),))


def least_bdry(w: Floats, d: Floats, bcr: Floats) -> Floats:
    """Return perimeter over root of area of an orthogonally convex plan: no plan has less."""
    return np.asarray(2 * (w + d) / np.sqrt(w * d * bcr))


def _least_bdry(columns: Written) -> Floats:
    return least_bdry(columns["bbox"][:, 0], columns["bbox"][:, 1], columns["bcr"])


def _write_x(columns: Written, values: Floats) -> None:
    columns["bdry"] = values[:, 0] * _least_bdry(columns)


def _read_bdry(a: Attributes) -> Reading:
    return Reading((_open(a.mass.bdry),))


def _write_bdry(columns: Written, values: Floats) -> None:
    columns["bdry"] = np.maximum(values[:, 0], _least_bdry(columns))


def _read_r1(a: Attributes) -> Reading:
    first, second, _ = a.mass.arf
    if first is not None and second is not None and first > 0:
        return Reading((min(second / first, 1.0),))
    if a.mass.far is not None and a.mass.bcr is not None:
        return Reading((0.0 if a.mass.far <= a.mass.bcr + ATOM_TOLERANCE else UNKNOWN,))
    return Reading((UNKNOWN,))


def _write_r1(columns: Written, values: Floats) -> None:
    columns["r1"] = values[:, 0]


def _read_r2(a: Attributes) -> Reading:
    r1 = _read_r1(a).values[0]
    if r1 <= ATOM_TOLERANCE:
        return Reading((ABSENT,))
    _, second, third = a.mass.arf
    known = second is not None and third is not None and second > 0
    return Reading((min(third / second, 1.0) if known else UNKNOWN,))  # type: ignore[operator]


def _write_r2(columns: Written, values: Floats) -> None:
    r1 = columns.pop("r1")
    r2 = np.where(np.isinf(values[:, 0]) | (r1 == 0), 0.0, values[:, 0])
    floors = 1.0 + r1 + r1 * r2
    columns["far"] = columns["bcr"] * floors
    columns["arf"] = np.stack([1.0 / floors, r1 / floors, r1 * r2 / floors], axis=1)


FAR_OUT = 10.0  # a part's centre is at most this many house widths away
LENGTHS = (0.2, 1e4)  # metres
PART = ("px", "py", "width", "depth", "height", "exposure")


def _part_coordinates(name: str) -> tuple[Coordinate, ...]:
    return (
        Coordinate(f"{name}.px", "identity", least=-FAR_OUT, most=FAR_OUT),
        Coordinate(f"{name}.py", "identity", least=-FAR_OUT, most=FAR_OUT),
        *(Coordinate(f"{name}.{size}", "log", METRES, (), *LENGTHS) for size in PART[2:5]),
        Coordinate(f"{name}.exposure", "logit", SHARE, (0.0, 1.0)),
    )


def read_part(values: Sequence[float | None], present: bool | None) -> Reading:
    """Return the reading of a part that may be absent (all six numbers 0)."""
    if present is False or all(value == 0 for value in values):
        return Reading((ABSENT,) * len(values), (0,))
    if present is None and all(value is None for value in values):
        return Reading((UNKNOWN,) * len(values), (-1,))
    return Reading(tuple(map(_open, values)), (1,))


def write_part(values: Floats) -> Floats:
    """Return the numbers of a part (n, d): all 0 where it is absent."""
    return np.where(np.isinf(values), 0.0, values)


def _read_garage(a: Attributes) -> Reading:
    return read_part(a.mass.garage, a.present.garage if a.present else None)


def _write_garage(columns: Written, values: Floats) -> None:
    columns["garage"] = write_part(values)


def _read_porch(a: Attributes) -> Reading:
    flags = (a.present.porch_front, a.present.porch_back) if a.present else (None, None)
    front, back = (read_part(v, flag) for v, flag in zip(a.mass.porch, flags, strict=True))
    return Reading(front.values + back.values, front.parts + back.parts)


def _write_porch(columns: Written, values: Floats) -> None:
    columns["porch"] = write_part(values).reshape(len(values), 2, 6)


# --- facades ------------------------------------------------------------------------------------

SIDES = ("front", "back", "left", "right")


def _facade_group(name: str, atoms: tuple[float, ...]) -> Group:
    def read(a: Attributes) -> Reading:
        return Reading(tuple(map(_open, getattr(a.facade, name))))

    def write(columns: Written, values: Floats) -> None:
        columns[name] = values

    rows = tuple(Coordinate(f"{name}.{side}", "logit", SHARE, atoms) for side in SIDES)
    return Group(name, "facade", rows, read, write)


# --- the declaration ----------------------------------------------------------------------------

BBOX = tuple(Coordinate(name, "log", METRES, (), *LENGTHS) for name in ("width", "depth", "height"))
X = Coordinate("x", "log-above-1", SHARE, (1.0,), 1.0, 100.0)
BDRY = Coordinate("bdry", "log", SHARE, (), 0.1, 1000.0)
PORCHES = (*_part_coordinates("porch_front"), *_part_coordinates("porch_back"))

GROUPS: tuple[Group, ...] = (
    Group("bbox", "mass", BBOX, _read_bbox, _write_bbox),
    Group("bcr", "mass", (Coordinate("bcr", "logit", SHARE, (1.0,)),), _read_bcr, _write_bcr),
    Group("bdry", "mass", (X,), _read_x, _write_x),
    Group("far", "mass", (Coordinate("r1", "logit", SHARE, (0.0, 1.0)),), _read_r1, _write_r1),
    Group("arf", "mass", (Coordinate("r2", "logit", SHARE, (0.0, 1.0)),), _read_r2, _write_r2),
    Group("garage", "mass", _part_coordinates("garage"), _read_garage, _write_garage, ("garage",)),
    Group("porch", "mass", PORCHES, _read_porch, _write_porch, ("porch_front", "porch_back")),
    _facade_group("wwr", (0.0,)),
    _facade_group("sym", (0.0, 1.0)),
    _facade_group("align", (0.0, 1.0)),
)

BIT_GROUPS: tuple[BitGroup, ...] = (
    BitGroup("roof", ROOF_BITS),
    BitGroup("window", WINDOW_BITS),
    BitGroup("special", SPECIAL_BITS),
)


def declared(boundary: Boundary, groups: tuple[Group, ...] = GROUPS) -> tuple[Group, ...]:
    """Return the groups; with boundary `bdry` that number itself stands in place of x."""
    if boundary == "x":
        return groups
    plain = {"coordinates": (BDRY,), "read": _read_bdry, "write": _write_bdry}
    return tuple(replace(g, **plain) if g.name == "bdry" else g for g in groups)  # type: ignore[arg-type]


def assemble(
    identity: str, fields: dict[str, Any], bits: dict[str, dict[str, int]], storey: float
) -> Attributes:
    """Return the attribute vector of what the groups wrote; unknown fields become tags."""
    taken = {name: fields.pop(name) for name in _MASS + _FACADE if name in fields}
    return Attributes(
        id=identity,
        mass=MassAttributes(**{name: taken[name] for name in _MASS if name in taken}),
        facade=FacadeAttributes(**{name: taken[name] for name in _FACADE if name in taken}),
        element=ElementAttributes(**bits),
        storey_height=storey,
        tags=fields,
    )


_MASS = ("bbox", "bcr", "bdry", "far", "arf", "garage", "porch")
_FACADE = ("wwr", "sym", "align")
