"""What a model is over: groups of coordinates and their atoms, and bits; without any reading."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from .groups import BIT_GROUPS, GROUPS, BitGroup, Boundary, Coordinate, Group, declared

VALUE = "value"  # the state of a coordinate that is at none of its atoms
UNBOUNDED = 1e300  # the end of the range of a table's columns; those of buildings have a nearer one


@dataclass(frozen=True, slots=True)
class Channel:
    """A discrete variable of a group: which atom a coordinate is at, or whether a part exists.

    coordinate: the index of the coordinate in its group, −1 for a part. atoms: the values of the
    states after the first.
    """

    name: str
    states: tuple[str, ...]
    coordinate: int = -1
    atoms: tuple[float, ...] = ()


@dataclass(frozen=True)
class GroupLayout:
    """Coordinates and channels of one group.

    part: index of the channel that says whether a coordinate exists, −1 where it always does.
    """

    name: str
    level: str
    coordinates: tuple[Coordinate, ...]
    channels: tuple[Channel, ...]
    part: tuple[int, ...]

    @cached_property
    def channel_of(self) -> tuple[int, ...]:
        """Return for each coordinate the channel of its atoms, −1 without."""
        places = {c.coordinate: i for i, c in enumerate(self.channels) if c.coordinate >= 0}
        return tuple(places.get(i, -1) for i in range(len(self.coordinates)))

    @cached_property
    def features(self) -> tuple[str, ...]:
        """Return the names under which children in the network see this group."""
        values = [c.name for c in self.coordinates]
        return (*values, *(f"{c.name}={s}" for c in self.channels for s in c.states[1:]))


@dataclass(frozen=True)
class Layout:
    """All groups and all vectors of bits."""

    groups: tuple[GroupLayout, ...]
    bit_groups: tuple[BitGroup, ...]
    boundary: Boundary = "x"

    @cached_property
    def is_table(self) -> bool:
        """Tell whether this is over the columns of a table, which have no range: no buildings."""
        if any(group.level != "table" or max(group.part, default=-1) >= 0 for group in self.groups):
            return False
        ends = [c.most for group in self.groups for c in group.coordinates]
        return bool(ends) and min(ends) >= UNBOUNDED

    @cached_property
    def bits(self) -> tuple[str, ...]:
        """Return the names of all bits."""
        return tuple(f"{group.name}.{bit}" for group in self.bit_groups for bit in group.bits)

    @cached_property
    def features(self) -> tuple[str, ...]:
        """Return the names of all features, groups first, then bits."""
        return (*(name for group in self.groups for name in group.features), *self.bits)

    @cached_property
    def feature_group(self) -> tuple[int, ...]:
        """Return the group of each feature; bits count as group −1."""
        rows = [i for i, group in enumerate(self.groups) for _ in group.features]
        return (*rows, *([-1] * len(self.bits)))


def group_layout(group: Group, plain: bool = False) -> GroupLayout:
    """Return the layout of a declared group; `plain` models coordinates in their own unit."""
    parts = tuple(Channel(name, ("absent", "present")) for name in group.parts)
    coordinates = tuple(replace(c, transform="identity") if plain else c for c in group.coordinates)
    atoms = tuple(atom_channel(c, i) for i, c in enumerate(coordinates) if c.atoms)
    places = tuple(group.part_of(i) for i in range(len(coordinates)))
    return GroupLayout(group.name, group.level, coordinates, parts + atoms, places)


def atom_channel(coordinate: Coordinate, index: int) -> Channel:
    """Return the channel of a coordinate's atoms."""
    names = (VALUE, *(f"{atom:g}" for atom in coordinate.atoms))
    return Channel(coordinate.name, names, index, coordinate.atoms)


def building_layout(
    boundary: Boundary = "x", groups: tuple[Group, ...] = GROUPS, *, plain: bool = False
) -> Layout:
    """Return the layout of buildings."""
    rows = tuple(group_layout(group, plain) for group in declared(boundary, groups))
    return Layout(rows, BIT_GROUPS, boundary)


def merged(layout: Layout) -> Layout:
    """Return the layout with all groups under one hidden variable (the plain mixture)."""
    coordinates: list[Coordinate] = []
    channels: list[Channel] = []
    part: list[int] = []
    for group in layout.groups:
        first, before = len(coordinates), len(channels)
        coordinates += group.coordinates
        part += [-1 if p < 0 else p + before for p in group.part]
        channels += [
            Channel(c.name, c.states, c.coordinate + first if c.coordinate >= 0 else -1, c.atoms)
            for c in group.channels
        ]
    one = GroupLayout("all", "table", tuple(coordinates), tuple(channels), tuple(part))
    return Layout((one,), layout.bit_groups, layout.boundary)
