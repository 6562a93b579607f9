"""States of atoms that no training row shows are not drawn.

Every state has a pseudo-count, so that no new building has probability 0. Drawn, it puts what
nobody has seen into one building of a hundred that were learned: a front without a window, a
garage beside a city block. Densities keep the pseudo-counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..artifacts.model import Model
from .coordinates import Floats, Readings, states_of
from .dataset import Masks
from .layout import GroupLayout
from .neighbours import training_readings
from .network import Network

PRESENT = 1  # the state of a part that exists


def seen_network(model: Model, network: Network) -> Network:
    """Return a network whose tables have no state that is observed and that no row shows.

    What no row observes (`unobserved`: it comes from the prior) stays, and everything of a model
    without training rows.
    """
    if model.training is None or not model.training.ids:
        return network
    rows = training_readings(model, network.layout)
    families = []
    for g, family in enumerate(network.families):
        seen = _seen(rows, g, network.layout.groups[g], frozenset(model.unobserved))
        tables = tuple(_limited(t, s) for t, s in zip(family.tables, seen, strict=True))
        families.append(replace(family, tables=tables))
    return replace(network, families=tuple(families))


def _seen(rows: Readings, g: int, group: GroupLayout, unobserved: frozenset[str]) -> list[Masks]:
    """Return for each channel of a group which states a draw may have.

    A part is absent in all rows where none has measures of it and these are not `unobserved`.
    """
    values = rows.values[g]
    states, _ = states_of(values, rows.parts[g], group)
    out = []
    for c, channel in enumerate(group.channels):
        seen = np.ones(len(channel.states), dtype=bool)
        if channel.coordinate >= 0:
            shown = np.unique(states[states[:, c] >= 0, c])
            seen = np.isin(np.arange(len(seen)), shown) if len(shown) else seen
        else:
            own = [i for i, part in enumerate(group.part) if part == c]
            names = {channel.name, *(group.coordinates[i].name for i in own)}
            seen[PRESENT] = bool(names & unobserved) or bool(np.isfinite(values[:, own]).any())
        out.append(seen)
    return out


def _limited(table: Floats, seen: Masks) -> Floats:
    """Return a table (K, states) without the states that are not seen, rows summing to 1."""
    kept = np.where(seen, table, 0.0)
    total = kept.sum(axis=1, keepdims=True)
    return np.where(total > 0.0, kept / np.where(total > 0.0, total, 1.0), table)
