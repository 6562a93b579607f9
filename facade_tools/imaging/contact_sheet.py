"""Many pictures on one sheet, each with its label."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from .render import Picture

GAP = 6  # pixels between pictures
CAPTION = 22
PAPER = (250, 250, 248)
INK = (60, 62, 66)
SIDE_VIEWS = {"front": -25.0, "right": 65.0, "back": 155.0, "left": 245.0}  # azimuths, degrees


def contact_sheet(
    pictures: Sequence[Picture], labels: Sequence[str] = (), columns: int | None = None
) -> Picture:
    """Return one picture of all, in reading order, each cell as large as the largest picture.

    labels: one a picture, or none at all. columns: default makes the sheet about 4:3.
    """
    if not pictures:
        return np.full((CAPTION, 4 * CAPTION, 3), PAPER, dtype=np.uint8)
    height = max(picture.shape[0] for picture in pictures)
    width = max(picture.shape[1] for picture in pictures)
    columns = min(columns or math.ceil(math.sqrt(len(pictures))), len(pictures))
    rows = math.ceil(len(pictures) / columns)
    caption = CAPTION if labels else 0
    step_x, step_y = width + GAP, height + GAP + caption
    sheet = np.full((rows * step_y + GAP, columns * step_x + GAP, 3), PAPER, dtype=np.uint8)
    for index, picture in enumerate(pictures):
        row, column = divmod(index, columns)
        y, x = row * step_y + GAP, column * step_x + GAP
        sheet[y : y + picture.shape[0], x : x + picture.shape[1]] = picture[:, :, :3]
        if labels:
            _caption(sheet, labels[index], (x + 2, y + height + CAPTION - 7), width)
    return sheet


def _caption(sheet: Picture, text: str, place: tuple[int, int], width: int) -> None:
    plain = text.encode("ascii", "replace").decode()
    font, scale = cv2.FONT_HERSHEY_SIMPLEX, 0.42
    while len(plain) > 4 and cv2.getTextSize(plain, font, scale, 1)[0][0] > width - 4:
        plain = plain[:-4] + "..."
    cv2.putText(sheet, plain, place, font, scale, INK, 1, cv2.LINE_AA)
