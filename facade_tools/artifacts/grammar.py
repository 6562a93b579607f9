"""Split grammars as data, and the tree of a derivation (TSKP10 section 2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from .provenance import Provenance

SplitAxis = Literal["right", "up"]
Deriving = Literal["alike", "each"]


@dataclass(frozen=True, slots=True)
class Size:
    """Size of a part along the split, as a share of the axiom's height.

    min, max: hard bounds. typical, spread: what random facades draw (normal). weight: how much
    a parse pays, in nats, for a size one spread away from the typical: weight / 2.
    """

    min: float = 0.0
    max: float = 10.0
    typical: float | None = None
    spread: float | None = None
    weight: float = 0.0


@dataclass(frozen=True, slots=True)
class Rule:
    """A split rule: the scope of the left-hand side is cut along one axis.

    split: `up` (parts from the bottom) or `right` (from the left). into: regular expression of
    the parts. derive: `alike` (all shapes of the symbol share one set of parameters, the paper's
    factorisation) or `each`. like: another symbol whose parameters are used.
    """

    split: SplitAxis = field(metadata={"keep": True})
    into: str = field(metadata={"keep": True})
    derive: Deriving = "alike"
    like: str | None = None
    sizes: Mapping[str, Size] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Grammar:
    """A split grammar; terminals map their symbols to labels of pixels."""

    kind: ClassVar[str] = "grammar"

    id: str
    axiom: str
    terminals: Mapping[str, str]
    rules: Mapping[str, Rule]
    title: str = ""
    provenance: Provenance | None = None


@dataclass(frozen=True, slots=True)
class Geometry:
    """Planar faces in space: points (m, z up), and per face its outer ring, then holes.

    Rings are indices of points; the outer one runs counter-clockwise seen from outside.
    """

    points: tuple[tuple[float, ...], ...] = field(metadata={"keep": True})
    faces: tuple[tuple[tuple[int, ...], ...], ...] = field(metadata={"keep": True})


@dataclass(frozen=True, slots=True)
class Node:
    """A shape of a derivation: symbol, scope, and the shapes that its rule made of it.

    scope: least corner, then greatest corner, in 2 or 3 coordinates; pixels (y down) in a parse,
    metres elsewhere. split: axis of the rule, or its operator; None at a leaf. label: class of a
    leaf. rule: number of the rule that was applied, of a 3D grammar. geometry: of a leaf in space.
    """

    symbol: str = field(metadata={"keep": True})
    scope: tuple[float, ...] = field(metadata={"keep": True})
    split: str | None = None
    label: str | None = None
    children: tuple[Node, ...] = ()
    rule: int | None = None
    geometry: Geometry | None = None
