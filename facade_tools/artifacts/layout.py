"""A solved design: words, columns, sizes and the grid of shapes (IMAW15)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from .design import Canvas
from .provenance import Provenance

Names = tuple[str, ...]
KEEP: dict[str, Any] = {"keep": True}


@dataclass(frozen=True, slots=True)
class Group:
    """The solution of one alignment group in one direction.

    words[layer]; columns[layer][column] (ε is empty); alignment_error Ω (m); tolerance: µ as a
    share of the canvas; boundaries: of the columns (m); sizes (m) of the direction's symbols;
    residual: Σ over the direction's sized symbols of the squared deviation (m²); borders: of each
    layer's letters or pieces, in the order of its columns (m); pieces: number of split pieces;
    gap: how far Ω may be from the least one (m), 0 when optimal.
    """

    layers: Names = field(metadata=KEEP)
    words: tuple[Names, ...] = field(metadata=KEEP)
    counters: Mapping[str, int] = field(metadata=KEEP)
    columns: tuple[tuple[Names, ...], ...] = field(metadata=KEEP)
    alignment_error: float = field(metadata=KEEP)
    tolerance: float = field(metadata=KEEP)
    boundaries: tuple[float, ...] = field(metadata=KEEP)
    sizes: Mapping[str, float] = field(metadata=KEEP)
    residual: float = field(metadata=KEEP)
    optimal: bool = field(metadata=KEEP)
    gap: float = field(default=0.0, metadata=KEEP)
    pieces: int = field(default=0, metadata=KEEP)
    borders: tuple[tuple[float, ...], ...] = field(default=(), metadata=KEEP)
    unsized: Names = field(default=(), metadata=KEEP)


@dataclass(frozen=True, slots=True)
class LayoutShape:
    """One cell of a layer's grid; x, y from the canvas's lower left, m; depth of its front, m.

    symbols: of x and y, `~` before a mirrored one. visible: neither transparent, nor masked, nor
    wholly behind a nearer shape.
    """

    layer: str
    symbols: Names
    x0: float
    y0: float
    x1: float
    y1: float
    depth: float = field(default=0.0, metadata=KEEP)
    visible: bool = field(default=True, metadata=KEEP)
    thickness: float | None = None
    color: str | None = None
    mesh: str | None = None
    texture: str | None = None
    element: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Layout:
    """Both directions, group by group, and the shapes; `assets`: the files that shapes name.

    An asset is {media, data}: the text of an OBJ file, or a picture in base64.
    """

    kind: ClassVar[str] = "layout"

    id: str
    canvas: Canvas
    x: Mapping[str, Group]
    y: Mapping[str, Group]
    shapes: tuple[LayoutShape, ...]
    assets: Mapping[str, Any] = field(default_factory=dict)
    tags: Mapping[str, object] = field(default_factory=dict)
    provenance: Provenance | None = None
