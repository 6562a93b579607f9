"""Pictures of the docs from those of `facade view`: side by side, smaller, as JPEG.

    python docs/pictures/sheet.py PICTURE... -o OUT [--columns N] [--height H] [--width W]

--height: of each picture; --width: of the whole; --columns: pictures a row (all in one).
"""

from __future__ import annotations

import argparse

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]  # (h, w, 3)


def scaled(picture: Picture, factor: float) -> Picture:
    """Return a picture `factor` times as large."""
    size = (round(picture.shape[1] * factor), round(picture.shape[0] * factor))
    method = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(picture, size, interpolation=method), np.uint8)


def side_by_side(pictures: list[Picture]) -> Picture:
    """Return pictures in a row, white below the lower ones."""
    height = max(len(picture) for picture in pictures)
    padded = [
        np.pad(picture, ((0, height - len(picture)), (0, 0), (0, 0)), constant_values=255)
        for picture in pictures
    ]
    return np.concatenate(padded, axis=1)


def below(rows: list[Picture]) -> Picture:
    """Return rows below each other, white at the right of the narrower ones."""
    width = max(row.shape[1] for row in rows)
    padded = [
        np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0)), constant_values=255)
        for row in rows
    ]
    return np.concatenate(padded, axis=0)


def main() -> None:
    """Write the pictures side by side."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", nargs="+")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--columns", type=int)
    parser.add_argument("--height", type=int)
    parser.add_argument("--width", type=int)
    options = parser.parse_args()
    pictures = [
        np.asarray(cv2.imread(path, cv2.IMREAD_COLOR), np.uint8) for path in options.pictures
    ]
    if options.height:
        pictures = [scaled(picture, options.height / len(picture)) for picture in pictures]
    columns = options.columns or len(pictures)
    rows = [pictures[k : k + columns] for k in range(0, len(pictures), columns)]
    whole = below([side_by_side(row) for row in rows])
    if options.width:
        whole = scaled(whole, options.width / whole.shape[1])
    jpeg = [cv2.IMWRITE_JPEG_QUALITY, 80] if options.output.endswith(".jpg") else []
    cv2.imwrite(options.output, whole, jpeg)


if __name__ == "__main__":
    main()
