"""A parsed facade on a wall of another width: axes of windows repeat, none is stretched.

As many axes as fit (LNSW13 eq. 8): whole axes between two walls are added or left out, in the
parse and in its photograph alike; only what remains is stretched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS, Parse, Region
from ..imaging.image_io import Picture
from .texture_synthesis import cross_faded

OPENINGS = [LABELS.index(name) for name in ("window", "door")]
BLOCKED = 0.02  # share of a column's pixels from which it crosses an opening
LAP = 0.25  # of the narrower wall beside a cut, where its seam may run
NARROW = 0.3  # of the median wall between openings: narrower ones are not cut
USUAL = 0.5  # of the largest area of glass between two cuts: from here an axis may repeat
MOST_PIXELS = 64_000_000

Span = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Widened:
    """Spans of the picture's columns that stand side by side, from the left."""

    spans: tuple[Span, ...]
    lap: int

    @property
    def width(self) -> int:
        """Columns of all spans."""
        return sum(stop - start for start, stop in self.spans)

    def parse(self, parse: Parse) -> Parse:
        """Return the parse with the regions of every span in its place; chimneys stand once."""
        regions: list[Region] = []
        at = 0
        seen: set[Span] = set()
        for start, stop in self.spans:
            for region in parse.regions:
                x0, x1 = max(region.x0, start), min(region.x1, stop)
                again = region.label == "chimney" and (start, stop) in seen
                label = "sky" if again else region.label
                if x0 < x1:
                    x0, x1 = x0 - start + at, x1 - start + at
                    regions.append(replace(region, label=label, x0=x0, x1=x1))
            seen.add((start, stop))
            at += stop - start
        return replace(parse, regions=tuple(regions))

    def picture(self, picture: Picture) -> Picture:
        """Return the photograph; seams run where neighbours differ least."""
        out = [picture[:, slice(*self.spans[0])]]
        for before, after in pairwise(self.spans):
            if before[1] == after[0] or self.lap < 1:
                out.append(picture[:, slice(*after)])
                continue
            lap = self.lap
            left = picture[:, before[1] - lap : before[1] + lap]
            right = picture[:, after[0] - lap : after[0] + lap]
            out[-1] = out[-1][:, :-lap]
            out += [cross_faded(left, right), picture[:, after[0] + lap : after[1]]]
        return np.concatenate(out, axis=1)


def widened(labels: NDArray[np.uint8], ratio: float) -> Widened | None:
    """Return the axes of a facade whose width is `ratio` times its own, as nearly as axes allow.

    labels: map (height, width). None where no other number of axes comes nearer than stretching.
    """
    height, width = labels.shape
    cuts, lap = _cuts(labels)
    inner = list(pairwise(cuts))
    plain = _plain(labels, inner)
    if not plain or ratio * width * height > MOST_PIXELS:
        return None
    usual = float(np.mean([stop - start for start, stop in plain]))
    steps = (ratio - 1.0) * width / usual
    choices = {max(int(np.floor(steps)), -len(plain)), max(int(np.ceil(steps)), -len(plain)), 0}
    made = [Widened(_sequence(labels.shape[1], inner, plain, n), lap) for n in sorted(choices)]
    best = min(made, key=lambda one: abs(np.log(one.width / (ratio * width))))
    return None if best.width == width else best


def _plain(labels: NDArray[np.uint8], inner: Sequence[Span]) -> list[Span]:
    """Return the axes that may repeat: without a door, and no staircase's small windows."""
    door, window = LABELS.index("door"), LABELS.index("window")
    ends = [(0, inner[0][0]), (inner[-1][1], labels.shape[1])] if inner else []
    most = max((_count(labels, span, window) for span in [*inner, *ends]), default=0)
    return [
        axis
        for axis in inner
        if not _count(labels, axis, door) and _count(labels, axis, window) >= USUAL * most
    ]


def _count(labels: NDArray[np.uint8], span: Span, label: int) -> int:
    return int((labels[:, span[0] : span[1]] == label).sum())


def _cuts(labels: NDArray[np.uint8]) -> tuple[list[int], int]:
    """Return the middles of the walls between two axes, and how far a seam may stray."""
    crossed = np.isin(labels, OPENINGS).mean(axis=0) >= BLOCKED
    edges = np.flatnonzero(np.diff(crossed.astype(np.int8)))
    free = [(int(a) + 1, int(b) + 1) for a, b in pairwise(edges) if not crossed[a + 1]]
    if not free:
        return [], 0
    usual = float(np.median([b - a for a, b in free]))
    walls = [(a, b) for a, b in free if b - a >= NARROW * usual]
    return [(a + b) // 2 for a, b in walls], int(LAP * min(b - a for a, b in walls))


def _sequence(
    width: int, inner: Sequence[Span], plain: Sequence[Span], more: int
) -> tuple[Span, ...]:
    """Return the spans with `more` axes (fewer where it is negative), doors never among them."""
    gone = set(plain[len(plain) + more :]) if more < 0 else set()
    added = [plain[k % len(plain)] for k in range(more)]
    middle = [axis for axis in inner if axis not in gone] + added
    spans = [(0, inner[0][0]), *middle, (inner[-1][1], width)]
    return tuple(span for span in spans if span[1] > span[0])
