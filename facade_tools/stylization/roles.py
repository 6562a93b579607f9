"""Which tiers of blocks are a building's bottom, body and top, by height and texture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from ..artifacts.blocks import BlockRole
from ..errors import InvalidInput
from ..geometry.arrays import Floats
from ..imaging.image_io import Picture
from .outline import WallFace
from .rhythm import breaks, period, profile

LOW = 0.35  # of the height: a lowest or highest tier below this may be a bottom or a top
ALIKE = 0.8  # shared part of two colour histograms: the same facade goes on
TALLEST_STOREY = 9.0  # m
AGREED = 0.4  # of the wall area that shows a rhythm, for a break to count
KINDRED = 0.6  # shared part of two histograms: slabs of one look
LEAST_TIER = 0.03  # of the height
BINS = 6


@dataclass(frozen=True, slots=True)
class Tier:
    """A tier of blocks from its first slab on; broken: it begins where the rhythm breaks."""

    first: int
    broken: bool = False


@dataclass(frozen=True, slots=True)
class SeenTier:
    """A tier's height (m), whether it begins at a break, and its colour histogram, sum 1."""

    height: float
    broken: bool
    colours: Floats


def tier_roles(tiers: Sequence[SeenTier], bottom: int | None, top: int | None) -> list[BlockRole]:
    """Return the role of every tier from the ground up.

    Where the numbers are not given, what lies below (above) a break of the rhythm near the ground
    (the roof) is bottom (top); else the lowest and the highest tier are, if they are low (below
    35% of the whole) and look unlike the tier beside. A single tier is a body. Raises InvalidInput
    where the given numbers leave no body.
    """
    count = len(tiers)
    low = _bottoms(tiers) if bottom is None else bottom
    high = _tops(tiers, low) if top is None else top
    if low + high > count or (low + high == count and count == 1):
        raise InvalidInput(f"--bottom {low} --top {high} leave no body of {count} tiers")
    middle = count - low - high
    return [*["bottom"] * low, *["body"] * middle, *["top"] * high]  # type: ignore[list-item]


def _bottoms(tiers: Sequence[SeenTier]) -> int:
    whole = sum(tier.height for tier in tiers)
    below = 0.0
    for count, (tier, above) in enumerate(pairwise(tiers), 1):
        below += tier.height
        if above.broken and below < LOW * whole:
            return count
    return int(len(tiers) > 1 and tiers[0].height < LOW * whole and _unlike(*tiers[:2]))


def _tops(tiers: Sequence[SeenTier], low: int) -> int:
    whole = sum(tier.height for tier in tiers)
    above = 0.0
    for count, tier in enumerate(reversed(tiers[low + 1 :]), 1):
        above += tier.height
        if tier.broken and above < LOW * whole:
            return count
    spare = len(tiers) - low
    return int(spare > 1 and tiers[-1].height < LOW * whole and _unlike(tiers[-1], tiers[-2]))


def _unlike(a: SeenTier, b: SeenTier) -> bool:
    return float(np.minimum(a.colours, b.colours).sum()) < ALIKE or a.colours.max() > 0.99


def colours(pictures: Sequence[Picture], areas: Sequence[float]) -> Floats:
    """Return the histogram of colours of pictures weighted by areas, sum 1."""
    total = np.zeros(BINS**3)
    for picture, area in zip(pictures, areas, strict=True):
        small = cv2.resize(picture, (32, 32), interpolation=cv2.INTER_AREA).reshape(-1, 3)
        bins = (small.astype(np.int64) * BINS // 256) @ np.array([BINS * BINS, BINS, 1])
        total += area * np.bincount(bins, minlength=BINS**3) / len(bins)
    return np.asarray(total / max(float(total.sum()), 1e-12))


def odd_slabs(
    heights: Sequence[float],
    starts: Sequence[int],
    looks: Sequence[Floats],
    wanted: tuple[bool, bool],
) -> set[int]:
    """Return the slabs at which a tier of another look begins, besides those in `starts`.

    heights (m) and looks (histograms): of the slabs from the ground up. The lowest slabs of the
    first tier and the highest of the last, where they look unlike the tier's usual look and are
    low, become tiers of their own. wanted: whether to look below, and above.
    """
    whole = sum(heights)
    ends = [*starts[1:], len(heights)]
    found = set()
    for end, (a, b) in enumerate(((starts[0], ends[0]), (starts[-1], ends[-1]))):
        usual = np.average(looks[a:b], axis=0, weights=heights[a:b])
        order = range(a, b) if end == 0 else range(b - 1, a - 1, -1)
        height = 0.0
        for slab in order:
            alike = float(np.minimum(looks[slab], usual).sum()) > KINDRED
            if alike or height + heights[slab] > LOW * whole:
                if height > LEAST_TIER * whole and alike and wanted[end]:
                    found.add(slab if end == 0 else slab + 1)
                break
            height += heights[slab]
    return found


def broken_at(faces: Sequence[WallFace], pictures: Sequence[Picture], end: int) -> float | None:
    """Return the height (m) where the storeys' rhythm of a slab's faces begins or stops.

    end: 0 for the lower, 1 for the upper end. Every face with a rhythm votes by its area; the
    median counts if that is enough wall and leaves most of the slab to the rhythm.
    """
    votes, weights = [], []
    for face, picture in zip(faces, pictures, strict=True):
        samples = profile(np.asarray(picture, dtype=np.float64) / 255, 1, face.height)
        length = period(samples, face.height)
        if length is None or length > TALLEST_STOREY:
            continue
        place = face.height / len(samples)
        first, last = breaks(samples, length / place)
        level = (len(samples) - last) * place if end == 0 else (len(samples) - first) * place
        votes.append(level)
        weights.append(face.width)
    if sum(weights) < AGREED * sum(face.width for face in faces):
        return None
    order = np.argsort(votes)
    level = votes[order[np.searchsorted(np.cumsum(np.array(weights)[order]), 0.5 * sum(weights))]]
    height = faces[0].height
    away = level if end == 0 else height - level
    return faces[0].bottom + level if 0.03 * height < away < LOW * height else None
