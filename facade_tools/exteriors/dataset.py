"""Rows on the scale on which they are modelled: standardised, atoms apart, sorted by pattern."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .coordinates import Bits, Floats, Readings, states_of
from .layout import GroupLayout, Layout
from .transforms import forward, inverse, slope_at

Masks = NDArray[np.bool_]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Scaling:
    """Centre and scale (d,) of a group's coordinates on their unbounded scale."""

    center: Floats
    scale: Floats


@dataclass(frozen=True, slots=True)
class GroupData:
    """One group of n rows.

    x: standardised, 0 where there is no density; dense: where there is; states: of the channels,
    −1 unknown; log_slope (n,): log |d standardised / d own unit| of what is dense. order, starts,
    masks: rows by pattern (`kernels`).
    """

    x: Floats
    dense: Masks
    states: Bits
    log_slope: Floats
    order: Ints
    starts: Ints
    masks: Masks


@dataclass(frozen=True, slots=True)
class Dataset:
    """All groups; bits (n, b): 1, 0, −1; features (n, f), known where `known`."""

    groups: tuple[GroupData, ...]
    bits: Bits
    features: Floats
    known: Masks

    def __len__(self) -> int:
        return len(self.bits)


def group_data(x: Floats, dense: Masks, states: Bits, log_slope: Floats) -> GroupData:
    """Return a group's rows with their patterns found."""
    code = _codes(dense)
    order = np.argsort(code, kind="stable").astype(np.int64)
    code = code[order]
    first = np.flatnonzero(np.diff(code, prepend=-1)).astype(np.int64)
    starts = np.append(first, len(code)).astype(np.int64)
    return GroupData(x, dense, states, log_slope, order, starts, dense[order[first]])


def _codes(dense: Masks) -> Ints:
    """Return a number (n,) a pattern; numbers grow as the patterns do lexicographically."""
    if dense.shape[1] < 62:  # a power of two a coordinate fits into 64 bits
        powers = 1 << np.arange(dense.shape[1], dtype=np.int64)[::-1]
        return np.asarray(dense @ powers, dtype=np.int64)
    _, code = np.unique(dense, axis=0, return_inverse=True)
    return np.asarray(code.reshape(-1), dtype=np.int64)


def fit_scaling(readings: Readings, layout: Layout) -> tuple[Scaling, ...]:
    """Return mean and standard deviation of what is observed; 0 and 1 where nothing is.

    A constant coordinate gets the scale of its least standard deviation.
    """
    return tuple(
        _group_scaling(values, parts, group)
        for values, parts, group in zip(readings.values, readings.parts, layout.groups, strict=True)
    )


def _group_scaling(values: Floats, parts: Bits, group: GroupLayout) -> Scaling:
    _, dense = states_of(values, parts, group)
    center, scale = np.zeros(values.shape[1]), np.ones(values.shape[1])
    for i, coordinate in enumerate(group.coordinates):
        t, slope = forward(coordinate.transform, values[dense[:, i], i])
        if len(t):
            center[i] = t.mean()
            scale[i] = max(t.std(), coordinate.floor * float(np.exp(np.median(slope))))
    return Scaling(center, scale)


def build(readings: Readings, layout: Layout, scalings: tuple[Scaling, ...]) -> Dataset:
    """Return the dataset of readings."""
    rows = zip(readings.values, readings.parts, layout.groups, scalings, strict=True)
    built = [_standardise(*row) for row in rows]
    shown = [
        _group_features(data, values, group)
        for data, values, group in zip(built, readings.values, layout.groups, strict=True)
    ]
    bits = readings.bits
    features = np.concatenate([*(f for f, _ in shown), np.maximum(bits, 0)], axis=1)
    known = np.concatenate([*(k for _, k in shown), bits >= 0], axis=1)
    return Dataset(tuple(built), bits, features.astype(np.float64), known)


def _standardise(values: Floats, parts: Bits, group: GroupLayout, scaling: Scaling) -> GroupData:
    states, dense = states_of(values, parts, group)
    x = np.zeros(values.shape)
    log_slope = np.zeros(len(values))
    for i, coordinate in enumerate(group.coordinates):
        rows = dense[:, i]
        t, slope = forward(coordinate.transform, values[rows, i])
        x[rows, i] = (t - scaling.center[i]) / scaling.scale[i]
        log_slope[rows] += slope - np.log(scaling.scale[i])
    return group_data(x, dense, states, log_slope)


def _group_features(data: GroupData, values: Floats, group: GroupLayout) -> tuple[Floats, Masks]:
    """Return what children see: values (0 at an atom) and one indicator an atom or part."""
    columns, known = [], []
    absent = np.isinf(values)
    for i, own in enumerate(group.channel_of):
        at_atom = data.states[:, own] > 0 if own >= 0 else False
        columns.append(data.x[:, i])
        known.append(data.dense[:, i] | absent[:, i] | at_atom)
    for c, channel in enumerate(group.channels):
        gone = absent[:, channel.coordinate] if channel.coordinate >= 0 else False
        for s in range(1, len(channel.states)):
            columns.append((data.states[:, c] == s).astype(np.float64))
            known.append((data.states[:, c] >= 0) | gone)
    shape = (len(values), 0)
    if not columns:
        return np.empty(shape), np.empty(shape, dtype=np.bool_)
    return np.stack(columns, axis=1), np.stack(known, axis=1)


def own_units(x: Floats, group: GroupLayout, scaling: Scaling) -> Floats:
    """Return standardised coordinates in their own units."""
    t = x * scaling.scale + scaling.center
    columns = [inverse(c.transform, t[:, i]) for i, c in enumerate(group.coordinates)]
    return np.stack(columns, axis=1) if columns else t


def floors(mean: Floats, group: GroupLayout, scaling: Scaling) -> Floats:
    """Return the least standard deviation (K, d) around cluster means (K, d), standardised.

    The floor of a coordinate's own unit, carried over by the slope of the transform at the mean.
    """
    t = mean * scaling.scale + scaling.center
    out = np.empty(mean.shape)
    for i, coordinate in enumerate(group.coordinates):
        slope = np.minimum(slope_at(coordinate.transform, t[:, i]), 12.0)
        out[:, i] = coordinate.floor * np.exp(slope) / scaling.scale[i]
    return out
