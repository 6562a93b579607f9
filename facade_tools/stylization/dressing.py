"""A base of any kind in one of several styles: buildings, layouts and blocks to textured models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..artifacts.blocks import Blocks
from ..artifacts.building import Building
from ..artifacts.layout import Layout
from ..geometry.arrays import Floats
from ..geometry.mesh import Scene
from .bases import brought_near, building_blocks, check_blocks, layout_blocks, with_ends
from .doors import door_covers
from .panels import SMALL
from .pitched import crowned
from .resizing import resized
from .retarget import retarget
from .structure import chosen_style
from .style import Style
from .walling import roof_covers

Base = Blocks | Building | Layout


@dataclass(frozen=True, slots=True)
class DressOptions:
    """How bases are dressed.

    sizes: new width, depth and height of blocks by their ids, metres; a resized building has flat
    roofs. small: see `retarget`. ends: whether the base gets a bottom and a top as high as the
    style's where there is room; None: unless it is Blocks, which say themselves what they have.
    """

    sizes: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    small: float = SMALL
    ends: bool | None = None


@dataclass(frozen=True, slots=True)
class Dressed:
    """The scene of a base, and how far that stands from its place (3,), metres: 0 but on a map."""

    scene: Scene
    shift: Floats


def dressed(
    base: Base,
    styles: Sequence[Style],
    options: DressOptions | None = None,
    *,
    rng: np.random.Generator,
) -> Dressed:
    """Return a base with the look of one of the styles, drawn by likeness of structure.

    A building keeps its pitched roofs, doors and garage doors. Raises InvalidInput on blocks that
    break a rule, and on sizes of blocks that it does not have.
    """
    options = options or DressOptions()
    building = base if isinstance(base, Building) else None
    ends = not isinstance(base, Blocks) if options.ends is None else options.ends
    blocks = _blocks(base)
    check_blocks(blocks)
    blocks, building, shift = brought_near(blocks, building)
    if options.sizes:
        blocks, building = resized(blocks, options.sizes), None
    style = styles[chosen_style([s.sheet.blocks for s in styles], blocks.blocks, rng=rng)]
    if ends:
        blocks = with_ends(blocks, style.blocks)
    if building is None:
        return Dressed(retarget(style, blocks, options.small), shift)
    covers = [*roof_covers(building), *door_covers(building)]
    scene = retarget(style, blocks, options.small, flush=True, covers=covers)
    return Dressed(crowned(scene, style, building), shift)


def _blocks(base: Base) -> Blocks:
    if isinstance(base, Building):
        return building_blocks(base)
    return layout_blocks(base) if isinstance(base, Layout) else base
