"""Vertical edges of an upper floor moved to those of the lower one (LNSW13 5.2.1)."""

from __future__ import annotations

import numpy as np

from ..geometry.arrays import Floats, Integers

SNAP_WINDOW = 0.2  # κ of 5.2.1, of the building's width
UNSEEN = 0.1  # change of a width that the windows and ornaments between two vertices bear


def snapped(upper: Floats, lower: Floats, width: float) -> Floats:
    """Shift the vertices of an upper floor to those of the lower one by dynamic time warping.

    upper (n,), lower (m,): horizontal places in the reference view, increasing. A vertex moves at
    most κ·width, and only to a vertex that the optimal warping matches it with (5.2.1); of several
    the nearest. Returns (n,), increasing.
    """
    if len(upper) == 0 or len(lower) == 0:
        return upper.copy()
    distance = np.abs(upper[:, None] - lower[None])
    distance = np.where(distance <= SNAP_WINDOW * width, distance, np.inf)
    matched = _warping(distance)
    out = upper.copy()
    for i in range(len(upper)):
        row = matched[matched[:, 0] == i, 1]
        if len(row):
            out[i] = lower[row[np.argmin(distance[i, row])]]
    return np.maximum.accumulate(out)


def unsqueezed(before: Floats, after: Floats, ends: tuple[float, float]) -> Floats:
    """Return vertices of which those are back that changed what stands between two of them.

    before, after (n,): places of vertices, increasing, between the ends that stay. Beyond the
    paper, whose faces may be squeezed to nothing: what lies between two vertices is a window or an
    ornament that keeps its width, within UNSEEN.
    """
    widths = np.diff(before, prepend=ends[0], append=ends[1])
    while True:
        now = np.diff(after, prepend=ends[0], append=ends[1])
        changed = np.abs(now - widths) > UNSEEN * widths + 1e-9
        back = (changed[:-1] | changed[1:]) & (after != before)
        if not back.any():
            return after
        after = np.where(back, before, after)


def _warping(distance: Floats) -> Integers:
    """Return the matched pairs (k, 2) of the warping path of least total distance.

    Pairs beyond the window may not be matched: a path skips a vertex that has no partner at a
    price above any match.
    """
    n, m = distance.shape
    skip = 2 * np.max(distance, where=np.isfinite(distance), initial=0.0) + 1.0
    total = np.full((n + 1, m + 1), np.inf)
    total[0], total[:, 0] = skip * np.arange(m + 1), skip * np.arange(n + 1)
    step = np.zeros((n + 1, m + 1), dtype=np.int8)
    step[0, 1:], step[1:, 0] = 4, 3
    for i in range(1, n + 1):
        for j in range(1, m + 1):
            d = distance[i - 1, j - 1]
            options = (
                total[i - 1, j - 1] + d,
                total[i - 1, j] + d,
                total[i, j - 1] + d,
                total[i - 1, j] + skip,
                total[i, j - 1] + skip,
            )
            best = min(range(5), key=options.__getitem__)
            total[i, j], step[i, j] = options[best], best
    return _traced(step)


def _traced(step: np.ndarray[tuple[int, int], np.dtype[np.int8]]) -> Integers:
    i, j = step.shape[0] - 1, step.shape[1] - 1
    pairs = []
    while i or j:
        kind = int(step[i, j])
        if kind < 3 and i and j:
            pairs.append((i - 1, j - 1))
        i, j = i - (kind in (0, 1, 3)), j - (kind in (0, 2, 4))
    return np.array(pairs[::-1], dtype=np.int64).reshape(-1, 2)
