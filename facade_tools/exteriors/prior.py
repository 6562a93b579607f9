"""Where attributes come from that no training building observes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib import resources

import numpy as np

from ..artifacts.attributes import Attributes
from .attributes import attributes_of_vector
from .coordinates import Readings
from .layout import Layout
from .network import Weights

WEIGHT = 10.0  # buildings that the whole prior counts for


def shipped_prior() -> list[Attributes]:
    """Return the attributes of the synthetic sample houses that the package carries."""
    text = resources.files("facade_tools.exteriors").joinpath("prior.json").read_text("utf-8")
    document = json.loads(text)
    rows = zip(document["ids"], document["rows"], document["storey_heights"], strict=True)
    return [attributes_of_vector(i, np.array(row), height) for i, row, height in rows]


def unobserved_coordinates(readings: Readings, layout: Layout) -> list[list[str]]:
    """Return for each group the coordinates and parts that no row observes."""
    out = []
    for group, values, parts in zip(layout.groups, readings.values, readings.parts, strict=True):
        names = [c.name for i, c in enumerate(group.coordinates) if _never(values[:, i])]
        here = [c.name for c in group.channels if c.coordinate < 0]
        names += [name for i, name in enumerate(here) if (parts[:, i] < 0).all()]
        out.append(names)
    return out


def _never(column: np.ndarray[tuple[int], np.dtype[np.float64]]) -> bool:
    """Tell whether a coordinate was never seen, be it as absent; always absent is seen."""
    absent = np.isinf(column)
    return bool((~np.isfinite(column)).all() and (~absent).any())


def unobserved_bits(readings: Readings, layout: Layout) -> list[str]:
    """Return the bits that no row observes."""
    return [name for i, name in enumerate(layout.bits) if (readings.bits[:, i] < 0).all()]


def weights_with_prior(
    readings: Readings, layout: Layout, prior_rows: int, missing: Sequence[Sequence[str]]
) -> Weights:
    """Return weights of training rows (first; 1 each) and prior rows (last; `WEIGHT` together).

    A prior row teaches only groups and bits that hold something unobserved. Its other attributes
    serve to find its style.
    """
    train = len(readings) - prior_rows
    share = WEIGHT / max(prior_rows, 1)

    def rows(taught: bool) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return np.concatenate([np.ones(train), np.full(prior_rows, share if taught else 0.0)])

    seen = Readings(
        readings.ids[:train],
        tuple(v[:train] for v in readings.values),
        tuple(p[:train] for p in readings.parts),
        readings.bits[:train],
    )
    unseen = set(unobserved_bits(seen, layout))
    bits = (
        np.stack([rows(name in unseen) for name in layout.bits], axis=1)
        if layout.bits
        else (np.ones((len(readings), 0)))
    )
    return Weights(rows(False), tuple(rows(bool(names)) for names in missing), bits)
