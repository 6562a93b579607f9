"""Whether a model of buildings is over what `groups` declares: the rest reads rows by that."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from ..errors import InvalidInput
from .groups import GROUPS
from .layout import GroupLayout, Layout, building_layout, merged


def check_declared(layout: Layout) -> None:
    """Raise InvalidInput, with the pointer, where it is over anything else than declared."""
    declared = building_layout(layout.boundary, GROUPS)
    if len(layout.groups) == 1:
        declared = merged(declared)
    _same([g.name for g in layout.groups], [g.name for g in declared.groups], "/groups", "/name")
    for i, (found, wanted) in enumerate(zip(layout.groups, declared.groups, strict=True)):
        pointer = f"/groups/{i}"
        names = [c.name for c in found.coordinates]
        expected = [c.name for c in wanted.coordinates]
        _same(names, expected, f"{pointer}/coordinates", "/name")
        _same(_parts(found), _parts(wanted), f"{pointer}/coordinates", "/part")
        _same(_atoms(found), _atoms(wanted), f"{pointer}/coordinates", "/atoms")
        names, expected = ([c.name for c in g.channels] for g in (found, wanted))
        _same(names, expected, f"{pointer}/channels", "/name")
        for c, (channel, other) in enumerate(zip(found.channels, wanted.channels, strict=True)):
            _same(channel.states, other.states, f"{pointer}/channels/{c}/states", "")
    bits = declared.bit_groups
    _same([b.name for b in layout.bit_groups], [b.name for b in bits], "/elements", "/name")
    for i, (has, lacks) in enumerate(zip(layout.bit_groups, bits, strict=True)):
        _same(has.bits, lacks.bits, f"/elements/{i}/bits", "")


def _parts(group: GroupLayout) -> list[str]:
    return [group.channels[i].name if i >= 0 else "null" for i in group.part]


def _atoms(group: GroupLayout) -> list[str]:
    return [", ".join(f"{atom:g}" for atom in c.atoms) for c in group.coordinates]


def _same(found: Sequence[str], expected: Sequence[str], pointer: str, key: str) -> None:
    for i, (name, wanted) in enumerate(zip_longest(found, expected)):
        if wanted is None:
            raise InvalidInput(f"{name!r} is one too many", pointer=f"{pointer}/{i}")
        if name is None:
            raise InvalidInput(f"ends too early; expected {wanted!r} next", pointer=pointer)
        if name != wanted:
            message = f"is {name!r}; a model of buildings has {wanted!r} here"
            raise InvalidInput(message, pointer=f"{pointer}/{i}{key}")
