"""The learned model of building exteriors (FW16 5): plain numbers, no pickle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from .provenance import Provenance

Vector = tuple[float, ...]
Matrix = tuple[Vector, ...]
Tensor = tuple[Matrix, ...]

KEEP = {"keep": True}


@dataclass(frozen=True, slots=True)
class ModelCoordinate:
    """One free coordinate: standardised = (transform(value) − center) / scale.

    transform: identity, log, logit or log-above-1 (log(value − 0.95)). floor: least standard
    deviation, least and most: range, own unit. part: the channel that says whether it exists.
    """

    name: str
    transform: str
    center: float = field(metadata=KEEP)
    scale: float = field(metadata=KEEP)
    floor: float = field(metadata=KEEP)
    least: float = field(default=0.0, metadata=KEEP)
    most: float = field(default=1.0, metadata=KEEP)
    atoms: Vector = ()
    part: str | None = None


@dataclass(frozen=True, slots=True)
class ModelChannel:
    """A discrete variable of a group; probabilities (clusters, states).

    coordinate: the coordinate whose atoms the states after the first are; none for a part.
    """

    name: str
    states: tuple[str, ...]
    probabilities: Matrix = field(metadata=KEEP)
    coordinate: str | None = None


@dataclass(frozen=True, slots=True)
class ModelGroup:
    """One group under its hidden variable H.

    hidden: P(H | S), (styles, clusters). inputs: what its lateral parents show it. Given cluster k
    the standardised coordinates are normal: mean coefficients[k] @ (1, inputs), covariances[k].
    direct: it hangs on S itself (hidden is the unit matrix).
    """

    name: str
    level: str
    coordinates: tuple[ModelCoordinate, ...] = field(metadata=KEEP)
    channels: tuple[ModelChannel, ...] = field(metadata=KEEP)
    hidden: Matrix = field(metadata=KEEP)
    inputs: tuple[str, ...] = field(metadata=KEEP)
    coefficients: Tensor = field(metadata=KEEP)
    covariances: Tensor = field(metadata=KEEP)
    direct: bool = False


@dataclass(frozen=True, slots=True)
class ModelBits:
    """A vector of bits on S: P(bit = 1 | S), (styles, bits)."""

    name: str
    bits: tuple[str, ...] = field(metadata=KEEP)
    probabilities: Matrix = field(metadata=KEEP)


@dataclass(frozen=True, slots=True)
class Configuration:
    """One structure that the search tried: cardinalities, lateral edges, Cheeseman-Stutz score."""

    style: int
    hidden: tuple[int, ...]
    score: float = field(metadata=KEEP)
    edges: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class TrainingRows:
    """Training rows for nearest neighbours: own units, null where unobserved or absent."""

    ids: tuple[str, ...] = field(metadata=KEEP)
    values: tuple[tuple[float | None, ...], ...] = field(metadata=KEEP)


@dataclass(frozen=True, slots=True)
class Model:
    """A learned model; `boundary` says whether x or bdry itself is the coordinate (docs)."""

    kind: ClassVar[str] = "model"

    id: str
    variant: str
    boundary: str
    count: int
    style: Vector
    elements: tuple[ModelBits, ...] = field(metadata=KEEP)
    groups: tuple[ModelGroup, ...] = field(metadata=KEEP)
    faithful: bool = False
    cardinalities: Mapping[str, int] = field(default_factory=dict, metadata=KEEP)
    edges: tuple[tuple[str, ...], ...] = field(default=(), metadata=KEEP)
    score: float | None = None
    trace: Vector = field(default=(), metadata=KEEP)
    search: tuple[Configuration, ...] = field(default=(), metadata=KEEP)
    unobserved: tuple[str, ...] = field(default=(), metadata=KEEP)
    storey_height: float = field(default=3.0, metadata=KEEP)
    training: TrainingRows | None = None
    provenance: Provenance | None = None
