"""The hierarchical network (FW16 5.2) as arrays: S, hidden variables, groups, lateral edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .coordinates import Bits, Floats
from .dataset import Dataset, GroupData, Scaling
from .kernels import LEAST_PROBABILITY, downward, gaussian, message
from .kernels_conjugate import add_states
from .layout import GroupLayout, Layout


@dataclass(frozen=True, slots=True)
class Pooled:
    """Regression of all rows on the lateral parents: where the prior of the clusters stands.

    coef (d, 1 + inputs); spread (d,): variances that the parents leave over.
    """

    coef: Floats
    spread: Floats


@dataclass(frozen=True, slots=True)
class Family:
    """One group's conditional distributions.

    hidden (|S|, K): P(H | S); of a group that hangs on S itself, the unit matrix and `direct`.
    tables: P(state | H) a channel, (K, states). inputs: features of other groups, by number.
    coef (K, d, 1 + inputs), cov (K, d, d): conditional linear Gaussian, standardised. tied: the
    tables are the same for every cluster (variants without atoms of their own). pooled: only of
    families with lateral parents, and only while learning.
    """

    hidden: Floats
    tables: tuple[Floats, ...]
    inputs: tuple[int, ...]
    coef: Floats
    cov: Floats
    direct: bool = False
    tied: bool = False
    pooled: Pooled | None = None


@dataclass(frozen=True, slots=True)
class Network:
    """A model as arrays. style (|S|,): P(S); bits (|S|, b): P(bit = 1 | S)."""

    layout: Layout
    scalings: tuple[Scaling, ...]
    style: Floats
    bits: Floats
    families: tuple[Family, ...]


@dataclass(frozen=True, slots=True)
class Weights:
    """Weight of each row: on S (n,), on each group (n,), and on each bit (n, b)."""

    style: Floats
    groups: tuple[Floats, ...]
    bits: Floats


@dataclass(frozen=True, slots=True)
class Posterior:
    """What an E-step finds for n rows.

    log_density (n,): of standardised coordinates. style (n, |S|): P(S | row). clusters: P(H | row)
    a group, (n, K). joint: Σ rows P(S, H | row) a group, (|S|, K).
    """

    log_density: Floats
    style: Floats
    clusters: tuple[Floats, ...]
    joint: tuple[Floats, ...]


def log_(p: Floats) -> Floats:
    """Return the logarithm; of zero, a very low number."""
    return np.log(np.maximum(p, LEAST_PROBABILITY))


def local_log_density(family: Family, data: GroupData, features: Floats) -> Floats:
    """Return log P(group | H) (n, K): atoms and what is dense; the unobserved integrated out."""
    out = gaussian(data.x, inputs_of(family, features), data.order, data.starts, data.masks,
                   family.coef, family.cov)  # fmt: skip
    for c, table in enumerate(family.tables):
        add_states(out, data.states, c, np.ascontiguousarray(table))
    return out


def inputs_of(family: Family, features: Floats) -> Floats:
    """Return the features that the group's lateral parents show, (n, inputs)."""
    if not family.inputs:
        return np.empty((len(features), 0))
    return features.take(family.inputs, axis=1)


def bit_log_density(probability: Floats, bits: Bits) -> Floats:
    """Return log P(observed bits | S), (n, |S|)."""
    one, zero = (bits == 1).astype(np.float64), (bits == 0).astype(np.float64)
    total: Floats = one @ log_(probability).T + zero @ log_(1.0 - probability).T
    return total


def log_sum(a: Floats) -> Floats:
    """Return log Σ exp over the last axis."""
    top = a.max(axis=-1, keepdims=True)
    total: Floats = np.log(np.exp(a - top).sum(axis=-1)) + top[..., 0]
    return total


@dataclass(frozen=True, slots=True)
class Message:
    """What a group says upwards.

    likelihood (n, K): P(group | H), scaled to 1 at each row's top; mass (n, |S|): its sum under
    P(H | S). Of a group that hangs on S itself both are empty.
    """

    likelihood: Floats
    mass: Floats


def infer(network: Network, data: Dataset, weights: Weights | None = None) -> Posterior:
    """E-step: exact posterior of S and of every hidden variable, and the density of every row.

    weights: of the rows in `joint`; 1 without. Lateral parents must be known where their children
    are observed (`density.log_density` treats other rows).
    """
    messages, joint = _upwards(network, data)
    log_density = log_sum(joint)
    style = np.exp(joint - log_density[:, None])
    rows = weights.groups if weights else [np.ones(len(style))] * len(messages)
    pairs = [
        _clusters(family, said, style, weight)
        for family, said, weight in zip(network.families, messages, rows, strict=True)
    ]
    return Posterior(log_density, style, tuple(p[0] for p in pairs), tuple(p[1] for p in pairs))


def row_log_density(network: Network, data: Dataset) -> Floats:
    """Return what `infer` finds for `log_density` (n,), without the posteriors."""
    return log_sum(_upwards(network, data)[1])


def _upwards(network: Network, data: Dataset) -> tuple[list[Message], Floats]:
    """Return the messages of all groups, and log P(row, S) (n, |S|)."""
    joint = bit_log_density(network.bits, data.bits) + log_(network.style)
    product = np.ones(joint.shape)
    messages = []
    for family, group in zip(network.families, data.groups, strict=True):
        local = local_log_density(family, group, data.features)
        if family.direct:
            joint += local
            messages.append(Message(local[:, :0], local[:, :0]))
        else:
            messages.append(Message(*message(local, family.hidden, joint, product)))
    return messages, joint + np.log(product)


def _clusters(
    family: Family, said: Message, style: Floats, weight: Floats
) -> tuple[Floats, Floats]:
    """Return P(H | row) (n, K) and Σ P(S, H | row) (|S|, K)."""
    if family.direct:
        return style, np.diag(weight @ style)
    return downward(said.likelihood, said.mass, family.hidden, style, weight)


def topological(families: tuple[Family, ...], layout: Layout) -> list[int]:
    """Return the groups so that lateral parents come first. Raises ValueError on a cycle."""
    parents = [{layout.feature_group[i] for i in f.inputs} - {-1} for f in families]
    done: list[int] = []
    while len(done) < len(families):
        ready = [g for g, p in enumerate(parents) if g not in done and p <= set(done)]
        if not ready:
            raise ValueError("lateral edges form a cycle")
        done.append(ready[0])
    return done


def edges(network: Network) -> list[tuple[str, str]]:
    """Return the lateral edges as names (parent, child); a vector of bits is one parent."""
    out = []
    for family, group in zip(network.families, network.layout.groups, strict=True):
        names = {_owner(network.layout, feature) for feature in family.inputs}
        out += [(name, group.name) for name in sorted(names)]
    return out


def _owner(layout: Layout, feature: int) -> str:
    group = layout.feature_group[feature]
    return layout.groups[group].name if group >= 0 else layout.features[feature].split(".")[0]


def empty_family(group: GroupLayout, styles: int, clusters: int) -> Family:
    """Return a family that knows nothing: standard normal, uniform tables."""
    d = len(group.coordinates)
    tables = tuple(np.full((clusters, len(c.states)), 1 / len(c.states)) for c in group.channels)
    return Family(
        np.full((styles, clusters), 1 / clusters),
        tables,
        (),
        np.zeros((clusters, d, 1)),
        np.tile(np.eye(d), (clusters, 1, 1)),
    )
