"""A style sheet: shape and texture layer of a Manhattan-world building (LNSW13 3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from .blocks import BlockRole
from .building import Side
from .provenance import Provenance

Polyline = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class StyleBlock:
    """A block of the source: size (width, depth, height; m) and number of storeys."""

    id: str
    role: BlockRole
    size: tuple[float, ...]
    floors: int


@dataclass(frozen=True, slots=True)
class StyleFloor:
    """One slab of a block; all lengths in metres from the block's corner of least coordinates.

    cells: plan between the lines `ys` (a row each, from front to back) and `xs`, 1 inside.
    """

    block: str
    bottom: float
    top: float
    xs: tuple[float, ...]
    ys: tuple[float, ...]
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Thickness:
    """How far a wall's outer and inner boundary lie inside the block's side (m)."""

    outer: float = field(metadata={"keep": True})
    inner: float = field(metadata={"keep": True})


@dataclass(frozen=True, slots=True)
class StyleFace:
    """An upright face; start and end run from left to right as seen from outside.

    start, end, place, bottom, top: metres in the block's coordinates. texture: file in the sheet's
    folder. horizontal, vertical: ids of its consistent groups (rows of the horizontal group's rule
    split it vertically, columns of the vertical group's rule horizontally).
    """

    floor: int = field(metadata={"keep": True})
    place: float = field(metadata={"keep": True})
    start: float = field(metadata={"keep": True})
    end: float = field(metadata={"keep": True})
    bottom: float = field(metadata={"keep": True})
    top: float = field(metadata={"keep": True})
    texture: str
    horizontal: str
    vertical: str


@dataclass(frozen=True, slots=True)
class Wall:
    """One side of one block."""

    block: str
    side: Side
    thickness: Thickness
    floors: tuple[Polyline, ...]
    faces: tuple[StyleFace, ...]


@dataclass(frozen=True, slots=True)
class Group:
    """Faces that share a splitting rule."""

    id: str
    direction: Literal["horizontal", "vertical"]
    rule: str


@dataclass(frozen=True, slots=True)
class Rule:
    """Widths (m) of scalable sections around insertable ones; one scalable more."""

    id: str
    a: tuple[float, ...]
    b: tuple[float, ...] = field(default=(), metadata={"keep": True})


@dataclass(frozen=True, slots=True)
class StyleSheet:
    """The look of a building: `density` pixels a metre of its textures, `roof` the view from above.

    resolution: pixels a metre of the source's own textures, where they are finer or coarser.
    lost: share of the source's surface that its Manhattan model does not stand for.
    """

    kind: ClassVar[str] = "stylesheet"

    id: str
    blocks: tuple[StyleBlock, ...]
    floors: tuple[StyleFloor, ...]
    walls: tuple[Wall, ...]
    groups: tuple[Group, ...]
    rules: tuple[Rule, ...]
    density: float
    roof: str
    front: float = field(default=180.0, metadata={"keep": True})
    lost: float = field(default=0.0, metadata={"keep": True})
    notes: tuple[str, ...] = ()
    resolution: float | None = None
    tags: Mapping[str, object] = field(default_factory=dict)
    provenance: Provenance | None = None
