"""Colours of whole houses: templates of training buildings, or a shipped palette."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..artifacts.building import Colors
from ..artifacts.library import LibraryBuilding

PALETTE: tuple[Colors, ...] = (
    Colors("#e9e2d0", "#ffffff", "#5a4a42", "#7a2f24"),
    Colors("#c9d3d8", "#ffffff", "#4a4e54", "#20364f"),
    Colors("#a9583f", "#f1ebe0", "#3f3a38", "#23402f"),
    Colors("#d8c9a3", "#6b4a2f", "#6e5a48", "#4d2c1a"),
    Colors("#f4f1ea", "#3a3d40", "#2f3235", "#c8642b"),
    Colors("#8fa5b8", "#fbfaf6", "#54585e", "#f0c24b"),
)
SPREAD = 0.02  # how far a channel moves from its template, so that no two streets are alike


def house_colors(similar: Sequence[LibraryBuilding], *, rng: np.random.Generator) -> Colors:
    """Return wall, trim, roof and door colour of one house.

    A template of one of the similar buildings (of the shipped palette where they have none); wall
    and roof are varied by a little, alike in all channels, so that their hue stays.
    """
    templates = [row.colors for row in similar if row.colors is not None] or list(PALETTE)
    chosen = templates[int(rng.integers(len(templates)))]
    wall, roof = rng.normal(0.0, SPREAD, 2).tolist()
    return Colors(
        _lighter(chosen.wall, wall), chosen.trim, _lighter(chosen.roof, roof), chosen.door
    )


def _lighter(color: str, by: float) -> str:
    """Return #rrggbb with all channels moved by a share of full scale, clipped.

    >>> _lighter("#808080", 0.1)
    '#9a9a9a'
    """
    channels = [int(color[i : i + 2], 16) + round(255 * by) for i in (1, 3, 5)]
    return "#" + "".join(f"{min(max(channel, 0), 255):02x}" for channel in channels)
