"""What a grammar reads in a photograph: regions, floors, columns, and the derivation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from .grammar import Node
from .provenance import Provenance

LABELS = ("outlier", "window", "wall", "balcony", "door", "roof", "sky", "shop", "chimney")


@dataclass(frozen=True, slots=True)
class ImageInfo:
    """The photograph: file name, SHA-256 of the file, [width, height] of the rectified image."""

    name: str
    size: tuple[int, ...]
    sha256: str


@dataclass(frozen=True, slots=True)
class Region:
    """Half-open rectangle of one label, pixels of the rectified image, y down.

    confidence: mean probability that the classifier gives the label there.
    """

    label: str
    x0: int
    y0: int
    x1: int
    y1: int
    confidence: float | None = None


@dataclass(frozen=True, slots=True)
class Floor:
    """One storey: its rows y0 to y1 (pixels, y down) and the borders of its columns."""

    symbol: str
    y0: int
    y1: int
    columns: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Parse:
    """A parsed picture; regions tile the rectified image.

    rectification: 3×3, from pixels of the photograph to those of the rectified image. working:
    [width, height] at which the energy is summed. bound: what no derivation of the grammar (with
    common columns) can beat; `optimal` says that the energy reaches it.
    """

    kind: ClassVar[str] = "parse"

    id: str
    image: ImageInfo
    rectification: tuple[tuple[float, ...], ...] = field(metadata={"keep": True})
    method: str
    solver: str
    grammar: str
    classifier: str
    energy: float
    working: tuple[int, ...]
    regions: tuple[Region, ...] = field(metadata={"keep": True})
    floors: tuple[Floor, ...] = field(default=(), metadata={"keep": True})
    columns: tuple[int, ...] = field(default=(), metadata={"keep": True})
    bound: float | None = None
    optimal: bool = field(default=False, metadata={"keep": True})
    trace: tuple[float, ...] = field(default=(), metadata={"keep": True})
    derivation: Node | None = None
    tags: Mapping[str, object] = field(default_factory=dict)
    provenance: Provenance | None = None
