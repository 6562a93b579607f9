"""Plain tables as `learn` sees them: groups of two columns and one vector of bits."""

from __future__ import annotations

import numpy as np

from facade_tools.exteriors.coordinates import Readings
from facade_tools.exteriors.groups import BitGroup, Coordinate
from facade_tools.exteriors.layout import GroupLayout, Layout


def table_layout(groups: int, bits: int) -> Layout:
    rows = tuple(
        GroupLayout(
            f"g{g}",
            "table",
            tuple(Coordinate(f"g{g}.{i}", "identity", 0.01, (), -1e9, 1e9) for i in range(2)),
            (),
            (-1, -1),
        )
        for g in range(groups)
    )
    return Layout(rows, (BitGroup("bits", tuple(f"b{i}" for i in range(bits))),))


def as_readings(values: list[np.ndarray], bits: np.ndarray) -> Readings:
    empty = np.empty((len(bits), 0), dtype=np.int8)
    ids = tuple(map(str, range(len(bits))))
    return Readings(ids, tuple(values), tuple(empty for _ in values), bits)
