"""The parametric building: boxes, roofs, facade pieces and their elements (FW16 4.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from .attributes import Attributes
from .provenance import Provenance

Side = Literal["front", "back", "left", "right"]
BoxKind = Literal["general", "garage", "porch"]
RoofStyle = Literal["flat", "gable", "hip", "shed", "cone", "mansard"]
Axis = Literal["x", "y"]
ElementKind = Literal["window", "door", "garage-door"]
MassPart = Literal["mass", "garage", "porch", "roof"]

SIDES: tuple[Side, ...] = ("front", "back", "left", "right")


@dataclass(frozen=True, slots=True)
class Roof:
    """Roof of one box.

    pitch: degrees (ignored by flat). direction: the axis along which the ridge runs; of a shed,
    the axis along which it falls, towards the front (y) or the left (x). overhang: metres that
    the eaves stand out of the wall.
    """

    style: RoofStyle
    pitch: float = field(default=0.0, metadata={"keep": True})
    direction: Axis = field(default="x", metadata={"keep": True})
    overhang: float = 0.0


@dataclass(frozen=True, slots=True)
class Box:
    """Axis-aligned box on the ground; (x, y) is the centre in plan, all lengths in metres.

    `height` and `roof` are None only in a partial building.
    """

    id: str
    kind: BoxKind
    x: float
    y: float
    width: float
    depth: float
    height: float | None = None
    roof: Roof | None = None


@dataclass(frozen=True, slots=True)
class Element:
    """Window, door or garage door; (u, v) is its lower left in the piece's frame, metres."""

    kind: ElementKind
    style: str
    u: float
    v: float
    width: float
    height: float
    main: bool = False
    known: bool = False


@dataclass(frozen=True, slots=True)
class Piece:
    """A maximal rectangle of exterior wall of one side; origin is its lower left, metres."""

    id: str
    box: str
    origin: tuple[float, ...]
    width: float
    height: float
    elements: tuple[Element, ...] = field(default=(), metadata={"keep": True})


@dataclass(frozen=True, slots=True)
class Facade:
    """All pieces of one side."""

    pieces: tuple[Piece, ...] = field(default=(), metadata={"keep": True})


@dataclass(frozen=True, slots=True)
class Chimney:
    """A chimney: plan centre, plan size and the height of its top (m)."""

    x: float
    y: float
    width: float
    depth: float
    top: float


@dataclass(frozen=True, slots=True)
class Colors:
    """sRGB colours as #rrggbb."""

    wall: str
    trim: str
    roof: str
    door: str


@dataclass(frozen=True, slots=True)
class Energy:
    """Energy reached by the generators; `residuals` name the attributes that were not met."""

    mass: float | None = None
    facade: float | None = None
    residuals: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Frame:
    """How a building got into its local frame.

    source = rotate(local, `rotation` degrees counter-clockwise) + `shift` (m), in `crs`.
    """

    rotation: float
    shift: tuple[float, ...]
    crs: str = ""


@dataclass(frozen=True, slots=True)
class Building:
    """A building exterior, whole or partial (`partial`: what it does not list is unknown)."""

    kind: ClassVar[str] = "building"

    id: str
    boxes: tuple[Box, ...] = field(metadata={"keep": True})
    facades: Mapping[Side, Facade] = field(default_factory=dict, metadata={"keep": True})
    storey_height: float = field(default=3.0, metadata={"keep": True})
    features: tuple[str, ...] = field(default=(), metadata={"keep": True})
    chimneys: tuple[Chimney, ...] = ()
    colors: Colors | None = None
    partial: bool = False
    complete: tuple[MassPart, ...] = ()
    targets: Attributes | None = None
    energy: Energy | None = None
    frame: Frame | None = None
    tags: Mapping[str, object] = field(default_factory=dict)
    provenance: Provenance | None = None
