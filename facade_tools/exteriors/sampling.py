"""Ancestral draws from a model (FW16 5.2), in blocks, so that row i is the same for any n."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from .coordinates import Bits, Floats, Readings, values_of
from .dataset import Ints, Masks, own_units
from .groups import ABSENT
from .layout import GroupLayout, Layout
from .network import Family, Network, bit_log_density, topological
from .physical import settle
from .shared_values import SharedValues, take_up

BLOCK = 4096
LEAST_CHANCE = 1e-6  # of any bit; the draws are then of single bits
HALVINGS = 50  # of the range of that chance


@dataclass(frozen=True, slots=True)
class Draws:
    """n complete rows and the style each was drawn from."""

    readings: Readings
    style: Ints


def draw_block(
    network: Network,
    *,
    rng: np.random.Generator,
    style: int | None = None,
    shared: tuple[SharedValues, ...] = (),
) -> Draws:
    """Return one block of ancestral draws, moved onto what is possible; `style` fixes S.

    Rows of a table stay where they are. shared: values that draws take up again.
    """
    styles = pick(np.tile(network.style, (BLOCK, 1)), rng)
    if style is not None:
        styles = np.full(BLOCK, style)
    bits = draw_bits(network, styles, rng)
    drawn = draw_groups(network, styles, rng)
    values = tuple(v for v, _ in drawn)
    parts = tuple(p for _, p in drawn)
    take_up(values, shared, rng=rng)
    if not network.layout.is_table:
        settle(values, network.layout)
    return Draws(Readings(("",) * BLOCK, values, parts, bits), styles)


def pick(probabilities: Floats, rng: np.random.Generator) -> Ints:
    """Return one index a row of probabilities."""
    u = rng.random((len(probabilities), 1))
    cumulative = np.cumsum(probabilities, axis=1)
    index = (u * cumulative[:, -1:] > cumulative).sum(axis=1)
    return np.asarray(np.minimum(index, probabilities.shape[1] - 1))


def draw_bits(
    network: Network, styles: Ints, rng: np.random.Generator, known: Bits | None = None
) -> Bits:
    """Return bits (n, b), those of `known` (b,) kept; every building has some kind of roof.

    Each kind is as frequent as the style has it: `some_kind`.
    """
    probability = network.bits[styles]
    bits = (rng.random(probability.shape) < probability).astype(np.int8)
    if known is not None:
        bits[:, known >= 0] = known[known >= 0]
    roofs = [i for i, name in enumerate(network.layout.bits) if name.startswith("roof.")]
    if roofs and not network.layout.is_table:
        words = np.array(list(product((0, 1), repeat=len(roofs)))[1:], dtype=np.int8)
        if known is not None:
            seen = known[roofs]
            words = words[((words == seen) | (seen < 0)).all(axis=1)]
        if len(words):
            odds = np.exp(bit_log_density(some_kind(network.bits[:, roofs]), words)).T + 1e-300
            bits[:, roofs] = words[pick((odds / odds.sum(axis=1, keepdims=True))[styles], rng)]
    return bits


def some_kind(share: Floats) -> Floats:
    """Return probabilities of independent bits that have the shares (n, b) where any bit is 1.

    To drop the draws without a bit and take the rest would make every kind, and several at once,
    more frequent than they are. With p = share · z the shares hold for z = 1 − Π(1 − share · z),
    the chance of any bit; shares that sum to 1 or less leave just one bit a draw.

    >>> some_kind(np.array([[0.6, 0.5]])).round(3).tolist()
    [[0.2, 0.167]]
    """
    low, high = np.full((len(share), 1), LEAST_CHANCE), np.ones((len(share), 1))
    for _ in range(HALVINGS):
        z = (low + high) / 2
        above = 1 - np.prod(1 - share * z, axis=1, keepdims=True) < z
        low, high = np.where(above, low, z), np.where(above, z, high)
    return np.asarray(share * high)


def draw_groups(
    network: Network, styles: Ints, rng: np.random.Generator
) -> list[tuple[Floats, Bits]]:
    """Return own-unit values and parts of every group, parents before children."""
    layout, count = network.layout, len(styles)
    shown = np.zeros((count, len(layout.features)))
    out: dict[int, tuple[Floats, Bits]] = {}
    for g in topological(network.families, layout):
        family, group = network.families[g], layout.groups[g]
        clusters = styles if family.direct else pick(family.hidden[styles], rng)
        states = np.zeros((count, len(family.tables)), dtype=np.int8)
        for c, table in enumerate(family.tables):
            states[:, c] = pick(table[clusters], rng)
        x = draw_normal(family, clusters, shown, rng)
        values = values_of(own_units(x, group, network.scalings[g]), states, group)
        if group.name == "arf" and "r1" in layout.features and not layout.is_table:
            values[_flat(layout, shown)] = ABSENT
        show(shown, x, values, states, layout, g)
        out[g] = (values, _parts(states, group))
    return [out[g] for g in range(len(layout.groups))]


def _flat(layout: Layout, shown: Floats) -> Masks:
    return np.asarray(shown[:, layout.features.index("r1=0")] == 1)


def _parts(states: Bits, group: GroupLayout) -> Bits:
    return states[:, [i for i, c in enumerate(group.channels) if c.coordinate < 0]]


def draw_normal(family: Family, clusters: Ints, shown: Floats, rng: np.random.Generator) -> Floats:
    """Return standardised coordinates given clusters and what the parents show."""
    count, d = len(clusters), family.coef.shape[1]
    noise = rng.standard_normal((count, d))
    factor = np.linalg.cholesky(family.cov)
    mean = family.coef[clusters, :, 0]
    if family.inputs:
        slopes = family.coef[clusters, :, 1:]
        mean = mean + np.einsum("ndq,nq->nd", slopes, shown[:, family.inputs])
    return np.asarray(mean + np.einsum("nde,ne->nd", factor[clusters], noise))


def show(shown: Floats, x: Floats, values: Floats, states: Bits, layout: Layout, g: int) -> None:
    """Write what children see of group g into `shown` (as `dataset` does for data)."""
    group = layout.groups[g]
    at = layout.feature_group.index(g) if group.features else 0
    for i, own in enumerate(group.channel_of):
        dense = np.isfinite(values[:, i])
        if own >= 0:
            dense &= states[:, own] == 0
        shown[:, at] = np.where(dense, x[:, i], 0.0)
        at += 1
    for c, channel in enumerate(group.channels):
        exists = np.isfinite(values[:, channel.coordinate]) if channel.coordinate >= 0 else True
        for s in range(1, len(channel.states)):
            shown[:, at] = (states[:, c] == s) & exists
            at += 1
