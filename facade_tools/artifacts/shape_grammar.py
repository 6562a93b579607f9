"""Shape grammars in three dimensions as data (KSTTP09 section 2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from .provenance import Provenance

Amount = object  # a number (metres, degrees) or an expression of parameters and of the scope


@dataclass(frozen=True, slots=True)
class Terminal:
    """What a leaf looks like.

    label: window, door, wall, balcony, roof, shop, chimney, ... as in a parse. style: of a window
    or door as in a building, of a balcony `bars` or `solid`. color: sRGB #rrggbb.
    """

    label: str = field(metadata={"keep": True})
    color: str | None = None
    style: str = ""


@dataclass(frozen=True, slots=True)
class Operation:
    """One procedure of a right-hand side.

    First the scope is turned into a `box`, stood `upright`, moved, scaled, turned about its middle,
    extruded, in this order; then it is cut by at most one of split, repeat, mirror, faces, roof.
    `into` names what becomes of it. Sizes are metres, angles degrees.
    """

    box: bool = False
    upright: bool = False
    translate: Mapping[str, Amount] = field(default_factory=dict)
    rotate: Mapping[str, Amount] = field(default_factory=dict)
    scale: Mapping[str, Amount] = field(default_factory=dict)
    extrude: Amount = None
    split: str | None = None
    repeat: str | None = None
    each: Amount = None
    mirror: str | None = None
    faces: Mapping[str, str] = field(default_factory=dict)
    roof: str | None = None
    pitch: Amount = None
    rise: Amount = None
    weights: Mapping[str, Amount] = field(default_factory=dict)
    direction: str | None = None
    into: object = None


@dataclass(frozen=True, slots=True)
class ShapeRule:
    """condition : symbol → shapes; weight: of the rule among those that apply."""

    symbol: str
    do: tuple[Operation, ...] = field(metadata={"keep": True})
    when: str = ""
    weight: float = 1.0


@dataclass(frozen=True, slots=True)
class Lot:
    """The footprint where none is given: a rectangle of width and depth (m)."""

    width: Amount = 10.0
    depth: Amount = 10.0


@dataclass(frozen=True, slots=True)
class ShapeGrammar:
    """Rules that turn a footprint into a building; parameters are evaluated in their order."""

    kind: ClassVar[str] = "shape-grammar"

    id: str
    axiom: str
    rules: tuple[ShapeRule, ...]
    terminals: Mapping[str, Terminal]
    parameters: Mapping[str, Amount] = field(default_factory=dict)
    lot: Lot = field(default_factory=Lot)
    storey_height: Amount = 3.0
    title: str = ""
    provenance: Provenance | None = None
