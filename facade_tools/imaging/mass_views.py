"""A building's box plan, and the curve of its mass energy (as FW16 Fig. 6)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from ..artifacts.building import Box, Building
from .attribute_glyphs import FAINT, FONT, GARAGE, INK, MASS, PAPER, PORCH
from .render import Picture

COLORS = {"general": MASS, "garage": GARAGE, "porch": PORCH}
CURVE = (74, 105, 138)
LEAST = 1e-16  # energies below it are drawn there
MARGIN = 0.12

Pixel = tuple[int, int]


def mass_pictures(building: Building, size: tuple[int, int]) -> list[Picture]:
    """Return two pictures of `size` (width, height): the plan of the boxes, the energy curve."""
    return [box_plan(building.boxes, size), energy_curve(building, size)]


def box_plan(boxes: Sequence[Box], size: tuple[int, int]) -> Picture:
    """Return the boxes from above, each outlined; the front is below."""
    sheet = _sheet(size)
    if not boxes:
        return sheet
    low = min(b.x - b.width / 2 for b in boxes), min(b.y - b.depth / 2 for b in boxes)
    high = max(b.x + b.width / 2 for b in boxes), max(b.y + b.depth / 2 for b in boxes)
    spans = high[0] - low[0], high[1] - low[1]
    scale = min((1 - 2 * MARGIN) * pixels / span for pixels, span in zip(size, spans, strict=True))

    def at(x: float, y: float) -> Pixel:
        middle = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2
        return (
            round(size[0] / 2 + (x - middle[0]) * scale),
            round(size[1] / 2 - (y - middle[1]) * scale),
        )

    corners = [
        (
            at(b.x - b.width / 2, b.y - b.depth / 2),
            at(b.x + b.width / 2, b.y + b.depth / 2),
            COLORS[b.kind],
        )
        for b in boxes
    ]
    for a, c, color in corners:
        cv2.rectangle(sheet, a, c, color, -1)
    for a, c, _ in corners:
        cv2.rectangle(sheet, a, c, INK, 1, cv2.LINE_AA)
    return sheet


def energy_curve(building: Building, size: tuple[int, int]) -> Picture:
    """Return the least energy over the number of layouts polished, both axes logarithmic.

    The curve is the building's tag `mass_energy_curve`, which massgen writes.
    """
    sheet = _sheet(size)
    points = _points(building.tags.get("mass_energy_curve"))
    if not points:
        _text(sheet, "no energy curve", (20, size[1] // 2))
        return sheet
    left, right, top, bottom = 60, size[0] - 20, 20, size[1] - 36
    last = max(math.log10(max(points[-1][0], 10)), 1.0)

    def at(done: float, energy: float) -> Pixel:
        decade = math.log10(max(energy, LEAST))
        share = (1.0 - decade) / (1.0 - math.log10(LEAST))
        x = left + math.log10(max(done, 1)) / last * (right - left)
        return round(x), round(min(max(top + share * (bottom - top), top), bottom))

    for decade in (0, -4, -8, -12, -16):
        row = at(1, 10.0**decade)[1]
        cv2.line(sheet, (left, row), (right, row), FAINT, 1)
        _text(sheet, f"1e{decade}", (8, row + 4))
    path: list[Pixel] = []
    for done, energy in points:
        if path:
            path.append((at(done, energy)[0], path[-1][1]))
        path.append(at(done, energy))
    path.append((right, path[-1][1]))
    cv2.polylines(sheet, [np.array(path, dtype=np.int32)], False, CURVE, 2, cv2.LINE_AA)
    reached = building.energy.mass if building.energy else None
    note = "" if reached is None else f"E = {reached:.2g} over {points[-1][0]:.0f} layouts polished"
    _text(sheet, note, (left, size[1] - 12))
    return sheet


def _points(tag: object) -> list[tuple[float, float]]:
    """Return the curve of a tag, nothing where it is something else."""
    if not isinstance(tag, Sequence) or isinstance(tag, str):
        return []
    rows = [row for row in tag if isinstance(row, Sequence) and len(row) == 2]
    return [(float(done), float(energy)) for done, energy in rows]


def _sheet(size: tuple[int, int]) -> Picture:
    return np.full((size[1], size[0], 3), PAPER, dtype=np.uint8)


def _text(sheet: Picture, words: str, at: Pixel) -> None:
    cv2.putText(sheet, words, at, FONT, 0.4, INK, 1, cv2.LINE_AA)
