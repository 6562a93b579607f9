"""Between the network's arrays and the model artifact; a tampered file is refused."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, cast

import numpy as np

from ..artifacts.model import Model, ModelBits, ModelChannel, ModelCoordinate, ModelGroup
from ..errors import InvalidInput
from .coordinates import Floats
from .dataset import Scaling
from .groups import BitGroup, Coordinate
from .layout import Channel, GroupLayout, Layout
from .network import Family, Network, topological
from .transforms import ENDS

TOLERANCE = 1e-6
SCALES = (1e-50, 1e50)  # beyond them squares of standardised numbers overflow
DIGITS = 12  # of a number against its scale; those after them differ between processors


def _tuples(array: Floats) -> Any:
    """Return nested tuples of floats."""
    plain = array.tolist()
    return _frozen(plain)


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


def _rounded(array: Floats, scale: Floats | float) -> Floats:
    """Return numbers without what lies some `DIGITS` decimal places below their scale.

    A covariance that is 0 but for rounding would else be another on each kind of processor.
    """
    quantum = 10.0 ** (np.rint(np.log10(scale)) - DIGITS)
    rounded: Floats = np.rint(array / quantum) * quantum + 0.0
    return rounded


def _covariances(array: Floats) -> Any:
    deviation = np.sqrt(np.diagonal(array, axis1=1, axis2=2))
    return _tuples(_rounded(array, deviation[:, :, None] * deviation[:, None, :]))


# --- arrays to artifact -------------------------------------------------------------------------


def groups_to_model(network: Network) -> tuple[ModelGroup, ...]:
    """Return the artifact's groups."""
    layout = network.layout
    return tuple(
        _group_to_model(group, scaling, family, layout)
        for group, scaling, family in zip(
            layout.groups, network.scalings, network.families, strict=True
        )
    )


def _group_to_model(
    group: GroupLayout, scaling: Scaling, family: Family, layout: Layout
) -> ModelGroup:
    return ModelGroup(
        name=group.name,
        level=group.level,
        coordinates=tuple(_coordinates(group, scaling)),
        channels=tuple(
            ModelChannel(
                c.name,
                c.states,
                _tuples(table),
                group.coordinates[c.coordinate].name if c.coordinate >= 0 else None,
            )
            for c, table in zip(group.channels, family.tables, strict=True)
        ),
        hidden=_tuples(family.hidden),
        inputs=tuple(layout.features[i] for i in family.inputs),
        coefficients=_tuples(_rounded(family.coef, 1.0)),
        covariances=_covariances(family.cov),
        direct=family.direct,
    )


def _coordinates(group: GroupLayout, scaling: Scaling) -> list[ModelCoordinate]:
    return [
        ModelCoordinate(
            c.name,
            c.transform,
            float(scaling.center[i]),
            float(scaling.scale[i]),
            c.floor,
            c.least,
            c.most,
            c.atoms,
            group.channels[part].name if part >= 0 else None,
        )
        for i, (c, part) in enumerate(zip(group.coordinates, group.part, strict=True))
    ]


def bits_to_model(network: Network) -> tuple[ModelBits, ...]:
    """Return the artifact's vectors of bits."""
    out, at = [], 0
    for group in network.layout.bit_groups:
        columns = network.bits[:, at : at + len(group.bits)]
        out.append(ModelBits(group.name, group.bits, _tuples(columns)))
        at += len(group.bits)
    return tuple(out)


# --- artifact to arrays -------------------------------------------------------------------------


@lru_cache(maxsize=8)
def _cached(key: ModelKey) -> Network:
    return _network(key.model)


@dataclass(frozen=True)
class ModelKey:
    """A model compared by identity: its arrays are built once."""

    model: Model

    def __hash__(self) -> int:
        return id(self.model)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ModelKey) and self.model is other.model


def network_of(model: Model) -> Network:
    """Return the model as arrays.

    Raises InvalidInput where it cannot be a model: probabilities that do not sum to 1, a
    covariance that is not positive definite, shapes that disagree, edges in a cycle, names that
    stand twice.
    """
    return _cached(ModelKey(model))


def _network(model: Model) -> Network:
    layout = layout_of(model)
    _unique([g.name for g in model.groups], "/groups")
    _unique(layout.features, "/groups")
    _training(model, layout)
    style = _probabilities(model.style, "/style")
    bits = [_unit(e.probabilities, f"/elements/{i}", len(style), len(e.bits))
            for i, e in enumerate(model.elements)]  # fmt: skip
    families = tuple(_family(g, i, layout, len(style)) for i, g in enumerate(model.groups))
    _scales(model)
    try:
        topological(families, layout)
    except ValueError as error:
        raise InvalidInput(f"{error}; expected an acyclic graph", pointer="/groups") from None
    scalings = tuple(
        Scaling(
            np.array([c.center for c in g.coordinates], dtype=np.float64),
            np.array([c.scale for c in g.coordinates], dtype=np.float64),
        )
        for g in model.groups
    )
    joined = np.concatenate(bits, axis=1) if bits else np.empty((len(style), 0))
    return Network(layout, scalings, style, joined, families)


def layout_of(model: Model) -> Layout:
    """Return what the model is over."""
    groups = tuple(_group_layout(g, f"/groups/{i}") for i, g in enumerate(model.groups))
    bits = tuple(BitGroup(e.name, e.bits) for e in model.elements)
    return Layout(groups, bits, cast("Any", model.boundary))


def _unique(names: Sequence[str], pointer: str) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise InvalidInput(f"{name!r} stands twice; expected unique names", pointer=pointer)


def _scales(model: Model) -> None:
    """Raise InvalidInput where no numbers that a transform takes have such a centre or scale."""
    for i, group in enumerate(model.groups):
        for k, c in enumerate(group.coordinates):
            low, high = ENDS[c.transform]
            rows = (
                ("center", c.center, low - TOLERANCE, high + TOLERANCE),
                ("scale", c.scale, *SCALES),
            )
            for name, value, least, most in rows:
                if not least <= value <= most:
                    message = f"{value:g}; expected {least:g} to {most:g} ({c.transform})"
                    raise InvalidInput(message, pointer=f"/groups/{i}/coordinates/{k}/{name}")


def _training(model: Model, layout: Layout) -> None:
    """Raise InvalidInput where the training rows have another shape than the model."""
    if model.training is None:
        return
    ids, rows = model.training.ids, model.training.values
    if len(ids) != len(rows):
        message = f"holds {len(rows)} rows; expected {len(ids)}, one an id"
        raise InvalidInput(message, pointer="/training/values")
    width = sum(len(group.coordinates) for group in layout.groups) + len(layout.bits)
    for i, row in enumerate(rows):
        if len(row) != width:
            message = f"holds {len(row)} numbers; expected {width}"
            raise InvalidInput(message, pointer=f"/training/values/{i}")


def _group_layout(group: ModelGroup, pointer: str) -> GroupLayout:
    names = [c.name for c in group.coordinates]
    _unique(names, f"{pointer}/coordinates")
    _unique([c.coordinate for c in group.channels if c.coordinate], f"{pointer}/channels")
    channels = []
    for i, c in enumerate(group.channels):
        at = _index(names, c.coordinate, f"{pointer}/channels/{i}/coordinate")
        atoms = group.coordinates[at].atoms if at >= 0 else ()
        count = len(atoms) + 1 if at >= 0 else 2  # a part is absent or present
        if len(c.states) != count:
            message = f"holds {len(c.states)} states; expected {count}"
            raise InvalidInput(message, pointer=f"{pointer}/channels/{i}/states")
        channels.append(Channel(c.name, c.states, at, atoms))
    coordinates = tuple(
        Coordinate(c.name, cast("Any", c.transform), c.floor, c.atoms, c.least, c.most)
        for c in group.coordinates
    )
    part = tuple(
        _part(group, c.part, f"{pointer}/coordinates/{i}/part")
        for i, c in enumerate(group.coordinates)
    )
    return GroupLayout(group.name, group.level, coordinates, tuple(channels), part)


def _part(group: ModelGroup, name: str | None, pointer: str) -> int:
    """Return the channel of a part, −1 without."""
    parts = [c.name for c in group.channels if c.coordinate is None]
    _index(parts, name, pointer)
    return _index([c.name for c in group.channels], name, pointer)


def _index(names: list[str], name: str | None, pointer: str) -> int:
    if name is None:
        return -1
    if name not in names:
        raise InvalidInput(f"{name!r} is not declared; expected one of {names}", pointer=pointer)
    return names.index(name)


def _family(group: ModelGroup, index: int, layout: Layout, styles: int) -> Family:
    pointer = f"/groups/{index}"
    d = len(group.coordinates)
    unknown = [name for name in group.inputs if name not in layout.features]
    if unknown:
        raise InvalidInput(
            f"{unknown[0]!r} is no feature of the model", pointer=f"{pointer}/inputs"
        )
    hidden = _rows(group.hidden, f"{pointer}/hidden", styles)
    clusters = hidden.shape[1]
    if group.direct and not np.array_equal(hidden, np.eye(styles)):
        message = "is not the unit matrix; expected it of a group on S itself"
        raise InvalidInput(message, pointer=f"{pointer}/hidden")
    tables = tuple(
        _rows(c.probabilities, f"{pointer}/channels/{i}/probabilities", clusters, len(c.states))
        for i, c in enumerate(group.channels)
    )
    inputs = tuple(layout.features.index(name) for name in group.inputs)
    coef = _shaped(group.coefficients, f"{pointer}/coefficients", (clusters, d, 1 + len(inputs)))
    cov = _shaped(group.covariances, f"{pointer}/covariances", (clusters, d, d))
    _positive_definite(cov, f"{pointer}/covariances")
    return Family(hidden, tables, inputs, coef, cov, group.direct)


def _shaped(value: Any, pointer: str, shape: tuple[int, ...]) -> Floats:
    try:
        array = np.array(value, dtype=np.float64)
        return array.reshape(shape) if array.size == 0 and 0 in shape else _exact(array, shape)
    except ValueError:
        wanted = " × ".join(map(str, shape))
        raise InvalidInput(f"has another shape; expected {wanted}", pointer=pointer) from None


def _exact(array: Floats, shape: tuple[int, ...]) -> Floats:
    if array.shape != shape:
        raise ValueError
    return array


def _probabilities(value: Any, pointer: str) -> Floats:
    array = np.array(value, dtype=np.float64)
    if abs(array.sum() - 1.0) > TOLERANCE or array.min() < 0:
        raise InvalidInput("does not sum to 1; expected probabilities", pointer=pointer)
    return array


def _rows(value: Any, pointer: str, rows: int, columns: int | None = None) -> Floats:
    columns = columns or (len(value[0]) if value else 0)
    array = _shaped(value, pointer, (rows, columns))
    for i, row in enumerate(array):
        _probabilities(row, f"{pointer}/{i}")
    return array


def _unit(value: Any, pointer: str, rows: int, columns: int) -> Floats:
    return _shaped(value, f"{pointer}/probabilities", (rows, columns))


def _positive_definite(cov: Floats, pointer: str) -> None:
    for k, matrix in enumerate(cov):
        symmetric = np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-9)
        if not symmetric or (matrix.size and np.linalg.eigvalsh(matrix)[0] <= 0):
            message = "is not symmetric and positive definite; expected a covariance"
            raise InvalidInput(message, pointer=f"{pointer}/{k}")
