"""Blocks of a Manhattan-world building: the base model of a retarget (LNSW13)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from .provenance import Provenance

BlockRole = Literal["bottom", "body", "top"]


@dataclass(frozen=True, slots=True)
class Block:
    """One box of floors; (x, y, z) is its corner of least coordinates, metres."""

    id: str
    role: BlockRole
    x: float
    y: float
    z: float
    width: float
    depth: float
    height: float
    floors: int


@dataclass(frozen=True, slots=True)
class Blocks:
    """Blocks stacked or side by side.

    frame: 4×4, row-major, from block coordinates to the source file's, metres, z up; None is the
    identity.
    """

    kind: ClassVar[str] = "blocks"

    id: str
    blocks: tuple[Block, ...]
    frame: tuple[tuple[float, ...], ...] | None = None
    tags: Mapping[str, object] = field(default_factory=dict)
    provenance: Provenance | None = None
