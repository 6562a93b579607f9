"""What a shape grammar made of a footprint: the tree, and the closed mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from .building import Frame
from .grammar import Geometry, Node
from .provenance import Provenance
from .shape_grammar import Terminal


@dataclass(frozen=True, slots=True)
class Derivation:
    """The tree of a derivation; its leaves carry the geometry, its inner nodes the history.

    mass: the closed solid of the volumes and roofs. terminals: what the leaves look like.
    parameters: the values that were drawn.
    """

    kind: ClassVar[str] = "derivation"

    id: str
    grammar: str
    root: Node
    mass: Geometry
    terminals: Mapping[str, Terminal]
    parameters: Mapping[str, float] = field(default_factory=dict)
    frame: Frame | None = None
    provenance: Provenance | None = None
