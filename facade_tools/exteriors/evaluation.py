"""How well a model foresees buildings: held-out negative log density."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.model import Model
from ..errors import InvalidInput
from ..randomness import item_generator
from .conditioning import draw_given
from .coordinates import Floats, Readings, read_attributes
from .dataset import build
from .density import entangled, log_density
from .network import Network
from .serialisation import network_of

DRAWS = 1000


def negative_log_density(model: Model, rows: Sequence[Attributes]) -> Floats:
    """Return −log p of each row (n,), nats, over what the row observes.

    Density per metre or per unit, probability mass at atoms (CONTRACT 3). Raises InvalidInput on
    a row with nothing observed.
    """
    network = network_of(model)
    readings = read_attributes(rows, network.layout)
    empty = np.flatnonzero(nothing_observed(readings))
    if len(empty):
        raise unseen(rows[empty[0]])
    return -row_log_density(network, readings)


def unseen(row: Attributes) -> InvalidInput:
    """Return the error of a row in which the model sees nothing, and what there is in it."""
    names = [
        f"{level}.{name}"
        for level in ("mass", "facade")
        for name, value in asdict(getattr(row, level)).items()
        if _known(value)
    ]
    if not names:
        return InvalidInput(f"{row.id}: nothing is observed; expected an attribute")
    known = f"{row.id}: of {', '.join(names)} alone no coordinate of the model follows"
    return InvalidInput(f"{known}; expected more, such as mass.bbox and mass.bcr")


def _known(value: Any) -> bool:
    return any(map(_known, value)) if isinstance(value, list | tuple) else value is not None


def row_log_density(network: Network, readings: Readings) -> Floats:
    """Return log p of each row (n,).

    Exact, but for rows that observe a group and not its lateral parents: these are averaged over
    `DRAWS` draws of what is not observed, the same ones for the same row.
    """
    out = log_density(network, readings)
    data = build(readings, network.layout, network.scalings)
    for i in np.flatnonzero(entangled(network, data)):
        row = readings.take(np.array([i]))
        rng = item_generator(0, "density", row.ids[0])
        weight = draw_given(network, row, DRAWS, rng=rng).log_weight
        out[i] = np.logaddexp.reduce(weight) - np.log(DRAWS)
    return out


def nothing_observed(readings: Readings) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Tell which rows (n,) carry no information."""
    out = (readings.bits < 0).all(axis=1)
    for values, parts in zip(readings.values, readings.parts, strict=True):
        out &= np.isnan(values).all(axis=1) & (parts < 0).all(axis=1)
    return np.asarray(out)
