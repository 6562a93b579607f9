"""Consistent face groups and their splitting rules (LNSW13 4.3.3, 4.3.4)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np

from ..geometry.arrays import Booleans, Floats
from ..imaging.image_io import Picture
from .labels import insertable_labels, merged, rule_of, variance_signal
from .outline import WallFace
from .rhythm import SHORTEST, period, periodic_labels, profile, regular_labels
from .splitting import SplitRule

SHAPE_LINK = 0.9  # of eq. 1
TEXTURE_LINK = 0.5  # of eq. 2
LEAST_WINDOW = 0.3  # m
LEAST_CONTRAST = 0.03  # of colours in 0..1
NOISE = 0.7  # variance of walls over that of windows, above which there are no windows
LUMPED = 1.6  # periods in one section
FRAGMENT = 0.5  # of the usual section: twice what is merged
MULLION = 0.8  # m: twice the gap within a window that is closed
LEAST_WALL = 0.08  # of a face, that has to stay scalable
PLAINER = 0.45  # of the variance that was left: what a pass has to leave that finds no more
WIDER = 1.25  # times what was insertable: a pass that finds no more is to add more than edges
PASSES = 4  # in which fainter and fainter windows are looked for
MAX_AVERAGED = 64  # faces of a group that its mean texture is taken over


def shape_similarity(a: WallFace, b: WallFace) -> float:
    """Return φ_shape (eq. 1) of two faces of one side: shared width over the larger width.

    The paper divides by the smaller width, which links a narrow face to any wide one; a group is
    meant to share its width (4.3.3), so we divide by the larger.
    """
    low = max(min(a.start, a.end), min(b.start, b.end))
    high = min(max(a.start, a.end), max(b.start, b.end))
    return max(high - low, 0.0) / max(a.width, b.width)


def texture_similarity(a: Picture, b: Picture) -> float:
    """Return φ_texture (eq. 2): the correlation of two pictures' column signals, −1 to 1."""
    columns = max(min(a.shape[1], b.shape[1]), 8)
    first, second = (column_signal(picture, columns) for picture in (a, b))
    if first.std() < 1e-9 or second.std() < 1e-9:
        return 1.0 if np.abs(first.mean() - second.mean()) < 0.1 else 0.0
    return float(np.corrcoef(first, second)[0, 1])


def column_signal(picture: Picture, columns: int) -> Floats:
    """Return the mean colour of every column as one signal of 3 × `columns` values in 0..1."""
    mean = picture.mean(axis=0, keepdims=True, dtype=np.float64).astype(np.float32)
    resized = cv2.resize(mean, (columns, 1), interpolation=cv2.INTER_AREA)
    return np.asarray(resized, dtype=np.float64).reshape(-1) / 255


def horizontal_groups(faces: Sequence[WallFace]) -> list[int]:
    """Return the horizontally consistent group of every face: its slab."""
    return [face.slab for face in faces]


def vertical_groups(faces: Sequence[WallFace], pictures: Sequence[Picture]) -> list[int]:
    """Return the vertically consistent group of every face, numbered from 0.

    Faces of one side in successive slabs are linked where both similarities exceed their
    thresholds (4.3.3); groups are the connected stacks.
    """
    parent = list(range(len(faces)))

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for lower, upper in _neighbours(faces):
        for j in upper:
            i = max(lower, key=lambda k: shape_similarity(faces[k], faces[j]))
            alike = shape_similarity(faces[i], faces[j]) > SHAPE_LINK
            if alike and texture_similarity(pictures[i], pictures[j]) > TEXTURE_LINK:
                parent[root(j)] = root(i)
    numbers: dict[int, int] = {}
    return [numbers.setdefault(root(i), len(numbers)) for i in range(len(faces))]


def _neighbours(faces: Sequence[WallFace]) -> list[tuple[list[int], list[int]]]:
    """Return the indices of faces of one side in each pair of successive slabs."""
    rows: dict[tuple[str, int], list[int]] = {}
    for index, face in enumerate(faces):
        rows.setdefault((face.side, face.slab), []).append(index)
    pairs = []
    for side in ("front", "right", "back", "left"):
        slabs = sorted(slab for s, slab in rows if s == side)
        pairs += [(rows[side, a], rows[side, b]) for a, b in pairwise(slabs) if b == a + 1]
    return pairs


def splitting_rule(
    pictures: Sequence[Picture], size: float, axis: int, window: float | None = None
) -> SplitRule:
    """Return the splitting rule of a group from the mean of its pictures (4.3.4).

    size: metres across the rule. axis: 0 splits columns (a horizontal rule), 1 splits rows.
    window: objective window size (m); None takes the median of the sections found, at least 0.3 m.
    Sections of less than half of it are merged. Where the labels tell windows from walls nowhere
    (a texture of noise) or leave no wall nothing is insertable; where they lump several periods
    of a texture that repeats into one section, the periods are the sections; where they nearly
    repeat with the texture, they are made to.
    """
    mean = mean_picture(pictures, axis)
    signal = variance_signal(mean, axis)
    place = size / len(signal)
    length = period(profile(mean, axis, size), size) if size > 2 * SHORTEST else None
    labels = _windows(signal, mean, axis, place, window)
    if length is not None and _longest_run(labels) * place > LUMPED * length:
        labels = periodic_labels(signal, length / place)
    elif length is not None:
        regular = _merged(regular_labels(labels, length / place), place, window)
        fewer = _sections(regular) < _sections(labels)
        labels = labels if fewer or regular.mean() > 1 - LEAST_WALL else regular
    return rule_of(labels if not labels.all() else ~labels, size)


def _windows(
    signal: Floats, mean: Floats, axis: int, place: float, window: float | None
) -> Booleans:
    """Return the labels of eq. 3 to 5, merged; then of what they leave, while that finds more.

    Windows that differ less from the wall than others (pale panes beside a coloured bay, the
    upper halves above balconies) vanish beside the strongest in one pass. A further pass counts
    if it finds more sections, or as many and what it leaves varies far less, and if enough wall
    is left to stretch. place: metres.
    """
    raw = np.zeros(len(signal), dtype=bool)
    found = raw
    rest = math.inf
    for _ in range(PASSES):
        left = np.flatnonzero(~raw)
        if len(left) < 2 or signal[left].max() <= 0:
            break
        labels = insertable_labels(signal[left] / signal[left].max())
        if not _telling(signal[left], labels, mean[:, left] if axis == 0 else mean[left], axis):
            break
        raw = raw.copy()
        raw[left[labels]] = True
        more, left_over = _merged(raw, place, window), float(signal[~raw].mean())
        gained = _sections(more) - _sections(found)
        plainer = left_over < PLAINER * rest and more.sum() > WIDER * found.sum()
        enough = more.mean() <= 1 - LEAST_WALL or not found.any()
        if enough and (gained > 0 or (gained == 0 and plainer)):
            found, rest = more, left_over
    return found


def _merged(labels: Booleans, place: float, window: float | None) -> Booleans:
    if window is not None:
        return merged(labels, window / place)
    least = max(FRAGMENT * _median_run(labels), LEAST_WINDOW / place)
    return merged(labels, least, min(least, MULLION / place))


def _sections(labels: Booleans) -> int:
    return int((np.diff(labels.astype(np.int8), prepend=0) == 1).sum())


def _telling(signal: Floats, labels: Booleans, mean: Floats, axis: int) -> bool:
    """Tell whether insertable places differ from scalable ones by more than noise does."""
    if not labels.any() or labels.all():
        return False
    windows = mean[:, labels] if axis == 0 else mean[labels]
    contrast = float(windows.var(axis=axis).mean(axis=-1).max()) ** 0.5
    low, high = float(signal[~labels].mean()), float(signal[labels].mean())
    return contrast > LEAST_CONTRAST and low < NOISE * high


def _longest_run(labels: Booleans) -> int:
    edges = np.flatnonzero(np.diff(labels.astype(np.int8))) + 1
    return int(np.diff(np.concatenate([[0], edges, [len(labels)]])).max())


def mean_picture(pictures: Sequence[Picture], axis: int) -> Floats:
    """Return the mean of pictures, all brought to one size, colours in 0..1.

    The size is the largest's, but at most 2048 pixels across a rule of `axis` and 256 along it.
    """
    step = -(-len(pictures) // MAX_AVERAGED)
    chosen = pictures[::step]
    most = (256, 2048) if axis == 0 else (2048, 256)
    height, width = (min(max(p.shape[k] for p in chosen), most[k]) for k in (0, 1))
    total = np.zeros((height, width, 3), dtype=np.float32)
    for picture in chosen:
        shrinks = picture.shape[0] > height or picture.shape[1] > width
        how = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
        total += cv2.resize(picture, (width, height), interpolation=how).reshape(height, width, 3)
    return np.asarray(total / (255 * len(chosen)), dtype=np.float32)


def _median_run(labels: np.ndarray) -> float:
    padded = np.concatenate([[False], labels, [False]]).astype(np.int8)
    starts, ends = (np.flatnonzero(np.diff(padded) == sign) for sign in (1, -1))
    return float(np.median(ends - starts)) if len(starts) else 1.0
