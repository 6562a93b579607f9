"""New textures for resized faces: sections repeated or scaled by their rules (LNSW13 5.2.3)."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from ..imaging.image_io import Picture
from .labels import variance_signal
from .splitting import SplitRule, end_wall, split

PLAIN = 0.5  # of a wall beside windows, that a face without windows is made of
ROWS, LAYERED = 24, 0.05  # a picture's rows, and their least standard deviation in one of layers
TOLERATED = 0.1  # stretch of a texture in which no windows were found
LONG = 3.0  # m: walls that keep the scale of what is on them when they are stretched by more
SMEARED, FILLED = 2.0, 3.0  # stretch of walls, of long walls, beyond which their texture repeats
Part = tuple[tuple[float, float], tuple[float, float]]  # shares: left and right, top and bottom
WHOLE: Part = ((0.0, 1.0), (0.0, 1.0))
Singles = NDArray[np.float32]


def resized_rule(rule: SplitRule, size: float) -> SplitRule:
    """Return a group's rule brought to the size (m) of one of its faces.

    Members of a group differ a little in size; the rule was found on the largest.
    """
    factor = size / rule.size
    return SplitRule(
        tuple(factor * a for a in rule.scalable),
        tuple(factor * b for b in rule.insertable),
        rule.once,
        rule.ends,
    )


def positions(
    rule: SplitRule,
    source: float,
    target: float,
    pixels: int,
    signal: Callable[[], Floats] | None = None,
) -> Floats:
    """Return for every pixel across the new face the place in the old one, as a share 0..1.

    source, target: sizes (m) of the face before and after. Equal sizes give the identity; a face
    without windows keeps its scale and goes on to and fro. signal:
    gives the variance signal of the old face, by which one too small for windows finds plain wall.
    """
    centres = (np.arange(pixels) + 0.5) / pixels * target
    if not rule.insertable and abs(target / source - 1) > TOLERATED:
        return np.abs((centres / source + 1) % 2 - 1)
    own = resized_rule(rule, source)
    done = split(own, target)
    borders = np.concatenate([[0.0], np.cumsum(done.sizes)])
    section = np.clip(np.searchsorted(borders, centres, side="right") - 1, 0, len(done.sizes) - 1)
    share = (centres - borders[section]) / np.maximum(np.diff(borders)[section], 1e-12)
    widths = np.empty(2 * len(own.insertable) + 1)
    widths[::2], widths[1::2] = own.scalable, own.insertable
    starts = np.concatenate([[0.0], np.cumsum(widths)])[:-1]
    if own.insertable and not done.windows and signal is not None:
        first, width = _plainest(starts[::2], widths[::2], source, signal())
        share = np.abs((share * target / max(width, 1e-9) + 1) % 2 - 1)
        return np.asarray(np.clip((first + share * width) / source, 0.0, 1.0))
    index = np.array(done.sources)[section]
    wall = index % 2 == 0
    index = np.where((section == len(done.sizes) - 1) & (share >= 0.5), end_wall(own, done), index)
    stretch = np.diff(borders)[section] / np.maximum(widths[index], 1e-12)
    long = wall & (widths[index] > LONG) & (np.abs(stretch - 1) > TOLERATED)
    share = np.where(long & (stretch <= FILLED), at_scale(share, stretch), share)
    for k in np.unique(index[wall & (stretch > np.where(long, FILLED, SMEARED))]).tolist():
        here = wall & (index == k)
        strip = (0.0, 1.0)
        if signal is not None and widths[k] > 0:
            first, width = _plainest(starts[k : k + 1], widths[k : k + 1], source, signal())
            strip = ((first - starts[k]) / widths[k], width / widths[k])
        share[here] = filled(share[here], stretch[here], strip)
    places: Floats = np.clip((starts[index] + share * widths[index]) / source, 0.0, 1.0)
    return places


def _plainest(starts: Floats, widths: Floats, source: float, signal: Floats) -> tuple[float, float]:
    """Return start and width (m) of the part of the walls that varies least.

    starts, widths (k,): of the walls (m). What frames windows reaches into the walls beside them.
    """
    place = source / len(signal)
    total = np.concatenate([[0.0], np.cumsum(signal)])
    best = (math.inf, 0.0, source)
    for start, width in zip(starts.tolist(), widths.tolist(), strict=True):
        if width < 0.5 * widths.max():
            continue
        count = max(1, int(PLAIN * width / place))
        low, high = int(start / place), max(int((start + width) / place), int(start / place) + 1)
        firsts = np.arange(low, max(high - count, low) + 1)
        firsts = firsts[firsts + count < len(total)]
        if len(firsts):
            # a place more at either end: pixels mix with their neighbours
            ends = np.minimum(firsts + count + 1, len(signal)), np.maximum(firsts - 1, 0)
            means = (total[ends[0]] - total[ends[1]]) / count
            k = int(np.argmin(means))
            best = min(best, (float(means[k]), float(firsts[k]) * place, count * place))
    return best[1], best[2]


def filled(share: Floats, stretch: Floats | float, strip: tuple[float, float]) -> Floats:
    """Bring a section to a much larger size at its own scale: its halves stay at their ends.

    What is between them shows the strip (start and width, shares of the section) to and fro, so
    that neither are pixels smeared nor does what frames a window appear where none is.
    """
    place = share * stretch
    runs = (place - 0.5) / max(strip[1], 1e-9)
    middle = strip[0] + strip[1] * np.abs((runs + 1) % 2 - 1)
    return np.where(
        place < 0.5, place, np.where(place > stretch - 0.5, place - stretch + 1, middle)
    )


def synthesised(
    picture: Picture,
    rules: tuple[SplitRule, SplitRule],
    source: tuple[float, float],
    target: tuple[float, float],
    density: float,
    part: Part = WHOLE,
) -> Picture:
    """Return the picture of a resized face.

    rules: for columns (left to right) and for rows (top to bottom). source, target: width and
    height (m) before and after. density: pixels a metre of the result. part: what is wanted of it.
    """
    places = []
    for k in (0, 1):
        count, signal = _pixels(target[k], density), partial(_signal, picture, k)
        if k and not rules[k].insertable and target[k] <= SMEARED * source[k] and _lying(picture):
            share = (np.arange(count) + 0.5) / count
        else:
            share = positions(rules[k], source[k], target[k], count, signal)
        places.append(share * picture.shape[1 - k] - 0.5)
    columns, rows = (p[_cut(*ends, len(p))] for p, ends in zip(places, part, strict=True))
    order = ((rows, 0), (columns, 1)) if len(rows) < picture.shape[0] else ((columns, 1), (rows, 0))
    for line, axis in order:  # first the one that leaves less to the other
        picture = _resampled(picture, line, axis)
    return picture


def _lying(picture: Picture) -> bool:
    """Tell whether a picture shows things above one another, that cannot stand upside down."""
    rows = cv2.resize(picture, (1, ROWS), interpolation=cv2.INTER_AREA).astype(np.float64) / 255
    return float(rows.std(axis=0).mean()) >= LAYERED


def _signal(picture: Picture, axis: int) -> Floats:
    """Return the variance signal of a picture, thinned to at most 256 lines."""
    step = max(1, picture.shape[axis] // 256)
    return variance_signal(picture[::step] if axis == 0 else picture[:, ::step], axis)


def at_scale(share: Floats, stretch: Floats | float) -> Floats:
    """Bring a section to a new size at its own scale; both its ends stay where they were.

    What is shorter leaves its middle out; what is longer, up to three times as long, runs back
    over its middle.
    """
    place = share * stretch
    shorter = np.where(share < 0.5, place, place + 1 - stretch)
    back = 0.5 * (stretch - 1)
    turn = 0.5 + 0.5 * back
    middle = np.where(place < turn + back, 2 * turn - place, place - 2 * back)
    longer = np.where(place < turn, place, middle)
    return np.where(np.less(stretch, 1.0), shorter, longer)


def shape_of(target: tuple[float, float], density: float, part: Part = WHOLE) -> tuple[int, int]:
    """Return height and width (pixels) of what `synthesised` draws."""
    columns, rows = (
        len(range(*_cut(*ends, _pixels(size, density)).indices(_pixels(size, density))))
        for size, ends in zip(target, part, strict=True)
    )
    return rows, columns


def _pixels(size: float, density: float) -> int:
    return max(1, round(size * density))


def _cut(first: float, last: float, pixels: int) -> slice:
    return slice(round(first * pixels), round(last * pixels))


def _resampled(picture: Picture, places: Floats, axis: int) -> Picture:
    """Return a picture whose pixels along an axis are those at `places` (pixels) of the old."""
    size = picture.shape[axis]
    rows, columns = (len(places) if k == axis else picture.shape[k] for k in (0, 1))
    even = (np.arange(len(places)) + 0.5) * (size / len(places)) - 0.5
    if np.abs(places - even).max() < 1e-3:
        if len(places) == size:
            return picture
        found = cv2.resize(picture, (columns, rows), interpolation=cv2.INTER_LINEAR)
        return np.asarray(found, dtype=np.uint8).reshape(rows, columns, 3)
    low = np.clip(np.floor(places), 0, size - 1).astype(np.int64)
    share = np.clip(places - low, 0, 1).astype(np.float32)
    return np.asarray(_blended(picture, low, share, axis))


@compiled
def _blended(picture: Picture, low: Integers, share: Singles, axis: int) -> Picture:
    """Mix every place with the next one by a share; the last one stays itself."""
    h, w = picture.shape[0], picture.shape[1]
    out = np.empty((len(low) if axis == 0 else h, len(low) if axis == 1 else w, 3), np.uint8)
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            k = row if axis == 0 else column
            first, weight = low[k], int(share[k] * 256 + 0.5)
            last = min(first + 1, (h if axis == 0 else w) - 1)
            for c in range(3):
                a = int(picture[first, column, c] if axis == 0 else picture[row, first, c])
                b = int(picture[last, column, c] if axis == 0 else picture[row, last, c])
                out[row, column, c] = (a * (256 - weight) + b * weight + 128) >> 8
    return out
