"""Many small pictures on few large ones, padded so that mip levels do not bleed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ..errors import Infeasible
from ..geometry.arrays import Floats
from ..imaging.image_io import Picture

PADDING = 8  # pixels of the border's own colour around every picture: three mip levels
LARGEST_PAGE = 8192
USUAL_HEIGHT = 4096  # a page ends here unless one picture is higher
QUALITY = 95  # of JPEG


@dataclass(frozen=True, slots=True)
class Atlas:
    """Pages as pictures, and for every input its page and uv rectangle.

    rectangles (n, 4): left, bottom, right, top, origin at the page's lower left.
    """

    pages: tuple[Picture, ...]
    page: tuple[int, ...]
    rectangles: Floats


def packed(pictures: Sequence[Picture]) -> Atlas:
    """Place pictures on shelves, highest first. Raises Infeasible for one larger than a page."""
    sizes = np.array([p.shape[:2] for p in pictures], dtype=np.int64).reshape(-1, 2) + 2 * PADDING
    if len(sizes) and sizes.max() > LARGEST_PAGE:
        raise Infeasible(f"a texture of {sizes.max()} pixels does not fit {LARGEST_PAGE}")
    width = _page_width(sizes)
    page, corner, heights = _shelves(sizes, width)
    pages = [np.zeros((height, width, 3), dtype=np.uint8) for height in heights]
    rectangles = np.empty((len(pictures), 4))
    for i, picture in enumerate(pictures):
        x, y = corner[i]
        rows, columns = sizes[i]
        sheet = pages[page[i]]
        edge = cv2.BORDER_REPLICATE
        bordered = cv2.copyMakeBorder(picture, PADDING, PADDING, PADDING, PADDING, edge)
        sheet[y : y + rows, x : x + columns] = bordered
        box = (x + PADDING, y + rows - PADDING, x + columns - PADDING, y + PADDING)
        scale = (width, sheet.shape[0]) * 2
        left, bottom, right, top = (b / s for b, s in zip(box, scale, strict=True))
        rectangles[i] = left, 1 - bottom, right, 1 - top
    return Atlas(tuple(pages), tuple(page), rectangles)


def _page_width(sizes: np.ndarray) -> int:
    """Return a power of two near the side of a square that holds everything."""
    area = float(sizes.prod(axis=1).sum()) if len(sizes) else 1.0
    widest = int(sizes[:, 1].max()) if len(sizes) else 1
    wanted = max(widest, int(1.1 * area**0.5), 64)
    return min(1 << (wanted - 1).bit_length(), LARGEST_PAGE)


def _shelves(sizes: np.ndarray, width: int) -> tuple[list[int], list[tuple[int, int]], list[int]]:
    order = sorted(range(len(sizes)), key=lambda i: (-sizes[i, 0], -sizes[i, 1], i))
    page = [0] * len(sizes)
    corner = [(0, 0)] * len(sizes)
    x = y = shelf = current = 0
    heights: list[int] = []
    for i in order:
        rows, columns = (int(v) for v in sizes[i])
        if x + columns > width:
            x, y, shelf = 0, y + shelf, 0
        if y + rows > max(USUAL_HEIGHT, rows):
            heights.append(y)
            current, x, y, shelf = current + 1, 0, 0, 0
        page[i], corner[i] = current, (x, y)
        x, shelf = x + columns, max(shelf, rows)
    return page, corner, [*heights, y + shelf]


def encoded_page(page: Picture) -> bytes:
    """Return a page as JPEG (quality 95, no chroma subsampling)."""
    flags = [cv2.IMWRITE_JPEG_QUALITY, QUALITY]
    flags += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444]
    done, data = cv2.imencode(".jpg", page[:, :, ::-1], flags)
    if not done:
        raise RuntimeError("JPEG encoding failed")
    return data.tobytes()
