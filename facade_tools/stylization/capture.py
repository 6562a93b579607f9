"""From a textured model to its style sheet (LNSW13 4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..artifacts.blocks import Block, BlockRole, Blocks
from ..artifacts.building import Side
from ..artifacts.stylesheet import (
    Group,
    Rule,
    StyleBlock,
    StyleFace,
    StyleFloor,
    StyleSheet,
    Thickness,
    Wall,
)
from ..errors import InvalidInput
from ..formats.textured import TexturedMesh
from ..geometry.arrays import Floats
from ..imaging.image_io import Picture
from .framing import WORTH_SAYING, Standard, standard_view
from .groups import group_rule, horizontal_groups, vertical_groups
from .projection import SIDES, face_pictures, top_picture, working_density
from .remesh import Slab, WallFace, slabs, wall_faces
from .splitting import SplitRule
from .structure import cuts

STOREY = 3.0  # m, to count the floors of a block
LOW = 0.35  # of the height: a lowest or highest block below this is a bottom or a top
WALL_SIDES: tuple[Side, ...] = ("front", "right", "back", "left")


@dataclass(frozen=True, slots=True)
class CaptureOptions:
    """Choices of a capture; None means: find it.

    front: azimuth of the front's normal, degrees. up: auto, y or z. bottom, top: number of blocks
    that belong to the bottom and the top. window: objective window size (m).
    """

    front: float | None = None
    up: str = "auto"
    bottom: int | None = None
    top: int | None = None
    window: float | None = None


@dataclass(frozen=True, slots=True)
class Capture:
    """A style sheet, the model's own blocks, and the pictures by their file names."""

    sheet: StyleSheet
    blocks: Blocks
    pictures: dict[str, Picture]


@dataclass(frozen=True, slots=True)
class _Part:
    """A block of the source: its slabs' indices, and its least and greatest corner."""

    slabs: range
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class Structure:
    """A model in its standard view, cut into slabs and blocks."""

    standard: Standard
    slabs: list[Slab]
    parts: list[_Part]
    blocks: Blocks


def structure(mesh: TexturedMesh, identity: str, options: CaptureOptions) -> Structure:
    """Return the structure of a model (4.1, 4.2). Raises InvalidInput for no Manhattan building."""
    standard = standard_view(mesh, options.front, options.up)
    found = slabs(standard.mesh.vertices, standard.mesh.faces)
    parts = _parts(found)
    heights = [float(part.high[2] - part.low[2]) for part in parts]
    roles = block_roles(heights, options.bottom, options.top)
    frame = tuple(tuple(float(v) for v in row) for row in standard.frame)
    return Structure(standard, found, parts, Blocks(identity, _blocks(parts, roles), frame))


def capture_style(mesh: TexturedMesh, identity: str, options: CaptureOptions) -> Capture:
    """Capture the style of a model. Raises InvalidInput where it is no Manhattan building."""
    model = structure(mesh, identity, options)
    standard, found, parts = model.standard, model.slabs, model.parts
    faces = [face for index, slab in enumerate(found) for face in wall_faces(slab, index)]
    density = working_density(standard.mesh, faces)
    drawn = face_pictures(standard.mesh, faces, density)
    pictures = {f"textures/face-{i}.png": picture for i, (picture, _) in enumerate(drawn)}
    low, high = _plan(parts)
    pictures["textures/roof.png"] = top_picture(standard.mesh, low, high, density)
    sheet = _sheet(model, faces, drawn, density, options.window)
    return Capture(sheet, model.blocks, pictures)


def _parts(found: Sequence[Slab]) -> list[_Part]:
    borders = [0, *cuts([slab.area for slab in found]), len(found)]
    parts = []
    for a, b in pairwise(borders):
        plan = found[a:b]
        low = [min(s.xs[0] for s in plan), min(s.ys[0] for s in plan), plan[0].bottom]
        high = [max(s.xs[-1] for s in plan), max(s.ys[-1] for s in plan), plan[-1].top]
        parts.append(_Part(range(a, b), np.array(low), np.array(high)))
    return parts


def _plan(parts: Sequence[_Part]) -> tuple[Floats, Floats]:
    low = np.min([part.low for part in parts], axis=0)
    high = np.max([part.high for part in parts], axis=0)
    return low[:2], high[:2]


def block_roles(heights: Sequence[float], bottom: int | None, top: int | None) -> list[BlockRole]:
    """Return the role of every block from the ground up.

    Where the numbers are not given, the lowest and the highest block are bottom and top if they
    are low (below 35% of the whole) and a body is left between or beside them. A single block is
    a body.
    """
    count, whole = len(heights), sum(heights)
    low = int(count > 1 and heights[0] < LOW * whole) if bottom is None else bottom
    spare = count - low
    high = int(spare > 1 and heights[-1] < LOW * whole) if top is None else top
    if low + high > count or (low + high == count and count == 1):
        raise InvalidInput(f"--bottom {low} --top {high} leave no body of {count} blocks")
    middle = count - low - high
    return [*["bottom"] * low, *["body"] * middle, *["top"] * high]  # type: ignore[list-item]


def _blocks(parts: Sequence[_Part], roles: Sequence[BlockRole]) -> tuple[Block, ...]:
    blocks = []
    for i, (part, role) in enumerate(zip(parts, roles, strict=True)):
        x, y, z = part.low.tolist()
        width, depth, height = (part.high - part.low).tolist()
        name = f"block-{i}"
        blocks.append(Block(name, role, x, y, z, width, depth, height, _storeys(part)))
    return tuple(blocks)


def _storeys(part: _Part) -> int:
    return max(1, round(float(part.high[2] - part.low[2]) / STOREY))


def _sheet(
    model: Structure,
    faces: Sequence[WallFace],
    drawn: Sequence[tuple[Picture, float]],
    density: float,
    window: float | None,
) -> StyleSheet:
    identity, standard, parts = model.blocks.id, model.standard, model.parts
    pictures = [picture for picture, _ in drawn]
    rows, columns = horizontal_groups(faces), vertical_groups(faces, pictures)
    groups, rules = _rules(faces, pictures, rows, columns, window)
    lost = standard.oblique + standard.sloped
    notes = [*standard.mesh.notes]
    if lost > WORTH_SAYING:
        notes.append(f"{lost:.0%} of the surface is oblique or sloped: approximated by steps")
    return StyleSheet(
        identity,
        tuple(
            StyleBlock(block.id, block.role, (block.width, block.depth, block.height), block.floors)
            for block in model.blocks.blocks
        ),
        tuple(_floor(model.slabs[k], i, part) for i, part in enumerate(parts) for k in part.slabs),
        tuple(
            _wall(side, i, part, faces, rows, columns)
            for i, part in enumerate(parts)
            for side in WALL_SIDES
        ),
        tuple(groups),
        tuple(rules),
        density,
        "textures/roof.png",
        standard.front,
        lost,
        tuple(dict.fromkeys(notes)),
    )


def _rules(
    faces: Sequence[WallFace],
    pictures: Sequence[Picture],
    rows: Sequence[int],
    columns: Sequence[int],
    window: float | None,
) -> tuple[list[Group], list[Rule]]:
    groups, rules = [], []
    for direction, numbers, axis in (("horizontal", rows, 1), ("vertical", columns, 0)):
        for number in sorted(set(numbers)):
            members = [i for i, n in enumerate(numbers) if n == number]
            sizes = [faces[i].height if axis else faces[i].width for i in members]
            rule = group_rule([pictures[i] for i in members], max(sizes), axis, window)
            name = f"{direction[0]}{number}"
            groups.append(Group(name, direction, name))  # type: ignore[arg-type]
            rules.append(_rule(name, rule))
    return groups, rules


def _rule(name: str, rule: SplitRule) -> Rule:
    return Rule(name, rule.scalable, rule.insertable)


def _floor(slab: Slab, block: int, part: _Part) -> StyleFloor:
    return StyleFloor(
        f"block-{block}",
        slab.bottom - float(part.low[2]),
        slab.top - float(part.low[2]),
        tuple((slab.xs - part.low[0]).tolist()),
        tuple((slab.ys - part.low[1]).tolist()),
        tuple("".join("01"[int(cell)] for cell in row) for row in slab.cells),
    )


def _wall(
    side: Side,
    block: int,
    part: _Part,
    faces: Sequence[WallFace],
    rows: Sequence[int],
    columns: Sequence[int],
) -> Wall:
    along, direction, depth, sign = SIDES[side]
    own = [i for i, f in enumerate(faces) if f.side == side and f.slab in part.slabs]
    own.sort(key=lambda i: (faces[i].slab, direction * faces[i].start, faces[i].place))
    boundary = float(part.high[depth] if sign > 0 else part.low[depth])
    depths = [abs(boundary - faces[i].place) for i in own] or [0.0]
    lines = tuple(
        _polyline([faces[i] for i in own if faces[i].slab == k], part, side) for k in part.slabs
    )
    styled = tuple(
        StyleFace(
            faces[i].slab,
            faces[i].place - float(part.low[depth]),
            faces[i].start - float(part.low[along]),
            faces[i].end - float(part.low[along]),
            faces[i].bottom - float(part.low[2]),
            faces[i].top - float(part.low[2]),
            f"textures/face-{i}.png",
            f"h{rows[i]}",
            f"v{columns[i]}",
        )
        for i in own
    )
    return Wall(f"block-{block}", side, Thickness(min(depths), max(depths)), lines, styled)


def _polyline(faces: Sequence[WallFace], part: _Part, side: Side) -> tuple[tuple[float, ...], ...]:
    """Return the outline of a wall in plan, from left to right as seen from outside."""
    along, _, depth, _ = SIDES[side]
    points = []
    for face in faces:
        for end in (face.start, face.end):
            point = [0.0, 0.0]
            point[along] = end - float(part.low[along])
            point[depth] = face.place - float(part.low[depth])
            points.append(tuple(point))
    return tuple(points)
