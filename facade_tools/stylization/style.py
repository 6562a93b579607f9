"""What a retarget takes the look from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..artifacts.blocks import Blocks
from ..artifacts.stylesheet import StyleSheet
from ..imaging.image_io import Picture


@dataclass(frozen=True, slots=True)
class Style:
    """A style sheet with its pictures by file name, and the source's own blocks."""

    sheet: StyleSheet
    blocks: Blocks
    pictures: Mapping[str, Picture]
