"""Log density of rows under a network, in original units, the unobserved integrated out."""

from __future__ import annotations

import numpy as np

from .coordinates import Floats, Readings
from .dataset import Dataset, build
from .network import Network, row_log_density


def log_density(network: Network, readings: Readings) -> Floats:
    """Return log p of each row (n,): density per metre or per unit, mass at atoms (CONTRACT 3)."""
    data = build(readings, network.layout, network.scalings)
    return row_log_density(network, data) + slope(data)


def slope(data: Dataset) -> Floats:
    """Return the log Jacobian (n,) from standardised coordinates to own units."""
    total = np.zeros(len(data))
    for group in data.groups:
        total += group.log_slope
    return total


def entangled(network: Network, data: Dataset) -> np.ndarray:
    """Tell which rows (n,) observe a group but not all that its lateral parents show it."""
    out = np.zeros(len(data), dtype=np.bool_)
    for family, group in zip(network.families, data.groups, strict=True):
        lacks = ~data.known[:, family.inputs].all(axis=1)
        out |= lacks & group.dense.any(axis=1)
    return out
