"""A parse and a footprint become a textured building (KSTTP09 section 4, Fig. 1)."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.building import Building, Colors
from ..artifacts.derivation import Derivation
from ..artifacts.parse import Parse
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Points2, Points3
from ..geometry.mesh import Scene
from ..imaging.homography import warped
from ..imaging.image_io import Picture
from .boxed import derived_building
from .drawing import Look, Painted, derived_scene
from .elevation import Elevation, elevation, label_map, stretched
from .engine import Derived, Leaf, Lot, derive
from .facets import faceted
from .records import derivation_of
from .specific import Cover, Design, Specific, specific_grammar
from .surfaces import (
    TILE_METRES,
    Surfaces,
    colors_of,
    surfaces_of,
    view_of,
    without_rim,
)
from .widening import widened

log = logging.getLogger("facade_tools.reconstruction")

SQUEEZED = 0.5  # of its width: a facade narrower than that is not put on its wall
DEPTH = 12.0  # metres, of the default footprint


@dataclass(frozen=True, slots=True)
class Ask:
    """What the user says beside the parse.

    storey_height, height: metres (see elevation). depth: of the default footprint, metres. roof:
    flat, gable, hip, mansard or auto. party: sides that are blind walls. hint: the roof that the
    footprint tells of, for where the picture shows none.
    """

    storey_height: float | None = None
    height: float | None = None
    depth: float = DEPTH
    roof: str = "auto"
    party: frozenset[str] = frozenset()
    hint: str = "flat"


@dataclass(frozen=True, slots=True)
class Reconstruction:
    """The elevation, the specific grammar, what it derives, and its textures.

    seen: no axis was added or left out, so that what stands on the front is what is in the picture.
    """

    name: str
    plan: Elevation
    specific: Specific
    derived: Derived
    surfaces: Surfaces
    seen: bool = True

    def scene(self) -> Scene:
        """Return the textured scene; `mass` is its closed solid."""
        look = Look(_Painter(self.specific), self.surfaces.materials)
        return derived_scene(self.derived, self.name, look)

    def building(self) -> Building:
        """Return the parametric building; what the front shows is known."""
        made = derived_building(
            self.derived, self.name, self.plan.storey, ["front"] if self.seen else [], axes=True
        )
        colors = self.surfaces.colors
        own = Colors(colors["wall"], "#efeae0", colors["roof"], colors["door"])
        return replace(made, colors=own)

    def tree(self) -> Derivation:
        """Return the derivation."""
        return derivation_of(self.derived, self.specific.grammar, self.name)


def reconstruct(
    parse: Parse,
    photo: Picture,
    lots: Sequence[Lot] = (),
    ask: Ask | None = None,
    *,
    rng: np.random.Generator,
) -> Reconstruction:
    """Return the building of a parse on a footprint, by default a rectangle behind the facade.

    photo: the picture that was parsed, (h, w, 3). lots: outlines whose widest side to the front
    (−y) is the parsed facade, of which axes repeat or are left out where the wall is wider or
    narrower, and repeat as on the other sides where it would be squeezed to less than half; a
    lot's height, where not 0, is that of its eaves. Curves in short walls get walls as wide as an
    axis. Raises InvalidInput where the parse shows no building or the picture is another.
    """
    ask = ask or Ask()
    labels = label_map(parse)
    picture = without_rim(_rectified(photo, parse, labels.shape))
    plan = elevation(parse, ask.storey_height, ask.height)
    if not plan.openings:
        log.warning("%s: shows neither window nor door", parse.id)
    shown = picture, labels, plan
    more, squeeze = None, 1.0
    if lots:
        lots = [replace(lot, rings=[faceted(ring) for ring in lot.rings]) for lot in lots]
        width, top = _front(lots)
        more = widened(labels, width / plan.width * (plan.eaves / top if top else 1.0))
        if more is not None:
            parse, picture = more.parse(parse), more.picture(picture)
            labels, plan = label_map(parse), elevation(parse, ask.storey_height, ask.height)
        squeeze = width / plan.width * (plan.eaves / top if top else 1.0)
        plan = stretched(plan, width, top)
    else:
        lots = [_rectangle(plan.width, ask.depth)]
    colors = colors_of(picture, labels)
    own = stretched(shown[2], shown[2].width, plan.eaves)
    front, sides = view_of(picture, labels, plan), view_of(shown[0], shown[1], own)
    surfaces = surfaces_of(front, sides, colors, rng=rng)
    fits = squeeze >= SQUEEZED or not surfaces.axes
    design = Design(_roof(plan, ask), surfaces.axes, ask.party, surfaces.colors, fits)
    specific = specific_grammar(plan, design, parse.id)
    derived = derive(specific.grammar, lots, rng=rng)
    return Reconstruction(parse.id, plan, specific, derived, surfaces, fits and more is None)


def _rectified(photo: Picture, parse: Parse, shape: tuple[int, ...]) -> Picture:
    """Return the photograph in the pixels of the parse's regions."""
    turn = np.array(parse.rectification, float)
    if not np.allclose(turn, np.eye(3)):
        return warped(photo, turn, (shape[1], shape[0]))
    if photo.shape[:2] != tuple(shape):
        found, wanted = (f"{s[1]}×{s[0]}" for s in (photo.shape, shape))
        raise InvalidInput(f"the picture has {found} pixels; the parse is of {wanted}")
    return photo


def _rectangle(width: float, depth: float) -> Lot:
    w, d = width / 2, depth / 2
    return Lot([np.array([[-w, -d], [w, -d], [w, d], [-w, d]])])


def _front(lots: Iterable[Lot]) -> tuple[float, float | None]:
    """Return width and eaves of the widest wall that looks to the front, or of the widest."""
    rows = []
    for lot in lots:
        for ring in lot.rings:
            steps = np.roll(ring, -1, axis=0) - ring
            lengths = np.hypot(*steps.T)
            front = (np.abs(steps[:, 1]) <= np.abs(steps[:, 0]) + 1e-9) & (steps[:, 0] > 0)
            rows += [
                (bool(f), float(length), lot.height or None)
                for f, length in zip(front, lengths, strict=True)
            ]
    _, width, height = max(rows, key=lambda row: row[:2])
    return width, height


def _roof(plan: Elevation, ask: Ask) -> str:
    """Return the roof's style: what is asked for, what the picture suggests, or the hint."""
    if ask.roof != "auto":
        return ask.roof
    if plan.loft <= 0:
        return ask.hint
    return "mansard" if plan.dormers or plan.loft > 1.6 else "hip"


@dataclass(frozen=True, slots=True)
class _Painter:
    """Finds material and texture coordinates of a leaf's points."""

    specific: Specific

    def __call__(self, leaf: Leaf, points: Points3, normal: Floats) -> Painted | None:
        cover = self.specific.covers.get(leaf.shape.symbol)
        if cover is None:
            return None
        return cover.texture, _coordinates(leaf, points, cover)


def _coordinates(leaf: Leaf, points: Points3, cover: Cover) -> Points2:
    """Return the texture coordinates (n, 2) of points on a leaf."""
    scope = leaf.shape.scope
    local = ((points - scope.origin) @ scope.axes.T)[:, [0, 2]]
    if cover.rect is None:
        return np.asarray(local / TILE_METRES)
    u0, v0, u1, v1 = cover.rect
    share = local / np.maximum(scope.size[[0, 2]], 1e-9)
    return np.asarray(np.array([u0, v0]) + share * np.array([u1 - u0, v1 - v0]))
