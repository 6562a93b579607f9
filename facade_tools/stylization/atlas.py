"""Many small pictures on few large ones, padded so that mip levels do not bleed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ..errors import Infeasible
from ..geometry.arrays import Floats, Integers
from ..imaging.image_io import Picture

PADDING = 8  # pixels of the border's own colour around every picture: three mip levels
LARGEST_PAGE = 8192
USUAL_HEIGHT = 4096  # a page ends here unless one picture is higher
QUALITY = 95  # of JPEG


@dataclass(frozen=True, slots=True)
class Atlas:
    """Where pictures stand: of every page its height and width, of every picture its place.

    corners (n, 2): row and column of a picture's first pixel on its page. rectangles (n, 4): left,
    bottom, right, top, origin at the page's lower left.
    """

    sheets: tuple[tuple[int, int], ...]
    page: tuple[int, ...]
    corners: Integers
    rectangles: Floats


def planned(shapes: Sequence[tuple[int, int]]) -> Atlas:
    """Place pictures of given heights and widths (pixels) on shelves, highest first.

    Raises Infeasible for one larger than a page.
    """
    sizes = np.array(shapes, dtype=np.int64).reshape(-1, 2) + 2 * PADDING
    if len(sizes) and sizes.max() > LARGEST_PAGE:
        raise Infeasible(f"a texture of {sizes.max()} pixels does not fit {LARGEST_PAGE}")
    width = _page_width(sizes)
    page, corner, heights = _shelves(sizes, width)
    corners = np.array(corner, dtype=np.int64).reshape(-1, 2)[:, ::-1] + PADDING
    ends = corners + sizes - 2 * PADDING
    height = np.array(heights)[np.array(page, dtype=np.int64)]
    rectangles = np.stack(
        [
            corners[:, 1] / width,
            1 - ends[:, 0] / height,
            ends[:, 1] / width,
            1 - corners[:, 0] / height,
        ],
        axis=1,
    )
    return Atlas(tuple((h, width) for h in heights), tuple(page), corners, rectangles)


def painted(atlas: Atlas, number: int, draw: Callable[[int], Picture]) -> Picture:
    """Return a page; draw: gives the picture of an index. One page is in memory at a time."""
    sheet = np.zeros((*atlas.sheets[number], 3), dtype=np.uint8)
    for i in (i for i, page in enumerate(atlas.page) if page == number):
        picture = draw(i)
        (top, left), (rows, columns) = atlas.corners[i].tolist(), picture.shape[:2]
        bottom, right = top + rows, left + columns
        sheet[top:bottom, left:right] = picture
        sheet[top:bottom, left - PADDING : left] = picture[:, :1]
        sheet[top:bottom, right : right + PADDING] = picture[:, -1:]
        whole = sheet[:, left - PADDING : right + PADDING]
        whole[top - PADDING : top] = whole[top]
        whole[bottom : bottom + PADDING] = whole[bottom - 1]
    return sheet


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
    """Return a page as JPEG, its colour at half the resolution: an atlas is twice as fine."""
    flags = [cv2.IMWRITE_JPEG_QUALITY, QUALITY]
    flags += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420]
    done, data = cv2.imencode(".jpg", cv2.cvtColor(page, cv2.COLOR_RGB2BGR), flags)
    if not done:
        raise RuntimeError("JPEG encoding failed")
    return data.tobytes()
