"""Samples as artifacts: draws with their density, style and neighbours (FW16 5, 7)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.attributes import Attributes, Sample
from ..artifacts.model import Model
from .coordinates import Readings, write_attributes
from .density import log_density
from .groups import GROUPS, Group
from .neighbours import Neighbours
from .network import Network
from .sampling import BLOCK, Draws, draw_block
from .serialisation import network_of


@dataclass(frozen=True, slots=True)
class SampleOptions:
    """style: fixes S (from 0). prefix: of the ids `<prefix>-<index>`."""

    style: int | None = None
    prefix: str = "0"
    groups: tuple[Group, ...] = GROUPS
    neighbours: bool = True


def sample_attributes(
    model: Model,
    n: int,
    *,
    rng: np.random.Generator,
    given: Attributes | None = None,
    options: SampleOptions = SampleOptions(),
) -> Iterator[Attributes]:
    """Yield n complete attribute vectors; sample i is the same for every n above it.

    given: what is known of the building; it stays as it is, to the last bit.
    """
    network = network_of(model)
    finder = Neighbours(model, network) if options.neighbours else None
    done = 0
    while done < n:
        draws = draw_block(network, rng=rng, style=options.style)
        take = min(BLOCK, n - done)
        ids = tuple(f"{options.prefix}-{done + i}" for i in range(take))
        rows = replace(draws.readings.take(np.arange(take)), ids=ids)
        yield from annotated(network, Draws(rows, draws.style[:take]), model, finder, options)
        done += take


def annotated(
    network: Network, draws: Draws, model: Model, finder: Neighbours | None, options: SampleOptions
) -> Iterator[Attributes]:
    """Yield draws as artifacts."""
    rows = draws.readings
    density = log_density(network, rows).tolist()
    near = [] if finder is None else list(finder.nearest(rows))
    heights = np.full(len(rows), model.storey_height)
    written = write_attributes(rows, network.layout, heights, options.groups)
    for i, attributes in enumerate(written):
        names = (
            {name: finder.ids[index[i]] for name, index, _ in near if index[i] >= 0}
            if finder
            else {}
        )
        yield replace(attributes, sample=Sample(int(draws.style[i]), density[i], names))
