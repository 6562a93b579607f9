"""Textures from patches of a photograph: quilting by minimal cuts (Efros and Freeman 2001)."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from ..geometry.arrays import Floats, Integers
from ..imaging.image_io import Picture

CANDIDATES = 40  # patches that are compared for every place
TOLERANCE = 0.1  # a patch may fit this much worse than the best and still be drawn
OVERLAP = 6  # a patch overlaps its neighbours by its size over this


def cheapest_cut(cost: Floats) -> Integers:
    """Return for every row the column at which a cut from top to bottom costs least.

    cost: (rows, columns), none negative. The cut moves by at most one column a row.

    >>> cheapest_cut(np.array([[1.0, 0.0, 1.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0]])).tolist()
    [1, 1, 0]
    """
    rows, columns = cost.shape
    total = cost.astype(np.float64).copy()
    for row in range(1, rows):
        before = np.pad(total[row - 1], 1, constant_values=np.inf)
        total[row] += np.minimum(np.minimum(before[:-2], before[1:-1]), before[2:])
    path = np.empty(rows, np.int64)
    path[-1] = int(np.argmin(total[-1]))
    for row in range(rows - 2, -1, -1):
        low = max(path[row + 1] - 1, 0)
        high = min(path[row + 1] + 2, columns)
        path[row] = low + int(np.argmin(total[row, low:high]))
    return path


def cross_faded(left: Picture, right: Picture) -> Picture:
    """Return two pictures of one place (h, w, 3) joined along the cut where they differ least.

    The left one shows left of the cut; across it they are blended over three pixels.
    """
    difference = left.astype(np.float64) - right.astype(np.float64)
    path = cheapest_cut(np.sum(difference**2, axis=2))
    away = np.arange(left.shape[1]) - path[:, None]
    share = np.clip((away + 2) / 4.0, 0.0, 1.0)[:, :, None]
    mixed = (1 - share) * left + share * right
    return np.asarray(np.round(mixed), dtype=np.uint8)


def joined(tiles: Sequence[Picture], overlap: int) -> Picture:
    """Return tiles (h, w + 2·overlap, 3) side by side, each `w` wide, seamless when repeated.

    Every tile brings `overlap` pixels of its surroundings on both sides; the seams run where
    neighbours differ least, the last one's into the first.
    """
    if overlap < 1:
        return np.concatenate(list(tiles), axis=1)
    out = []
    for k, tile in enumerate(tiles):
        after = tiles[(k + 1) % len(tiles)]
        seam = cross_faded(tile[:, -2 * overlap :], after[:, : 2 * overlap])
        out += [tile[:, 2 * overlap : -2 * overlap], seam]
    # Each piece above begins `overlap` pixels inside its tile: turned back into place.
    return np.roll(np.concatenate(out, axis=1), overlap, axis=1)


def quilted(
    exemplars: Sequence[Picture], size: tuple[int, int], block: int, *, rng: np.random.Generator
) -> Picture:
    """Return a texture (height, width) of patches of the exemplars; it repeats seamlessly.

    block: size of a patch in pixels; exemplars smaller than that are enlarged.
    """
    usable = [_at_least(picture, block) for picture in exemplars]
    lap = max(2, block // OVERLAP)
    step = block - lap
    rows, columns = (max(1, -(-length // step)) for length in size)
    canvas = np.zeros((rows * step + lap, columns * step + lap, 3), np.uint8)
    for i in range(rows):
        for j in range(columns):
            y, x = i * step, j * step
            place = canvas[y : y + block, x : x + block]
            place[:] = _fitting(usable, place, (i > 0, j > 0), lap, rng)
    wrapped = _wrapped(_wrapped(canvas, lap).transpose(1, 0, 2), lap).transpose(1, 0, 2)
    resized = cv2.resize(wrapped, size[::-1], interpolation=cv2.INTER_AREA)
    return np.asarray(resized, dtype=np.uint8).reshape(*size, 3)


def _at_least(picture: Picture, block: int) -> Picture:
    factor = max(1.0, (block + 1) / min(picture.shape[:2]))
    if factor == 1.0:
        return picture
    shape = (int(np.ceil(picture.shape[1] * factor)), int(np.ceil(picture.shape[0] * factor)))
    return np.asarray(cv2.resize(picture, shape, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)


def _fitting(
    exemplars: Sequence[Picture],
    place: Picture,
    beside: tuple[bool, bool],
    lap: int,
    rng: np.random.Generator,
) -> Picture:
    """Return a patch that fits what stands above and to the left, cut in along both seams."""
    block = place.shape[0]
    area = np.array([float(e.shape[0] * e.shape[1]) for e in exemplars])
    patches, errors = [], []
    for _ in range(CANDIDATES if any(beside) else 1):
        exemplar = exemplars[int(rng.choice(len(exemplars), p=area / area.sum()))]
        y, x = (int(rng.integers(n - block + 1)) for n in exemplar.shape[:2])
        patch = exemplar[y : y + block, x : x + block]
        patches.append(patch)
        errors.append(_misfit(patch, place, beside, lap))
    good = np.flatnonzero(np.array(errors) <= (1 + TOLERANCE) * min(errors) + 1e-9)
    chosen = patches[int(good[rng.integers(len(good))])].copy()
    if beside[1]:
        chosen[:, :lap] = cross_faded(place[:, :lap], chosen[:, :lap])
    if beside[0]:
        above = cross_faded(
            place[:lap].transpose(1, 0, 2), chosen[:lap].transpose(1, 0, 2)
        ).transpose(1, 0, 2)
        start = lap if beside[1] else 0
        chosen[:lap, start:] = above[:, start:]
    return chosen


def _misfit(patch: Picture, place: Picture, beside: tuple[bool, bool], lap: int) -> float:
    total = 0.0
    if beside[0]:
        total += float(((patch[:lap].astype(np.int32) - place[:lap]) ** 2).sum())
    if beside[1]:
        total += float(((patch[:, :lap].astype(np.int32) - place[:, :lap]) ** 2).sum())
    return total


def _wrapped(canvas: Picture, lap: int) -> Picture:
    """Return the canvas without its last columns, which are blended into the first."""
    out = canvas[:, :-lap].copy()
    out[:, :lap] = cross_faded(canvas[:, -lap:], canvas[:, :lap])
    return out


def median_color(pixels: NDArray[np.uint8], default: str) -> str:
    """Return the median of pixels (n, 3) as #rrggbb, `default` of none."""
    if len(pixels) == 0:
        return default
    return "#" + bytes(np.median(pixels, axis=0).astype(np.uint8).tolist()).hex()
