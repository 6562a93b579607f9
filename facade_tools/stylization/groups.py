"""Consistent face groups and their splitting rules (LNSW13 4.3.3, 4.3.4)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np

from ..geometry.arrays import Booleans, Floats
from ..imaging.image_io import Picture
from .outline import WallFace
from .rhythm import SHORTEST, period, periodic_labels, profile
from .splitting import SplitRule, insertable_labels, merged, rule_of, variance_signal

SHAPE_LINK = 0.9  # of eq. 1
TEXTURE_LINK = 0.5  # of eq. 2
LEAST_WINDOW = 0.3  # m
LEAST_CONTRAST = 0.03  # of colours in 0..1
NOISE = 0.7  # variance of walls over that of windows, above which there are no windows
LUMPED = 1.6  # periods in one section
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


def group_rule(
    pictures: Sequence[Picture], size: float, axis: int, window: float | None = None
) -> SplitRule:
    """Return the splitting rule of a group from the mean of its pictures (4.3.4).

    size: metres across the rule. axis: 0 splits columns (a horizontal rule), 1 splits rows.
    window: objective window size (m); None takes the median of the sections found, at least 0.3 m.
    Sections of less than half of it are merged. Where the labels tell windows from walls nowhere
    (a texture of noise) nothing is insertable; where they lump several periods of a texture that
    repeats into one section, the periods are the sections.
    """
    mean = mean_picture(pictures, axis)
    signal = variance_signal(mean, axis)
    labels = insertable_labels(signal)
    place = size / len(labels)
    length = period(profile(mean, axis, size), size) if size > 2 * SHORTEST else None
    if not _telling(signal, labels, mean, axis):
        labels = np.zeros_like(labels)
    least = max(_median_run(labels), LEAST_WINDOW / place) if window is None else window / place
    labels = merged(labels, least)
    if length is not None and _longest_run(labels) * place > LUMPED * length:
        labels = periodic_labels(signal, length / place)
    return rule_of(labels, size)


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
