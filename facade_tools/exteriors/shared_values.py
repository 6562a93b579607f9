"""Values that many training buildings share: ceilings of 8 ft, walls of whole feet.

The density knows no standard deviation below 5 cm or 0.01, so that a draw lies beside the sizes
that carpenters and surveyors repeat. A draw takes up such a value again as often as training
buildings near to it have one (docs/sample.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..artifacts.model import Model
from ..compiled import compiled
from .coordinates import Bits, Floats
from .dataset import Ints, Masks
from .groups import ATOM_TOLERANCE
from .neighbours import training_readings
from .network import Network

LEAST = 2  # training buildings that make a value a shared one: the leave-one-out estimate of how
# often a new building has a value that an old one has
REACH = 2.0  # least standard deviations within which training buildings count as near
FAR = 5.0
AROUND = 8
DIGITS = 9  # to which values are compared


@dataclass(frozen=True, slots=True)
class SharedValues:
    """One coordinate's training values (m,), sorted; which of them are shared; reach, own unit."""

    group: int
    index: int
    values: Floats
    shared: Masks
    atoms: tuple[float, ...]
    reach: float


def shared_values(model: Model, network: Network) -> tuple[SharedValues, ...]:
    """Return the coordinates that have shared values; none for a model without training rows."""
    if model.training is None or not model.training.ids:
        return ()
    readings = training_readings(model, network.layout)
    out = []
    for g, (values, group) in enumerate(zip(readings.values, network.layout.groups, strict=True)):
        for i, coordinate in enumerate(group.coordinates):
            column = values[:, i]
            column = np.sort(column[_dense(column, coordinate.atoms)])
            alike = column.round(DIGITS)  # may differ from the value itself in the last bit
            _, place, counts = np.unique(alike, return_inverse=True, return_counts=True)
            shared = counts[place.reshape(-1)] >= LEAST
            if shared.any():
                reach = REACH * coordinate.floor
                out.append(SharedValues(g, i, column, shared, coordinate.atoms, reach))
    return tuple(out)


def take_up(
    values: tuple[Floats, ...],
    coordinates: tuple[SharedValues, ...],
    *,
    rng: np.random.Generator,
    fixed: tuple[Bits, ...] | None = None,
) -> None:
    """Move draws (own units), in place, onto shared values near them.

    Of the training buildings within reach, and at least the `AROUND` next ones on either side, one
    is drawn; if its value is a shared one and not `FAR` times as far, it takes the draw's place.
    fixed (n, d) a group: 1 where a value is given and must stay.
    """
    for one in coordinates:
        column = values[one.group][:, one.index]
        drawn = pick_around(one.values, column, rng.random(len(column)), one.reach)
        near = np.abs(one.values[drawn] - column) <= FAR * one.reach
        moved = _dense(column, one.atoms) & near & one.shared[drawn]
        if fixed is not None:
            moved &= fixed[one.group][:, one.index] == 0
        column[moved] = one.values[drawn[moved]]


@compiled
def pick_around(values: Floats, column: Floats, u: Floats, reach: float) -> Ints:
    """Return for each number (n,) the index of one of the sorted values around it, by u in [0, 1).

    Around: within `reach`, and at least the next `AROUND` on either side.
    """
    out = np.empty(len(column), dtype=np.int64)
    for i in range(len(column)):
        place = np.searchsorted(values, column[i])
        low = np.searchsorted(values, column[i] - reach)
        high = np.searchsorted(values, column[i] + reach, side="right")
        low = max(min(low, place - AROUND), 0)
        high = min(max(high, place + AROUND), len(values))
        out[i] = low + np.int64(u[i] * (high - low))
    return out


def _dense(column: Floats, atoms: tuple[float, ...]) -> Masks:
    dense = np.isfinite(column)
    for atom in atoms:
        dense &= np.abs(column - atom) > ATOM_TOLERANCE
    return np.asarray(dense)
