"""Label maps and parses as pictures."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from ..artifacts.parse import Parse
from .homography import warped
from .image_io import Picture, fitted, read_photo

COLORS = {
    "outlier": (20, 20, 20), "window": (226, 60, 50), "wall": (244, 214, 100),
    "balcony": (128, 40, 210), "door": (240, 140, 30), "roof": (50, 80, 190),
    "sky": (150, 220, 245), "shop": (60, 170, 80), "chimney": (128, 128, 128),
}  # fmt: skip
MAX_VIEW = 1600  # pixels of the longer side


def overlay(picture: Picture, parse: Parse, strength: float = 0.45) -> Picture:
    """Return a picture with the regions of its parse laid over it, and their borders."""
    out = picture.copy()
    for region in parse.regions:
        part = out[region.y0 : region.y1, region.x0 : region.x1]
        color = np.array(COLORS.get(region.label, (255, 0, 255)), np.float32)
        part[:] = ((1 - strength) * part + strength * color).astype(np.uint8)
    thickness = max(1, round(min(out.shape[:2]) / 500))
    for region in parse.regions:
        if region.label in ("window", "balcony", "door", "chimney"):
            low, high = (region.x0, region.y0), (region.x1 - 1, region.y1 - 1)
            cv2.rectangle(out, low, high, COLORS[region.label], thickness)
    return out


def parse_view(parse: Parse) -> Picture:
    """Return a parse drawn over its picture where that very file is in the working directory.

    Told by name and digest; elsewhere the regions are drawn alone.
    """
    path = Path(parse.image.name)
    if path.name == parse.image.name and path.is_file():
        photo = read_photo(str(path))
        if photo.sha256 == parse.image.sha256:
            turn = np.array(parse.rectification, np.float64)
            straight = warped(photo.pixels, turn, (parse.image.size[0], parse.image.size[1]))
            return _shrunk(overlay(straight, parse))
    width, height = parse.image.size
    return _shrunk(overlay(np.zeros((height, width, 3), np.uint8), parse, 1.0))


def _shrunk(picture: Picture) -> Picture:
    return fitted(picture, MAX_VIEW, MAX_VIEW * MAX_VIEW)
