"""A model as a picture: its styles, hidden variables and lateral edges."""

from __future__ import annotations

from math import cos, pi, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.model import Model

Picture = NDArray[np.uint8]

SIZE = 720
RADIUS = 240
INK, EDGE, NODE = (40, 40, 40), (194, 85, 63), (138, 164, 200)


def model_picture(model: Model) -> Picture:
    """Return groups on a circle with their cardinalities, lateral edges as arrows, styles as a bar.

    RGB (720, 720, 3).
    """
    picture = np.full((SIZE, SIZE, 3), 255, dtype=np.uint8)
    names = [group.name for group in model.groups]
    names += sorted({name for edge in model.edges for name in edge} - set(names))
    place = {name: _on_circle(i, len(names), RADIUS) for i, name in enumerate(names)}
    for start, end in model.edges:
        _arrow(picture, place[start], place[end])
    for i, name in enumerate(names):
        cv2.circle(picture, place[name], 18, NODE, -1, cv2.LINE_AA)
        size = model.cardinalities.get(name)
        _text(picture, "" if size is None else str(size), place[name])
        _text(picture, name, _on_circle(i, len(names), RADIUS + 46))
    _styles(picture, model)
    return picture


def _on_circle(index: int, count: int, radius: int) -> tuple[int, int]:
    angle = 2 * pi * index / count - pi / 2
    return round(SIZE / 2 + radius * cos(angle)), round(SIZE / 2 + 20 + radius * sin(angle))


def _arrow(picture: Picture, start: tuple[int, int], end: tuple[int, int]) -> None:
    a, b = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
    step = (b - a) / max(float(np.linalg.norm(b - a)), 1.0) * 20
    first, last = np.rint(a + step).astype(int).tolist(), np.rint(b - step).astype(int).tolist()
    cv2.arrowedLine(picture, first, last, EDGE, 2, cv2.LINE_AA, tipLength=0.06)


def _text(picture: Picture, text: str, center: tuple[int, int]) -> None:
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.55, 1)
    corner = (center[0] - width // 2, center[1] + height // 2)
    cv2.putText(picture, text, corner, cv2.FONT_HERSHEY_SIMPLEX, 0.55, INK, 1, cv2.LINE_AA)


def _styles(picture: Picture, model: Model) -> None:
    """Draw the shares of the styles as a bar along the top."""
    title = f"{model.variant}, {model.count} buildings, {len(model.style)} styles"
    _text(picture, title, (SIZE // 2, 24))
    ends = 20 + np.cumsum([0.0, *model.style]) * (SIZE - 40)
    for i in range(len(model.style)):
        shade = 150 + 90 * (i % 2)
        left, right = round(float(ends[i])), round(float(ends[i + 1]))
        cv2.rectangle(picture, (left, 40), (right, 58), (shade, shade, 255), -1)
