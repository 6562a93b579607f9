"""A source in its standard view: slabs, blocks, faces and their pictures (LNSW13 4.1, 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..artifacts.blocks import Block, Blocks
from ..formats.textured import TexturedMesh
from ..geometry.arrays import Floats
from ..imaging.image_io import Picture
from .framing import Standard, standard_view
from .outline import WallFace, faces_towards, wall_faces
from .projection import face_pictures, texel_density, working_density
from .remesh import Slab, on_grid, slabs, trimmed
from .roles import SeenTier, Tier, broken_at, colours, odd_slabs, tier_roles
from .structure import cuts
from .wings import wing_slab, wings

STOREY = 3.0  # m, to count the floors of a block
TALL = 0.3  # of the height: a slab in which shops or an attic are looked for
COARSE = 12.0  # pixels a metre, to look for them
COARSEST = 3.0  # pixels a metre, to compare colours


@dataclass(frozen=True, slots=True)
class CaptureOptions:
    """Choices of a capture; None means: find it.

    front: azimuth of the front's normal, degrees. up: auto, y or z. bottom, top: number of tiers
    of blocks that belong to the bottom and the top. window: objective window size (m). thickness:
    of walls (m), from the outer to the inner boundary; None: as deep as their relief.
    """

    front: float | None = None
    up: str = "auto"
    bottom: int | None = None
    top: int | None = None
    window: float | None = None
    thickness: float | None = None


@dataclass(frozen=True, slots=True)
class Part:
    """A block of the source.

    plans: the slabs' plans inside the block by the index of the slab. low, high: its least and
    greatest corner (m).
    """

    plans: dict[int, Slab]
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class Model:
    """A model in its standard view, cut into slabs and blocks.

    faces: upright faces of the outline, with the block of each. seams: faces between two blocks
    side by side, which nobody sees before the blocks are put elsewhere. pictures: of the faces,
    at `density` pixels a metre; resolution: of the source's own textures.
    """

    standard: Standard
    slabs: list[Slab]
    parts: list[Part]
    blocks: Blocks
    faces: list[WallFace]
    seams: list[WallFace]
    pictures: list[Picture]
    density: float
    resolution: float


def modelled(mesh: TexturedMesh, identity: str, options: CaptureOptions) -> Model:
    """Return the model of a mesh. Raises InvalidInput where it is no Manhattan building."""
    standard = standard_view(mesh, options.front, options.up)
    found, borders = _tiers(standard, slabs(standard.mesh.vertices, standard.mesh.faces), options)
    parts, tiers = _parts(found, [tier.first for tier in borders])
    faces, seams = _faces(found, parts)
    resolution = texel_density(standard.mesh)
    density = working_density(faces, resolution)
    pictures = face_pictures(standard.mesh, faces, density)
    roles = tier_roles(_seen(borders, tiers, found, faces, pictures), options.bottom, options.top)
    frame = tuple(tuple(float(v) for v in row) for row in standard.frame)
    blocks = tuple(
        _block(i, part, roles[tier])
        for i, (part, tier) in enumerate(zip(parts, tiers, strict=True))
    )
    model = Blocks(identity, blocks, frame)
    return Model(standard, found, parts, model, faces, seams, pictures, density, resolution)


def _tiers(
    standard: Standard, found: list[Slab], options: CaptureOptions
) -> tuple[list[Slab], list[Tier]]:
    """Cut slabs into tiers, at changes of the plan and where the textures change.

    Returns the slabs, of which up to two are cut in two, and the tiers.
    """
    starts = [0, *cuts([slab.area for slab in found])]
    if not any(p.picture is not None for p in standard.mesh.paints):
        return found, [Tier(start) for start in starts]
    wanted = options.bottom is None, options.top is None
    heights = [slab.height for slab in found]
    odd = odd_slabs(heights, starts, _looks(standard, found), wanted) if len(found) > 1 else set()
    tall = [i for i, height in enumerate(heights) if height > TALL * sum(heights)]
    levels: dict[int, list[float]] = {}
    for index, end in {(tall[0], 0), (tall[-1], 1)} if tall else set():
        level = _broken(standard, found[index], index, end) if wanted[end] else None
        if level is not None:
            levels.setdefault(index, []).append(level)
    return _split(found, starts, odd, levels)


def _looks(standard: Standard, found: Sequence[Slab]) -> list[Floats]:
    """Return the colours of every slab's walls as a histogram."""
    faces = [wall_faces(slab, index) for index, slab in enumerate(found)]
    pictures = face_pictures(standard.mesh, [face for own in faces for face in own], COARSEST)
    seen = iter(pictures)
    return [
        colours([next(seen) for _ in own], [face.width * face.height for face in own])
        for own in faces
    ]


def _broken(standard: Standard, slab: Slab, index: int, end: int) -> float | None:
    """Return the height (m) at which the rhythm of a slab's storeys begins (end 0) or stops (1)."""
    faces = [face for face in wall_faces(slab, index) if face.width > STOREY]
    if not faces:
        return None
    density = min(COARSE, working_density(faces, texel_density(standard.mesh)))
    pictures = face_pictures(standard.mesh, faces, density)
    return broken_at(faces, pictures, end)


def _split(
    found: Sequence[Slab], starts: Sequence[int], odd: set[int], levels: dict[int, list[float]]
) -> tuple[list[Slab], list[Tier]]:
    slabs_: list[Slab] = []
    tiers: list[Tier] = []
    for index, slab in enumerate(found):
        if index in starts or index in odd:
            tiers.append(Tier(len(slabs_), broken=index in odd))
        inner = sorted(levels.get(index, ()))
        for k, (bottom, top) in enumerate(pairwise([slab.bottom, *inner, slab.top])):
            if k:
                tiers.append(Tier(len(slabs_), broken=True))
            slabs_.append(replace(slab, bottom=bottom, top=top))
    return slabs_, tiers


def _parts(found: Sequence[Slab], starts: Sequence[int]) -> tuple[list[Part], list[int]]:
    """Return the blocks and the tier of each: a tier's wings stand side by side."""
    parts, tiers = [], []
    for tier, (a, b) in enumerate(pairwise([*starts, len(found)])):
        xs, ys, labels = wings(found[a:b])
        for wing in range(int(labels.max()) + 1):
            plans = {k: wing_slab(found[k], (xs, ys), labels == wing) for k in range(a, b)}
            plans = {k: plan for k, plan in plans.items() if plan.cells.any()}
            if plans:
                parts.append(_part(plans))
                tiers.append(tier)
    return parts, tiers


def _part(plans: dict[int, Slab]) -> Part:
    tight = [trimmed(plan) for plan in plans.values()]
    low = [min(p.xs[0] for p in tight), min(p.ys[0] for p in tight), tight[0].bottom]
    high = [max(p.xs[-1] for p in tight), max(p.ys[-1] for p in tight), tight[-1].top]
    return Part(plans, np.array(low), np.array(high))


def _faces(found: Sequence[Slab], parts: Sequence[Part]) -> tuple[list[WallFace], list[WallFace]]:
    """Return the faces of the outline and the seams between blocks, slab by slab."""
    faces: list[WallFace] = []
    seams: list[WallFace] = []
    for index, slab in enumerate(found):
        for block, part in enumerate(parts):
            if index in part.plans:
                plan = part.plans[index]
                whole = np.pad(on_grid(slab, plan.xs, plan.ys), 1)
                faces += faces_towards(plan, ~whole, index, block)
                seams += faces_towards(plan, whole & ~np.pad(plan.cells, 1), index, block)
    return faces, seams


def _seen(
    tiers: Sequence[Tier],
    tier_of: Sequence[int],
    found: Sequence[Slab],
    faces: Sequence[WallFace],
    pictures: Sequence[Picture],
) -> list[SeenTier]:
    ends = [*(tier.first for tier in tiers[1:]), len(found)]
    seen = []
    for number, (tier, end) in enumerate(zip(tiers, ends, strict=True)):
        own = [i for i, face in enumerate(faces) if tier_of[face.block] == number]
        areas = [faces[i].width * faces[i].height for i in own]
        histogram = colours([pictures[i] for i in own], areas)
        height = found[end - 1].top - found[tier.first].bottom
        seen.append(SeenTier(height, tier.broken, histogram))
    return seen


def _block(index: int, part: Part, role: str) -> Block:
    x, y, z = part.low.tolist()
    width, depth, height = (part.high - part.low).tolist()
    floors = max(1, round(height / STOREY))
    return Block(f"block-{index}", role, x, y, z, width, depth, height, floors)  # type: ignore[arg-type]
