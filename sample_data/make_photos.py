"""Render the sample photographs: facades of the shipped grammars, no real picture in them.

python sample_data/make_photos.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from facade_tools.grammar.library import builtin
from facade_tools.imaging.homography import fitted_homography, warped
from facade_tools.imaging.image_io import encoded
from facade_tools.randomness import item_generator
from facade_tools.segmentation.painting import render_facade

FOLDER = Path(__file__).resolve().parent / "photos"
SIZES = {"facade-1": 380, "facade-2": 500, "facade-3": 300}
HEIGHT = 576


def main() -> None:
    """Write the pictures."""
    FOLDER.mkdir(exist_ok=True)
    for number, (name, width) in enumerate(SIZES.items()):
        rng = item_generator(12, "sample-photo", number)
        _, picture, _ = render_facade(builtin("haussmann-floors"), width, HEIGHT, rng=rng)
        (FOLDER / f"{name}.jpg").write_bytes(encoded(picture, ".jpg"))
    corners = np.array([[0, 0], [300, 0], [300, 576], [0, 576]], np.float64)
    seen = np.array([[90, 40], [400, 110], [410, 560], [70, 640]], np.float64)
    angled = warped(picture, fitted_homography(corners, seen), (480, 680))
    (FOLDER / "at-an-angle.jpg").write_bytes(encoded(angled, ".jpg"))


if __name__ == "__main__":
    main()
