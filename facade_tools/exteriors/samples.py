"""Samples as artifacts: draws with their density, style and neighbours (FW16 5, 7)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..artifacts.attributes import Attributes, Sample
from ..artifacts.model import Model
from ..errors import Infeasible, InvalidInput
from .completion import Completion, completions, distances, overlaid
from .coordinates import Floats, Readings, stack, write_attributes
from .dataset import Ints
from .density import log_density
from .groups import GROUPS, Group
from .neighbours import Neighbours
from .network import Network
from .physical import storey_heights
from .sampling import draw_block
from .seen_states import seen_network
from .serialisation import ModelKey, network_of
from .shared_values import SharedValues, shared_values

POOL = 2000  # draws of which --top keeps the most probable
POOL_EACH = 50  # and at least this many for each that is kept
DISTINCT = 0.05  # standard deviations by which the most probable differ from each other
LIMIT = 50_000  # draws that may be turned down for one that is taken


@dataclass(frozen=True, slots=True)
class SampleOptions:
    """How to sample.

    style: fixes S (from 0). top: only the most probable of many. min_distance: from training rows
    and earlier samples, root mean square standard deviations a coordinate. prefix: of the ids
    `<prefix>-<index>`, counted from `first`. neighbours: whether samples name the training rows
    nearest to them. smooth: leave out values that training buildings share (`shared_values`), and
    draw what none of them shows (`seen_states`).
    """

    style: int | None = None
    top: bool = False
    min_distance: float = 0.0
    prefix: str = "0"
    first: int = 0
    groups: tuple[Group, ...] = GROUPS
    neighbours: bool = True
    smooth: bool = False


@dataclass(frozen=True, slots=True)
class Block:
    """Complete rows with their styles and densities."""

    readings: Readings
    style: Ints
    density: Floats
    effective: float | None = None

    def take(self, index: Ints) -> Block:
        """Return some of the rows."""
        rows = self.readings.take(index)
        return Block(rows, self.style[index], self.density[index], self.effective)


@dataclass(frozen=True, slots=True)
class Source:
    """A model with everything that drawing from it needs. seen: what whole buildings come from."""

    model: Model
    network: Network
    finder: Neighbours
    seen: Network
    shared: tuple[SharedValues, ...]
    given: Attributes | None
    options: SampleOptions


def source_of(model: Model, given: Attributes | None, options: SampleOptions) -> Source:
    """Return a source. Raises InvalidInput on a style that the model lacks."""
    network = network_of(model)
    if options.style is not None and options.style >= len(network.style):
        count = len(network.style)
        raise InvalidInput(f"style {options.style}; expected one of the model's {count}, from 0")
    finder, seen, shared = _lookups(ModelKey(model))
    if options.smooth:
        seen, shared = network, ()
    return Source(model, network, finder, seen, shared, given, options)


@lru_cache(maxsize=4)
def _lookups(key: ModelKey) -> tuple[Neighbours, Network, tuple[SharedValues, ...]]:
    network = network_of(key.model)
    seen = seen_network(key.model, network)
    return Neighbours(key.model, network), seen, shared_values(key.model, network)


def sample_attributes(
    model: Model,
    n: int,
    *,
    rng: np.random.Generator,
    given: Attributes | None = None,
    options: SampleOptions = SampleOptions(),
) -> Iterator[Attributes]:
    """Yield n complete attribute vectors; sample i is the same for every n above it (but --top).

    given: what is known of the building; it stays as it is, to the last bit. Raises InvalidInput
    on a style that the model lacks, Infeasible where nothing meets what is asked for.
    """
    source = source_of(model, given, options)
    for first, block in taken_blocks(source, n, rng=rng):
        yield from annotated(source, block, first)


def taken_blocks(
    source: Source, n: int, *, rng: np.random.Generator
) -> Iterator[tuple[int, Block]]:
    """Yield n rows in blocks, each with the index of its first row."""
    options, blocks = source.options, draw(source, rng)
    chosen = top(blocks, n, source.finder, options) if options.top else blocks
    if options.min_distance > 0 and not options.top:
        chosen = apart(blocks, source.finder, options.min_distance)
    done = 0
    for block in chosen if n else ():
        rows = block.take(np.arange(min(len(block.style), n - done)))
        yield done, rows
        done += len(rows.style)
        if done >= n:
            return


def draw(source: Source, rng: np.random.Generator) -> Iterator[Block]:
    """Yield blocks of complete rows without end."""
    network, options, shared = source.network, source.options, source.shared
    while source.given is None:
        draws = draw_block(source.seen, rng=rng, style=options.style, shared=shared)
        yield Block(draws.readings, draws.style, log_density(network, draws.readings))
    found: Iterator[Completion] = completions(
        network, source.given, options.groups, rng=rng, style=options.style, shared=shared
    )
    for one in found:
        rows = one.draws.readings
        yield Block(rows, one.draws.style, log_density(network, rows), one.effective)


def top(
    blocks: Iterator[Block], n: int, finder: Neighbours, options: SampleOptions
) -> Iterator[Block]:
    """Yield one block: the n most probable distinct rows of a pool.

    Raises Infeasible where fewer than n differ.
    """
    pool = next(blocks)
    while len(pool.style) < max(POOL, POOL_EACH * n):
        more = next(blocks)
        pool = Block(
            stack(pool.readings, more.readings),
            np.concatenate([pool.style, more.style]),
            np.concatenate([pool.density, more.density]),
            more.effective,
        )
    ranked = pool.take(np.argsort(-pool.density, kind="stable"))
    distance = max(options.min_distance, DISTINCT)
    against = finder.training() if options.min_distance > 0 else None
    kept = spread(finder.whole(ranked.readings), against, distance, n)
    if len(kept) < n:
        raise Infeasible(f"only {len(kept)} of {n} most probable samples differ by {distance}")
    yield ranked.take(kept)


def apart(blocks: Iterator[Block], finder: Neighbours, distance: float) -> Iterator[Block]:
    """Yield the rows that keep their distance from training rows and from earlier ones.

    Raises Infeasible where LIMIT draws in a row come too near.
    """
    earlier: Floats = finder.training()
    turned_down = 0
    for block in blocks:
        points = finder.whole(block.readings)
        kept = spread(points, earlier, distance, len(points))
        turned_down = 0 if len(kept) else turned_down + len(points)
        if turned_down > LIMIT:
            raise Infeasible(f"no sample in {turned_down} is {distance} away from all others")
        earlier = np.concatenate([earlier.reshape(-1, points.shape[1]), points[kept]])
        if len(kept):
            yield block.take(kept)


def spread(points: Floats, others: Floats | None, distance: float, most: int) -> Ints:
    """Return the first rows that are `distance` from the others and from each other."""
    free = np.ones(len(points), dtype=np.bool_)
    if others is not None and len(others):
        free &= distances(points, others).min(axis=1) >= distance
    kept: list[int] = []
    for i in np.flatnonzero(free):
        if not kept or distances(points[[i]], points[kept]).min() >= distance:
            kept.append(int(i))
        if len(kept) >= most:
            break
    return np.array(kept, dtype=np.int64)


def block_ids(source: Source, block: Block, first: int) -> tuple[str, ...]:
    """Return the ids of a block's rows, counted from `first`."""
    start, prefix = source.options.first + first, source.options.prefix
    return tuple(f"{prefix}-{i}" for i in range(start, start + len(block.style)))


def annotated(source: Source, block: Block, first: int) -> Iterator[Attributes]:
    """Yield rows as artifacts, ids counted from `first`."""
    rows = replace(block.readings, ids=block_ids(source, block, first))
    layout, finder = source.network.layout, source.finder
    near = list(finder.nearest(rows)) if source.options.neighbours else []
    typical = (source.given or source.model).storey_height
    heights = storey_heights(rows.values, layout, typical)
    density, style = block.density.tolist(), block.style.tolist()
    for i, row in enumerate(write_attributes(rows, layout, heights, source.options.groups)):
        names = {name: finder.ids[index[i]] for name, index, _ in near if index[i] >= 0}
        note = Sample(style[i], density[i], names, block.effective)
        whole = row if source.given is None else overlaid(row, source.given)
        yield replace(whole, sample=note)
