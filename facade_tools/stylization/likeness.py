"""What stands once in its row: a sign, a main door, the one shop among garages.

Beyond the paper, whose rules repeat whatever varies: a section that is unlike all others of a
row in which others are alike is not inserted a second time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from ..geometry.arrays import Floats
from ..imaging.image_io import Picture
from .splitting import SplitRule

SIDE = 24  # pixels that sections are compared at
SOFT = 1.0  # of those: standard deviation of the blur, so that sections need not be cut alike
ALIKE, UNLIKE = 0.6, 0.45  # correlation of columns above which sections are alike, below which not
VISIBLE = 0.025  # mean difference of colours in 0..1, below which sections are alike anyway
LETTERING = 0.6  # of a face, that the unlike sections of a sign take at most


def standing_once(rule: SplitRule, row: Picture) -> SplitRule:
    """Return a rule that knows which of its sections stand once in the picture that it splits.

    Where sections are alike, those are marked that resemble no other; where none resemble each
    other and all stand within LETTERING of the row, they become one section; a single one is
    marked if it is not like its own mirror image.
    """
    odd = standing_out(rule, row)
    if len(odd) < len(rule.insertable) or len(odd) == 1:
        return replace(rule, once=tuple(sorted(odd)))
    whole = rule.size - rule.scalable[0] - rule.scalable[-1]
    if whole > LETTERING * rule.size:
        return rule
    return SplitRule((rule.scalable[0], rule.scalable[-1]), (whole,), (0,))


def in_line(rule: SplitRule, rows: Sequence[Picture]) -> SplitRule:
    """Return the common rule of several rows that knows what stands once in one of them."""
    found = [odd for row in rows if len(odd := standing_out(rule, row)) < len(rule.insertable)]
    odd = set().union(*found)
    return replace(rule, once=tuple(sorted(odd))) if len(odd) < len(rule.insertable) else rule


def standing_out(rule: SplitRule, row: Picture) -> set[int]:
    """Return which sections of a row resemble no other: all, or those among others alike.

    A section alone is held against its own mirror image, several against each other's as well.
    """
    sections = np.stack([section(row, *ends) for ends in borders(rule)])
    mirrored = sections[:, :, ::-1]
    others = [mirrored] if len(sections) == 1 else [sections, mirrored]
    alike = np.max([likeness(sections, other) for other in others], axis=0)
    apart = np.min([difference(sections, other) for other in others], axis=0)
    unlike = (alike < UNLIKE) & (apart >= VISIBLE)
    if len(sections) == 1:
        return {0} if unlike.all() else set()
    itself = np.eye(len(sections), dtype=bool)
    odd = (unlike | itself).all(axis=1)
    told = odd.all() or alike[~itself].max() >= ALIKE
    return set(np.flatnonzero(odd).tolist()) if told else set()


def likeness(a: Floats, b: Floats) -> Floats:
    """Return the correlation of the columns of sections (m, SIDE, SIDE, 3) and (n, …), (m, n).

    Colours are taken against the mean of their row: what runs through a row (the frame of a board,
    a plinth) would make everything on it alike. Plain sections are like all others.
    """
    a, b = ((v - v.mean(axis=2, keepdims=True)).reshape(len(v), -1) for v in (a, b))
    size = np.sqrt(np.outer((a**2).sum(axis=1), (b**2).sum(axis=1)))
    plain = size <= 1e-6
    return np.where(plain, 1.0, (a @ b.T) / np.where(plain, 1.0, size))


def difference(a: Floats, b: Floats) -> Floats:
    """Return the mean difference of colours of sections (m, SIDE, SIDE, 3) and (n, …), (m, n)."""
    from scipy.spatial.distance import cdist

    distance = cdist(a.reshape(len(a), -1), b.reshape(len(b), -1), "cityblock")
    return np.asarray(distance / a[0].size)


def borders(rule: SplitRule) -> list[tuple[float, float]]:
    """Return where a rule's insertable sections begin and end, as shares of its size."""
    widths = np.zeros(2 * len(rule.insertable) + 1)
    widths[::2], widths[1::2] = rule.scalable, rule.insertable
    ends = np.cumsum(widths) / rule.size
    return list(zip(ends[:-1:2].tolist(), ends[1::2].tolist(), strict=True))


def section(picture: Picture, first: float, last: float) -> Floats:
    """Return what a picture shows between two shares of its width, (SIDE, SIDE, 3) in 0..1."""
    width = picture.shape[1]
    low = min(int(first * width), width - 1)
    high = max(round(last * width), low + 1)
    part = picture[:, low:high].astype(np.float32) / 255
    small = cv2.resize(part, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), SOFT), dtype=np.float64)
