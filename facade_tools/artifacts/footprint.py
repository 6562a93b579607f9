"""A footprint of a map: polygon, eaves height, roof."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from .building import Frame, Roof
from .provenance import Provenance

Ring = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Footprint:
    """Outer ring, then holes (metres, not closed), extruded to the eaves' height (m)."""

    kind: ClassVar[str] = "footprint"

    id: str
    polygon: tuple[Ring, ...]
    height: float
    roof: Roof | None = None
    frame: Frame | None = None
    tags: Mapping[str, object] = field(default_factory=dict)
    provenance: Provenance | None = None
