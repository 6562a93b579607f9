"""What one picture shows of a building's side: its walls' extent, its storeys, its openings.

From a parse or from a label map (an annotation): both give openings as boxes in pixels, y down.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS, Parse
from ..errors import InvalidInput

Labels = NDArray[np.uint8]  # (height, width), indices of LABELS
Boxes = NDArray[np.float64]  # (n, 4) x0, y0, x1, y1, half-open pixels

WINDOW, DOOR = LABELS.index("window"), LABELS.index("door")
FACADE = [LABELS.index(name) for name in ("wall", "balcony", "door", "shop")]
ABOVE = [LABELS.index(name) for name in ("outlier", "roof", "sky", "chimney")]
LEAST = 0.002  # of the facade's sides: smaller components are noise
FILLED = 0.4  # of its bounding box: what a component fills at least
SILL = 0.45  # where a storey line runs between the heads of windows and the sills above them
FAINT = 0.25  # of the fullest row's windows, by width: a row from here
SHORT = 0.6  # of a storey: what is left below the lowest row of windows is a storey from here


@dataclass(frozen=True, slots=True)
class SideView:
    """A side as a picture shows it, pixels, y down.

    x0, x1: ends of the wall. lines: storey lines from the ground to the eaves (k+1), falling.
    windows, doors: boxes between the ground and the eaves. scale: metres of a pixel where known.
    """

    x0: float
    x1: float
    lines: tuple[float, ...]
    windows: Boxes
    doors: Boxes
    scale: float | None = None

    @property
    def storeys(self) -> int:
        """How many storeys are seen."""
        return len(self.lines) - 1

    @property
    def storey(self) -> float:
        """Height of a storey in pixels: the median."""
        return float(np.median(-np.diff(self.lines)))


def view_of_parse(parse: Parse) -> SideView:
    """Return what a parse shows. Raises InvalidInput where it shows no wall."""
    width, height = parse.image.size
    labels = np.zeros((height, width), np.uint8)
    for region in parse.regions:
        if region.label not in LABELS:
            raise InvalidInput(f"region of unknown label {region.label!r}")
        labels[region.y0 : region.y1, region.x0 : region.x1] = LABELS.index(region.label)
    windows, doors = (
        _joined([(r.x0, r.y0, r.x1, r.y1) for r in parse.regions if r.label == label])
        for label in ("window", "door")
    )
    known = parse.tags.get("metres_per_pixel")
    given = parse.tags.get("scale") in ("height", "storey-height")
    scale = float(known) if given and isinstance(known, int | float) else None
    return _view(labels, windows, doors, scale)


def view_of_labels(labels: Labels) -> SideView:
    """Return what a label map shows; connected pixels are one opening.

    Raises InvalidInput where it shows no wall.
    """
    return _view(labels, _components(labels, WINDOW), _components(labels, DOOR), None)


def _components(labels: Labels, label: int) -> Boxes:
    mask = (labels == label).astype(np.uint8)
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    least = LEAST * min(labels.shape) * 4
    rows = [
        (x, y, x + w, y + h)
        for x, y, w, h, area in stats[1:count].tolist()
        if min(w, h) >= max(2, least) and area >= FILLED * w * h
    ]
    return _array(rows)


def _array(rows: Iterable[Sequence[float]]) -> Boxes:
    return np.array(list(rows), np.float64).reshape(-1, 4)


def _joined(rows: list[tuple[int, int, int, int]]) -> Boxes:
    """Return boxes, those of one width that stand on one another as one (a door of two parts)."""
    out: list[tuple[int, int, int, int]] = []
    for x0, y0, x1, y1 in sorted(rows, key=lambda row: (row[0], row[2], row[1])):
        if out and (out[-1][0], out[-1][2]) == (x0, x1) and out[-1][3] == y0:
            out[-1] = (x0, out[-1][1], x1, y1)
        else:
            out.append((x0, y0, x1, y1))
    return _array(out)


def _view(labels: Labels, windows: Boxes, doors: Boxes, scale: float | None) -> SideView:
    wall = np.isin(labels, FACADE)
    other = np.isin(labels, ABOVE)
    top, bottom = _longest(wall.sum(axis=1) >= np.maximum(other.sum(axis=1), 1))
    body = slice(top, bottom)
    left, right = _longest(wall[body].sum(axis=0) >= np.maximum(other[body].sum(axis=0), 1))
    if bottom - top < 2 or right - left < 2:
        raise InvalidInput("shows no wall; expected a facade")
    area = (float(left), float(top), float(right), float(bottom))
    seen, entries = _inside(windows, area), _inside(doors, area)
    return SideView(area[0], area[2], _lines(seen, area[1], area[3]), seen, entries, scale)


def _longest(flags: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the longest run (start, stop) of true values, short breaks (2%) bridged."""
    bridge = max(1, len(flags) // 50)
    grown = np.concatenate([[False], flags, [False]])
    starts = np.flatnonzero(grown[1:] & ~grown[:-1])
    stops = np.flatnonzero(~grown[1:] & grown[:-1])
    best, low = (0, 0), 0
    for i, stop in enumerate(stops.tolist()):
        if i and starts[i] - stops[i - 1] > bridge:
            low = i
        if stop - int(starts[low]) > best[1] - best[0]:
            best = (int(starts[low]), stop)
    return best


def _inside(boxes: Boxes, area: tuple[float, float, float, float]) -> Boxes:
    """Return the boxes whose centre lies on the wall, clipped to it."""
    x, y = (boxes[:, 0] + boxes[:, 2]) / 2, (boxes[:, 1] + boxes[:, 3]) / 2
    x0, y0, x1, y1 = area
    kept = boxes[(x > x0) & (x < x1) & (y > y0) & (y < y1)]
    return np.column_stack([
        np.maximum(kept[:, 0], x0), np.maximum(kept[:, 1], y0),
        np.minimum(kept[:, 2], x1), np.minimum(kept[:, 3], y1),
    ]).reshape(-1, 4)  # fmt: skip


def rows_of(windows: Boxes) -> list[Boxes]:
    """Return windows by rows, from the ground; rows end at gaps above half the median height."""
    if not len(windows):
        return []
    ordered = windows[np.argsort(-(windows[:, 1] + windows[:, 3]), kind="stable")]
    centres = (ordered[:, 1] + ordered[:, 3]) / 2
    gap = float(np.median(ordered[:, 3] - ordered[:, 1])) / 2
    return np.split(ordered, np.flatnonzero(-np.diff(centres) > gap) + 1)


def _lines(windows: Boxes, top: float, bottom: float) -> tuple[float, ...]:
    """Return the storey lines from the ground (`bottom`) to the eaves (`top`).

    A line runs between two rows of windows. Below the lowest row there is another storey where
    the room for one is left. Faint rows (little window beside the fullest row) are none.
    """
    rows = rows_of(windows)
    glass = [float((row[:, 2] - row[:, 0]).sum()) for row in rows]
    most = max(glass, default=0.0)
    rows = [row for row, length in zip(rows, glass, strict=True) if length > FAINT * most]
    if not rows:
        return (bottom, top)
    heads = [float(np.median(row[:, 1])) for row in rows]
    sills = [float(np.median(row[:, 3])) for row in rows]
    inner = [low + SILL * (high - low) for low, high in zip(heads[:-1], sills[1:], strict=True)]
    middles = [(head + sill) / 2 for head, sill in zip(heads, sills, strict=True)]
    usual = float(np.median(-np.diff(middles))) if len(rows) > 1 else bottom - top
    first = (inner[0] if inner else top) + usual
    ground = [first] if bottom - first > SHORT * usual else []
    lines = [bottom, *ground, *inner, top]
    return tuple(line for line, after in pairwise([*lines, -1.0]) if line > after)
