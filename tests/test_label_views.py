"""Parses drawn over their pictures."""

from __future__ import annotations

import numpy as np

from facade_tools.artifacts.parse import ImageInfo, Parse, Region
from facade_tools.imaging.label_views import COLORS, overlay

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def test_borders_are_thin_in_long_pictures():
    """A window of 30×40 pixels in a strip of 6,000×200 stays to be seen."""
    window = Region("window", 50, 60, 80, 100)
    regions = (Region("wall", 0, 0, 6000, 200), window)
    parse = Parse(
        "strip", ImageInfo("strip.png", (6000, 200), "0" * 64), IDENTITY, "m", "s", "g", "", 0.0,
        (6000, 200), regions=regions, floors=(),
    )  # fmt: skip
    drawn = overlay(np.full((200, 6000, 3), 100, np.uint8), parse)
    border = (drawn[60:100, 50:80] == COLORS["window"]).all(axis=2)
    assert border[0].all()
    assert not border[5:-5, 5:-5].any()
