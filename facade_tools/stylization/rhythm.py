"""Periods of textures: where windows repeat, and where a shop or an attic breaks the rhythm."""

from __future__ import annotations

import cv2
import numpy as np

from ..geometry.arrays import Booleans, Floats

PLACES, LINES = 1024, 24  # samples along and across the direction of repeat
# a period is clear with this correlation and this rise from the dip before
CLEAR = ((0.45, 0.15), (0.3, 0.4))
NEARLY = 0.85  # of the best peak: the shortest such period is taken
SHORTEST = 0.6  # m
AROUND = 8.0  # m: changes over longer distances are light, not rhythm
WALL_SHARE = 0.25  # of a period that may be scaled
REGULAR = 2.6  # periods at least, for one odd bay among them to be told
JITTER = 0.1  # of a period: differences of edges that are none
BREAK = 0.35  # correlation with the storey beside, below which a row belongs to no rhythm


def profile(picture: Floats, axis: int, size: float) -> Floats:
    """Return a picture (h, w, 3) of `size` metres as samples (n, k) along the direction of repeat.

    axis 0: along the columns, 1: along the rows from top to bottom. Each place's samples tell
    what it looks like against the 8 metres around it.
    """
    turned = picture if axis == 0 else picture.transpose(1, 0, 2)
    lines, places = turned.shape[:2]
    shape = (min(places, PLACES), min(lines, LINES))
    small = cv2.resize(turned.astype(np.float32), shape, interpolation=cv2.INTER_AREA)
    samples = small.reshape(shape[1], shape[0], -1).transpose(1, 0, 2).reshape(shape[0], -1)
    width = round(AROUND / size * shape[0])
    if width >= shape[0]:
        return np.asarray(samples - samples.mean(axis=0), dtype=np.float64)
    around = cv2.blur(samples, (1, max(width, 1)), borderType=cv2.BORDER_REFLECT)
    return np.asarray(samples - around, dtype=np.float64)


def period(samples: Floats, size: float) -> float | None:
    """Return the length (m) at which samples (n, k) over `size` metres repeat; None if they don't.

    The shortest clear peak of the normalised autocorrelation, at most half of the size.
    """
    n = len(samples)
    if n < 12 or samples.std() < 4 / 255:
        return None
    score = _autocorrelation(samples)
    peaks = [
        k
        for k in range(max(2, int(SHORTEST / size * n)), n // 2 + 1)
        if score[k] > score[k - 1] and score[k] >= score[k + 1]
    ]
    lowest = np.minimum.accumulate(score)
    clear = [
        k
        for k in peaks
        if any(score[k] > sure and score[k] - lowest[k] > rise for sure, rise in CLEAR)
    ]
    if not clear:
        return None
    best = max(score[k] for k in clear)
    k = next(k for k in clear if score[k] >= NEARLY * best)
    return _refined(score, k) * size / n


def _autocorrelation(samples: Floats) -> Floats:
    """Return the normalised correlation of samples with themselves shifted by 0 … n − 1 places."""
    n = len(samples)
    spectrum = np.fft.rfft(samples, 2 * n, axis=0)
    product = np.fft.irfft((np.abs(spectrum) ** 2).sum(axis=1), 2 * n)[:n]
    energy = np.concatenate([[0.0], np.cumsum((samples**2).sum(axis=1))])
    left, right = energy[n - np.arange(n)], energy[n] - energy[np.arange(n)]
    return np.asarray(product / np.maximum(np.sqrt(left * right), 1e-12))


def _refined(score: Floats, k: int) -> float:
    """Return the place of a peak between samples, by a parabola through three of them."""
    a, b, c = score[k - 1 : k + 2]
    bend = a - 2 * b + c
    return k + (0.5 * (a - c) / bend if bend < -1e-12 else 0.0)


def periodic_labels(signal: Floats, step: float) -> Booleans:
    """Label places insertable in periods of `step` places, borders where the signal is low.

    signal: (n,) variance signal. A quarter of each period, around its border, is scalable, and so
    is what is left of a period at the ends.
    """
    n = len(signal)
    half = 0.5 * WALL_SHARE * step
    smooth = cv2.blur(signal.reshape(1, -1), (max(1, round(2 * half)), 1)).ravel()
    phases = np.arange(0.0, step, max(step / 64, 0.25))
    cost = [smooth[np.arange(p, n, step).astype(int)].mean() for p in phases]
    first = phases[int(np.argmin(cost))]
    place = np.mod(np.arange(n) + 0.5 - first, step)
    labels: Booleans = np.asarray(np.minimum(place, step - place) > half)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], labels, [False]]))).reshape(-1, 2)
    for start, end in edges:
        if end - start < 0.6 * (1 - WALL_SHARE) * step:
            labels[start:end] = False
    return labels


def regular_labels(labels: Booleans, step: float) -> Booleans:
    """Return labels made periodic where they nearly are.

    labels: (n,). step: their period, in places; the one within 3% that fits best is taken. Between
    the first and the last insertable place, runs of places take the label that most places of
    their phase have, if that changes few of them and leaves both kinds; a single odd bay (a shop
    without an awning, an open window) is then cut like the others. Edges that are off by little
    stay where they were found.
    """
    ends = np.flatnonzero(labels)
    if not len(ends) or ends[-1] + 1 - ends[0] < REGULAR * step:
        return labels
    inner = labels[ends[0] : ends[-1] + 1]
    tries = [_folded(inner, step * factor) for factor in np.linspace(0.97, 1.03, 25)]
    best = max(tries, key=lambda tried: float((tried == inner).mean()))
    if best.all() or (best == inner).mean() < NEARLY:
        return labels
    odd = np.diff(np.concatenate([[0], best != inner, [0]]).astype(np.int8))
    for start, end in zip(np.flatnonzero(odd == 1), np.flatnonzero(odd == -1), strict=True):
        if end - start <= JITTER * step:
            best[start:end] = inner[start:end]
    return np.concatenate([labels[: ends[0]], best, labels[ends[-1] + 1 :]])


def _folded(labels: Booleans, step: float) -> Booleans:
    """Return the label that most places of each phase have."""
    bins = max(int(step), 1)
    phase = np.minimum((np.arange(len(labels)) % step / step * bins).astype(np.int64), bins - 1)
    share = np.bincount(phase, labels, bins) / np.maximum(np.bincount(phase, minlength=bins), 1)
    return np.asarray((share > 0.5)[phase])


def breaks(samples: Floats, step: float) -> tuple[int, int]:
    """Return the first and the last place (exclusive) of the rhythm with period `step` places.

    From the middle outwards, a place belongs to the rhythm while it resembles the one a period
    nearer to the middle; where it does not for a third of a period, the rhythm ends.
    """
    n, lag = len(samples), round(step)
    like = _likeness(samples, lag)
    width = max(1, round(0.25 * step))
    alien = np.asarray(cv2.blur(like.reshape(1, -1), (width, 1)).ravel() < BREAK)
    long = max(2, round(step / 3))
    middle = (n - lag) // 2
    first = _last_run(alien[:middle][::-1], long)
    last = _last_run(alien[middle:], long)
    return (middle - first if first is not None else 0), (
        middle + lag + last if last is not None else n
    )


def _likeness(samples: Floats, lag: int) -> Floats:
    """Return the correlation of every place with the one `lag` further on (n − lag,)."""
    a, b = samples[:-lag], samples[lag:]
    product = (a * b).sum(axis=1)
    size = np.sqrt((a**2).sum(axis=1) * (b**2).sum(axis=1))
    floor = 0.25 * float((samples**2).sum(axis=1).mean())
    difference = ((a - b) ** 2).sum(axis=1)
    # places without contrast are alike when their difference is small
    return np.asarray(np.where(difference < floor, 1.0, product / np.maximum(size, 1e-12)))


def _last_run(alien: Booleans, long: int) -> int | None:
    """Return where the first run of at least `long` alien places begins."""
    count = 0
    for place, odd in enumerate(alien):
        count = count + 1 if odd else 0
        if count == long:
            return place - long + 1
    return None
