"""A facade design: patterns on a stack of layers (IMAW15)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from .provenance import Provenance

Reflection = Literal["reverse", "mirror", "reverse-mirror"]


@dataclass(frozen=True, slots=True)
class Canvas:
    """The facade's width and height, metres."""

    width: float
    height: float


@dataclass(frozen=True, slots=True)
class DesignSymbol:
    """A symbol's preferred size (m; None: unsized), alignment qualifiers, colour of its drawing."""

    size: float | None = None
    opaque: bool = True
    attached: bool = False
    unoccludable: bool = False
    transparent: bool = False
    color: str | None = None


@dataclass(frozen=True, slots=True)
class Appearance:
    """What a shape looks like; None leaves it to what is less specific.

    depth: of its front before the canvas, m. thickness: of its box, m. mesh, texture: file names
    relative to the design. element: what the shape is on a building's facade, e.g.
    `{kind: window, style: sash}`.
    """

    color: str | None = None
    mesh: str | None = None
    texture: str | None = None
    depth: float | None = None
    thickness: float | None = None
    visible: bool | None = None
    element: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class DesignLayer:
    """One layer: names of its patterns, its mask (`visible` symbols), its depth (m).

    group: alignment group, one name for both directions, or {x, y}.
    """

    x: str
    y: str
    name: str = ""
    visible: tuple[str, ...] | None = None
    depth: float = 0.0
    group: Any = None
    enabled: bool = True
    shapes: Mapping[str, Appearance] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Design:
    """Canvas, symbols, counters, patterns and layers (the first is the topmost).

    counters: a number, `auto`, or {min, max}. patterns: the text of a pattern, or an object with
    `pattern` or `control` and what its substituted symbols stand for.
    """

    kind: ClassVar[str] = "design"

    canvas: Canvas
    symbols: Mapping[str, DesignSymbol]
    patterns: Mapping[str, Any]
    layers: tuple[DesignLayer, ...]
    counters: Mapping[str, Any] = field(default_factory=dict)
    shapes: Mapping[str, Appearance] = field(default_factory=dict)
    reflection: Reflection = "reverse-mirror"
    id: str = ""
    tags: Mapping[str, object] = field(default_factory=dict)
    provenance: Provenance | None = None
