"""The element library of facade generation: what windows and doors training buildings have."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from .attributes import Attributes
from .building import Colors, ElementKind
from .provenance import Provenance

PartSide = Literal["front", "back", "end"]
Level = Literal["ground", "upper"]


@dataclass(frozen=True, slots=True)
class Substyle:
    """One of at most five sizes of a style: a k-means centre of width and height (m)."""

    kind: ElementKind
    style: str
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Part:
    """What one building has of one substyle on one kind of side and level.

    substyle: index. count: elements. width, height: their average (m). head: average height of
    their upper edge above their storey's floor (m).
    """

    substyle: int
    side: PartSide
    level: Level
    count: int
    width: float
    height: float
    head: float


@dataclass(frozen=True, slots=True)
class LibraryBuilding:
    """One training building: its attributes, parts and colours."""

    id: str
    attributes: Attributes
    parts: tuple[Part, ...] = field(default=(), metadata={"keep": True})
    colors: Colors | None = None


@dataclass(frozen=True, slots=True)
class Library:
    """Substyles of all training buildings, and the buildings."""

    kind: ClassVar[str] = "library"

    id: str
    substyles: tuple[Substyle, ...] = field(default=(), metadata={"keep": True})
    buildings: tuple[LibraryBuilding, ...] = field(default=(), metadata={"keep": True})
    provenance: Provenance | None = None
