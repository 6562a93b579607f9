"""The 49 attributes of a building exterior (FW16, appendix A)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from .provenance import Provenance

Number = float | None  # None: unobserved
Bit = int | None

KEEP = {"keep": True}
ROOF_BITS = ("flat", "gable", "hip")
WINDOW_BITS = ("sash", "sliding", "casement", "bay", "fixed")
SPECIAL_BITS = ("chimney", "tower")


@dataclass(frozen=True, slots=True)
class MassAttributes:
    """Seven groups that describe the mass.

    bbox: width, depth, eaves height (m). bcr: building coverage ratio. bdry: perimeter over root
    of area of floor 0. far: floor area ratio. arf: share of each of three floors in the floor
    area. garage, each porch: centre x, y relative to the bounding box of floor 0, width, depth,
    height (m), exposure; all six 0 where there is none.
    """

    bbox: tuple[Number, ...] = field(default=(None,) * 3, metadata=KEEP)
    bcr: Number = field(default=None, metadata=KEEP)
    bdry: Number = field(default=None, metadata=KEEP)
    far: Number = field(default=None, metadata=KEEP)
    arf: tuple[Number, ...] = field(default=(None,) * 3, metadata=KEEP)
    garage: tuple[Number, ...] = field(default=(None,) * 6, metadata=KEEP)
    porch: tuple[tuple[Number, ...], ...] = field(default=((None,) * 6,) * 2, metadata=KEEP)


@dataclass(frozen=True, slots=True)
class FacadeAttributes:
    """Window-to-wall ratio, symmetry and alignment of front, back, left and right."""

    wwr: tuple[Number, ...] = field(default=(None,) * 4, metadata=KEEP)
    sym: tuple[Number, ...] = field(default=(None,) * 4, metadata=KEEP)
    align: tuple[Number, ...] = field(default=(None,) * 4, metadata=KEEP)


@dataclass(frozen=True, slots=True)
class ElementAttributes:
    """Which styles are present: 1, 0 or None (unobserved)."""

    roof: Mapping[str, Bit] = field(default_factory=lambda: dict.fromkeys(ROOF_BITS), metadata=KEEP)
    window: Mapping[str, Bit] = field(
        default_factory=lambda: dict.fromkeys(WINDOW_BITS), metadata=KEEP
    )
    special: Mapping[str, Bit] = field(
        default_factory=lambda: dict.fromkeys(SPECIAL_BITS), metadata=KEEP
    )


@dataclass(frozen=True, slots=True)
class Present:
    """Whether a part exists when its measures are unknown."""

    garage: bool | None = None
    porch_front: bool | None = None
    porch_back: bool | None = None


@dataclass(frozen=True, slots=True)
class Bounds:
    """Hard limits known of a partial building.

    bbox_min: least width, depth, height (m). low_area: plan area (m²) of listed boxes that are too
    low for floor 1, and for floor 2: nothing is built on them.
    """

    bbox_min: tuple[float, ...]
    low_area: tuple[float, ...] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Sample:
    """Where a drawn vector comes from.

    style: value of S, from 0. log_density: of all coordinates under the model, nats. neighbours:
    for each group of attributes the id of the training building nearest in it. effective: effective
    sample size behind a completion that could not be drawn exactly.
    """

    style: int = field(metadata=KEEP)
    log_density: float = field(metadata=KEEP)
    neighbours: Mapping[str, str] = field(default_factory=dict)
    effective: float | None = None


@dataclass(frozen=True, slots=True)
class Attributes:
    """Attribute vector of one building: 49 numbers, each possibly unobserved."""

    kind: ClassVar[str] = "attributes"

    id: str
    mass: MassAttributes = field(default=MassAttributes(), metadata=KEEP)
    facade: FacadeAttributes = field(default=FacadeAttributes(), metadata=KEEP)
    element: ElementAttributes = field(default_factory=ElementAttributes, metadata=KEEP)
    storey_height: float = field(default=3.0, metadata=KEEP)
    present: Present | None = None
    bounds: Bounds | None = None
    sample: Sample | None = None
    tags: Mapping[str, object] = field(default_factory=dict)
    provenance: Provenance | None = None
