"""Draws given what is known of a building (FW16 7, completion).

S is drawn from its posterior, then every group, parents first: its hidden variable given S, the
parents' values and what is observed of the group, then what is not observed of it. Where no
observed group has an unobserved lateral parent this is exact. Elsewhere each draw carries the
weight that makes it so (likelihood weighting), and the effective sample size is stated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .coordinates import Bits, Floats, Readings, values_of
from .dataset import Dataset, GroupData, Ints, Masks, build, own_units
from .density import slope
from .groups import ABSENT
from .kernels import LOG_2PI
from .layout import GroupLayout
from .network import Family, Network, bit_log_density, infer, log_, log_sum, topological
from .sampling import Draws, draw_bits, pick, show


@dataclass(frozen=True, slots=True)
class Particles:
    """Weighted draws; log_weight (n,) averages (as exp) to the density of what is given."""

    draws: Draws
    log_weight: Floats

    @property
    def effective(self) -> float:
        """Return the effective sample size, between 1 and n."""
        w = np.exp(self.log_weight - self.log_weight.max())
        return float(w.sum() ** 2 / (w**2).sum())

    @property
    def exact(self) -> bool:
        """Tell whether all draws weigh the same."""
        return bool(np.ptp(self.log_weight) < 1e-9 * max(1.0, abs(float(self.log_weight[0]))))


def draw_given(
    network: Network, given: Readings, n: int, *, rng: np.random.Generator, style: int | None = None
) -> Particles:
    """Return n weighted draws given one row; `style` fixes S."""
    data = build(given, network.layout, network.scalings)
    odds = infer(network, data).style[0] if style is None else np.eye(len(network.style))[style]
    styles = pick(np.tile(odds, (n, 1)), rng)
    weight = log_(network.style)[styles] - log_(odds)[styles]
    weight += bit_log_density(network.bits, data.bits)[0][styles] + slope(data)[0]
    bits = draw_bits(network, styles, rng, data.bits[0])
    shown = np.zeros((n, len(network.layout.features)))
    out: dict[int, tuple[Floats, Bits]] = {}
    for g in topological(network.families, network.layout):
        row = _Row(network, data, given, g)
        drawn, states, factor = _draw_group(row, styles, shown, rng)
        weight += factor
        out[g] = (drawn, states[:, [c.coordinate < 0 for c in row.layout.channels]])
    groups = range(len(network.layout.groups))
    values, parts = tuple(out[g][0] for g in groups), tuple(out[g][1] for g in groups)
    rows = Readings(given.ids * n, values, parts, bits)
    return Particles(Draws(rows, styles), weight)


class _Row:
    """One group of the given row."""

    def __init__(self, network: Network, data: Dataset, given: Readings, g: int) -> None:
        self.network = network
        self.g = g
        self.layout: GroupLayout = network.layout.groups[g]
        self.family: Family = network.families[g]
        self.data: GroupData = data.groups[g]
        self.dense: Masks = self.data.dense[0]
        self.given: Floats = given.values[g][0]


def _draw_group(
    row: _Row, styles: Ints, shown: Floats, rng: np.random.Generator
) -> tuple[Floats, Bits, Floats]:
    """Return own-unit values and states (n, …), and the log weight of what is observed (n,)."""
    family, layout = row.family, row.layout
    mean = _means(family, shown)
    joint = log_(family.hidden)[styles] + _evidence(row, mean)
    factor = log_sum(joint)
    clusters = pick(np.exp(joint - factor[:, None]), rng)
    states = _draw_states(row, clusters, rng)
    x = _complete(row, mean[np.arange(len(styles)), clusters], clusters, rng)
    values = own_units(x, layout, row.network.scalings[row.g])
    values = values_of(values, states, layout)
    values[:, ~np.isnan(row.given)] = row.given[~np.isnan(row.given)]
    if layout.name == "arf" and "r1=0" in row.network.layout.features:
        flat = shown[:, row.network.layout.features.index("r1=0")] == 1
        values[flat] = ABSENT
    show(shown, x, values, states, row.network.layout, row.g)
    return values, states, factor


def _means(family: Family, shown: Floats) -> Floats:
    """Return the conditional means (n, K, d)."""
    mean = np.tile(family.coef[None, :, :, 0], (len(shown), 1, 1))
    if family.inputs:
        mean += np.einsum("kdq,nq->nkd", family.coef[:, :, 1:], shown[:, family.inputs])
    return mean


def _evidence(row: _Row, mean: Floats) -> Floats:
    """Return log P(observed of the group | H, parents), (n, K)."""
    total = np.zeros(mean.shape[:2])
    for c, table in enumerate(row.family.tables):
        state = int(row.data.states[0, c])
        if state >= 0:
            total += log_(table[:, state])
    seen = np.flatnonzero(row.dense)
    if len(seen):
        cov = row.family.cov[:, seen[:, None], seen]
        v = row.data.x[0, seen] - mean[:, :, seen]
        whole = np.linalg.solve(cov[None], v[..., None])[..., 0]
        constant = np.linalg.slogdet(cov)[1] + len(seen) * LOG_2PI
        total += -0.5 * (constant + (v * whole).sum(axis=2))
    return total


def _draw_states(row: _Row, clusters: Ints, rng: np.random.Generator) -> Bits:
    columns = []
    for c, table in enumerate(row.family.tables):
        drawn = pick(table[clusters], rng)
        known = int(row.data.states[0, c])
        columns.append(np.full(len(clusters), known) if known >= 0 else drawn)
    shape = (len(clusters), len(columns))
    return np.stack(columns, axis=1).astype(np.int8) if columns else np.zeros(shape, dtype=np.int8)


def _complete(row: _Row, mean: Floats, clusters: Ints, rng: np.random.Generator) -> Floats:
    """Return standardised coordinates: the observed as given, the others drawn given them."""
    seen, rest = np.flatnonzero(row.dense), np.flatnonzero(~row.dense)
    x = np.tile(row.data.x, (len(clusters), 1))
    noise = rng.standard_normal((len(clusters), len(rest)))
    if not len(rest):
        return x
    cov = row.family.cov
    inner = cov[:, rest[:, None], rest]
    if len(seen):
        gain = np.linalg.solve(cov[:, seen[:, None], seen], cov[:, seen[:, None], rest])
        inner = inner - np.swapaxes(cov[:, seen[:, None], rest], 1, 2) @ gain
        v = x[:, seen] - mean[:, seen]
        mean = mean.copy()
        mean[:, rest] += np.einsum("nsr,ns->nr", gain[clusters], v)
    factor = np.linalg.cholesky((inner + np.swapaxes(inner, 1, 2)) / 2)
    x[:, rest] = mean[:, rest] + np.einsum("nij,nj->ni", factor[clusters], noise)
    return x


def resampled(particles: Particles, *, rng: np.random.Generator) -> Draws:
    """Return as many draws of equal weight."""
    if particles.exact:
        return particles.draws
    w = np.exp(particles.log_weight - particles.log_weight.max())
    n = len(w)
    index = np.searchsorted(np.cumsum(w), (np.arange(n) + rng.random()) / n * w.sum())
    index = rng.permutation(np.minimum(index, n - 1))
    draws = particles.draws
    return replace(draws, readings=draws.readings.take(index), style=draws.style[index])
