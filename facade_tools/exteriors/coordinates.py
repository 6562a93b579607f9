"""Attribute vectors to rows of free coordinates and back.

The 49 numbers depend on one another exactly, so the model stands on free coordinates: own units
outside, an unbounded standardised scale inside, atoms apart (docs/model.md).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..artifacts.attributes import Attributes
from .groups import ABSENT, ATOM_TOLERANCE, GROUPS, UNKNOWN, Group, Written, assemble, declared
from .layout import GroupLayout, Layout

Floats = NDArray[np.float64]
Bits = NDArray[np.int8]

UNSEEN = np.int8(-1)  # state of a channel or bit that nobody observed, or that does not apply


@dataclass(frozen=True, slots=True)
class Readings:
    """Rows in their own units: NaN unobserved, infinite where the part does not exist.

    values: one (n, coordinates) a group; parts: one (n, parts) a group, bits (n, bits); 1, 0, −1.
    """

    ids: tuple[str, ...]
    values: tuple[Floats, ...]
    parts: tuple[Bits, ...]
    bits: Bits

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, rows: NDArray[Any]) -> Readings:
        """Return the rows named by an index or mask array."""
        index = np.arange(len(self))[rows]
        ids = tuple(self.ids[i] for i in index)
        values, parts = (tuple(a[index] for a in part) for part in (self.values, self.parts))
        return Readings(ids, values, parts, self.bits[index])


def stack(first: Readings, second: Readings) -> Readings:
    """Return the rows of both."""
    values = tuple(map(np.concatenate, zip(first.values, second.values, strict=True)))
    parts = tuple(map(np.concatenate, zip(first.parts, second.parts, strict=True)))
    bits = np.concatenate([first.bits, second.bits])
    return Readings(first.ids + second.ids, values, parts, bits)


def read_attributes(
    rows: Iterable[Attributes], layout: Layout, groups: tuple[Group, ...] = GROUPS
) -> Readings:
    """Return the free coordinates of attribute vectors; empty input gives empty arrays."""
    active = declared(layout.boundary, groups)
    ids: list[str] = []
    values: list[list[tuple[float, ...]]] = [[] for _ in active]
    parts: list[list[tuple[int, ...]]] = [[] for _ in active]
    bits: list[list[int]] = []
    for row in rows:
        ids.append(row.id)
        bits.append([-1 if bit is None else int(bit) for bit in _bits(row, layout)])
        for i, group in enumerate(active):
            reading = group.read(row)
            values[i].append(reading.values)
            parts[i].append(reading.parts)
    wide = [_matrix(v, len(g.coordinates), np.float64) for v, g in zip(values, active, strict=True)]
    there = [_matrix(p, len(g.parts), np.int8) for p, g in zip(parts, active, strict=True)]
    out = Readings(tuple(ids), tuple(wide), tuple(there), _matrix(bits, len(layout.bits), np.int8))
    return join(out) if is_merged(layout, active) else out


def is_merged(layout: Layout, groups: tuple[Group, ...]) -> bool:
    """Tell whether the layout keeps all groups as one (`layout.merged`)."""
    return len(layout.groups) == 1 < len(groups)


def _bits(row: Attributes, layout: Layout) -> Iterator[int | None]:
    for group in layout.bit_groups:
        vector = getattr(row.element, group.name, {}) or {}
        yield from (vector.get(bit) for bit in group.bits)


def _matrix(rows: Sequence[Sequence[float]], width: int, kind: Any) -> NDArray[Any]:
    return np.array(rows, dtype=kind).reshape(len(rows), width)


def columns_of(readings: Readings, layout: Layout, groups: tuple[Group, ...] = GROUPS) -> Written:
    """Return the attributes of complete rows by name, each (n, …), parts that are absent 0."""
    active = declared(layout.boundary, groups)
    if is_merged(layout, active):
        readings = split(readings, active)
    columns: Written = {}
    for values, group in zip(readings.values, active, strict=True):
        group.write(columns, values)
    return columns


def write_attributes(
    readings: Readings,
    layout: Layout,
    storey_height: Floats,
    groups: tuple[Group, ...] = GROUPS,
) -> Iterator[Attributes]:
    """Yield the attribute vectors of complete rows."""
    columns = columns_of(readings, layout, groups)
    rows = {name: column.tolist() for name, column in columns.items()}
    bits, heights = readings.bits.tolist(), storey_height.tolist()
    for n, identity in enumerate(readings.ids):
        fields = {name: _tuples(column[n]) for name, column in rows.items()}
        yield assemble(identity, fields, _named_bits(bits[n], layout), heights[n])


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _named_bits(row: list[int], layout: Layout) -> dict[str, dict[str, int]]:
    out, at = {}, 0
    for group in layout.bit_groups:
        out[group.name] = dict(zip(group.bits, row[at : at + len(group.bits)], strict=True))
        at += len(group.bits)
    return out


def states_of(values: Floats, parts: Bits, group: GroupLayout) -> tuple[Bits, NDArray[np.bool_]]:
    """Return the channels' states (n, channels) and which coordinates carry a density (n, d).

    values: own units. A value within 1e-6 of an atom is the atom.
    """
    states = np.full((len(values), len(group.channels)), UNSEEN, dtype=np.int8)
    dense = np.isfinite(values)
    columns = iter(parts.T)
    for c, channel in enumerate(group.channels):
        if channel.coordinate < 0:
            states[:, c] = next(columns)
            continue
        column = values[:, channel.coordinate]
        states[np.isfinite(column), c] = 0
        for s, atom in enumerate(channel.atoms, start=1):
            at = np.abs(column - atom) <= ATOM_TOLERANCE
            states[at, c] = s
            dense[at, channel.coordinate] = False
    return states, dense


def values_of(values: Floats, states: Bits, group: GroupLayout) -> Floats:
    """Return own-unit values with atoms put in and what does not exist set to ABSENT."""
    out = values.copy()
    for c, channel in enumerate(group.channels):
        for s, atom in enumerate(channel.atoms, start=1):
            out[states[:, c] == s, channel.coordinate] = atom
    for i, part in enumerate(group.part):
        if part >= 0:
            out[states[:, part] == 0, i] = ABSENT
    return out


def blank(count: int, layout: Layout, ids: tuple[str, ...]) -> Readings:
    """Return rows with nothing observed."""
    values = tuple(np.full((count, len(g.coordinates)), UNKNOWN) for g in layout.groups)
    parts = tuple(
        np.full((count, sum(c.coordinate < 0 for c in g.channels)), UNSEEN, dtype=np.int8)
        for g in layout.groups
    )
    return Readings(ids, values, parts, np.full((count, len(layout.bits)), UNSEEN, dtype=np.int8))


def join(readings: Readings) -> Readings:
    """Return rows of the merged layout (`layout.merged`): all groups side by side."""
    values = np.concatenate(readings.values, axis=1)
    parts = np.concatenate(readings.parts, axis=1)
    return Readings(readings.ids, (values,), (parts,), readings.bits)


def split(readings: Readings, groups: tuple[Group, ...]) -> Readings:
    """Return rows of the merged layout group by group again."""
    wide = np.cumsum([len(g.coordinates) for g in groups])[:-1]
    there = np.cumsum([len(g.parts) for g in groups])[:-1]
    values = tuple(np.split(readings.values[0], wide, axis=1))
    parts = tuple(np.split(readings.parts[0], there, axis=1))
    return Readings(readings.ids, values, parts, readings.bits)
