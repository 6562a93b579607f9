"""A drawing of an attribute vector: plan of its boxes, bars of its shares, its bits."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ..artifacts.attributes import Attributes
from .render import Picture

SIZE = (300, 400)  # rows, columns
PAPER = (250, 250, 248)
INK = (60, 62, 66)
FAINT = (216, 217, 214)
MASS = (214, 203, 180)
GARAGE = (169, 184, 190)
PORCH = (201, 219, 186)
BAR = (74, 105, 138)
FONT = cv2.FONT_HERSHEY_SIMPLEX


def attribute_glyph(attributes: Attributes) -> Picture:
    """Return a picture (300, 400, 3): plan at the left, bars and bits at the right.

    What is unobserved is drawn in faint grey.
    """
    sheet = np.full((*SIZE, 3), PAPER, dtype=np.uint8)
    _plan(sheet, attributes)
    _bars(sheet, attributes)
    _bits(sheet, attributes)
    return sheet


def _plan(sheet: Picture, attributes: Attributes) -> None:
    width, depth, height = attributes.mass.bbox
    known = width is not None and depth is not None
    w, d = (width or 10.0, depth or 8.0)
    boxes = [(attributes.mass.garage, GARAGE), *((p, PORCH) for p in attributes.mass.porch)]
    rectangles = [(0.0, 0.0, w, d, MASS if known else FAINT)]
    for values, color in boxes:
        x, y, bw, bd = (value or 0.0 for value in values[:4])
        if bw > 0.0 and bd > 0.0:
            rectangles.append(
                (x * w - bw / 2, y * d - bd / 2, x * w + bw / 2, y * d + bd / 2, color)
            )
    low_x, low_y = min(r[0] for r in rectangles), min(r[1] for r in rectangles)
    high_x, high_y = max(r[2] for r in rectangles), max(r[3] for r in rectangles)
    scale = min(165 / (high_x - low_x), 190 / (high_y - low_y), 16.0)
    left, bottom = 18, 225
    for x0, y0, x1, y1, color in rectangles:
        a = (round(left + (x0 - low_x) * scale), round(bottom - (y0 - low_y) * scale))
        b = (round(left + (x1 - low_x) * scale), round(bottom - (y1 - low_y) * scale))
        cv2.rectangle(sheet, a, b, color, -1)
        cv2.rectangle(sheet, a, b, INK if known else FAINT, 1, cv2.LINE_AA)
    size = " x ".join("?" if value is None else f"{value:.1f}" for value in (width, depth, height))
    _text(sheet, f"{size} m", (left, 248))
    ratios = (
        ("far", attributes.mass.far),
        ("bcr", attributes.mass.bcr),
        ("bdry", attributes.mass.bdry),
    )
    _text(
        sheet, "  ".join(f"{n} {'?' if v is None else f'{v:.2f}'}" for n, v in ratios), (left, 266)
    )


def _bars(sheet: Picture, attributes: Attributes) -> None:
    rows = (
        ("arf", attributes.mass.arf, ("1", "2", "3")),
        ("wwr", attributes.facade.wwr, ("F", "B", "L", "R")),
        ("sym", attributes.facade.sym, ("F", "B", "L", "R")),
        ("align", attributes.facade.align, ("F", "B", "L", "R")),
    )
    for index, (name, values, labels) in enumerate(rows):
        _row(sheet, 205, 62 + 52 * index, name, values, labels)


def _row(
    sheet: Picture,
    x: int,
    base: int,
    name: str,
    values: Sequence[float | None],
    labels: Sequence[str],
) -> None:
    _text(sheet, name, (x, base))
    for index, (value, label) in enumerate(zip(values, labels, strict=True)):
        left = x + 42 + 36 * index
        cv2.rectangle(sheet, (left, base - 38), (left + 24, base), FAINT, 1)
        if value is not None:
            top = base - round(38 * min(max(value, 0.0), 1.0))
            cv2.rectangle(sheet, (left, top), (left + 24, base), BAR, -1)
        _text(sheet, label, (left + 27, base), 0.3)


def _bits(sheet: Picture, attributes: Attributes) -> None:
    element = attributes.element
    x, y = 205, 246
    for group in (element.roof, element.window, element.special):
        for name, bit in group.items():
            width = cv2.getTextSize(name, FONT, 0.33, 1)[0][0] + 8
            if x + width > SIZE[1] - 4:
                x, y = 205, y + 17
            if bit:
                cv2.rectangle(sheet, (x, y - 11), (x + width, y + 4), BAR, -1)
            _text(sheet, name, (x + 4, y), 0.33, PAPER if bit else (FAINT if bit is None else INK))
            x += width + 3


def _text(
    sheet: Picture,
    text: str,
    place: tuple[int, int],
    scale: float = 0.38,
    color: tuple[int, int, int] = INK,
) -> None:
    cv2.putText(sheet, text, place, FONT, scale, color, 1, cv2.LINE_AA)
