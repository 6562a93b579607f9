"""From a textured model to its style sheet (LNSW13 4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

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
from ..formats.textured import TexturedMesh
from ..imaging.image_io import Picture
from .framing import WORTH_SAYING
from .groups import horizontal_groups, splitting_rule, vertical_groups
from .model import CaptureOptions, Model, Part, modelled
from .outline import WallFace
from .projection import SIDES, top_picture
from .remesh import Slab, trimmed
from .splitting import SplitRule, split_rule
from .style import Style
from .synthesis import resized_rule, synthesised

WALL_SIDES: tuple[Side, ...] = ("front", "right", "back", "left")


def capture_style(
    mesh: TexturedMesh, identity: str, options: CaptureOptions | None = None
) -> Style:
    """Return the style of a model (m). Raises InvalidInput where it is no Manhattan building."""
    options = options or CaptureOptions()
    model = modelled(mesh, identity, options)
    dressed = _dressed(model, options.window)
    pictures = {_file(i): picture for i, picture in enumerate(dressed.pictures)}
    low = np.min([part.low for part in model.parts], axis=0)[:2]
    high = np.max([part.high for part in model.parts], axis=0)[:2]
    pictures["textures/roof.png"] = top_picture(model.standard.mesh, low, high, model.density)
    return Style(_sheet(model, dressed, options.thickness), model.blocks, pictures)


def _file(index: int) -> str:
    return f"textures/face-{index}.png"


@dataclass(frozen=True, slots=True)
class _Dressed:
    """All faces with their pictures, the numbers of their groups, and the groups' rules."""

    faces: list[WallFace]
    pictures: list[Picture]
    rows: list[int]
    columns: list[int]
    groups: list[Group]
    rules: list[Rule]


def _dressed(model: Model, window: float | None) -> _Dressed:
    faces, pictures = list(model.faces), list(model.pictures)
    rows, columns = horizontal_groups(faces), vertical_groups(faces, pictures)
    groups, rules = _rules(faces, pictures, rows, columns, window)
    dressed = _Dressed(faces, pictures, rows, columns, groups, rules)
    by_name = {rule.id: SplitRule(rule.a, rule.b) for rule in rules}
    for seam in model.seams:
        _dress_seam(dressed, seam, by_name, model)
    return dressed


def _dress_seam(
    dressed: _Dressed, seam: WallFace, rules: Mapping[str, SplitRule], model: Model
) -> None:
    """Give a face between two blocks the look of the widest face of its slab.

    Its own rule is what the widest face's rule makes of its width.
    """
    beside = [i for i, face in enumerate(model.faces) if face.slab == seam.slab]
    near = [i for i in beside if model.faces[i].block == seam.block] or beside
    if not near:
        return
    best = max(near, key=lambda i: (dressed.faces[i].width, -i))
    row, column = dressed.rows[best], dressed.columns[best]
    used = (rules[f"v{column}"], rules[f"h{row}"])
    source = dressed.faces[best]
    own = resized_rule(used[0], source.width)
    number = len(dressed.groups)
    dressed.groups.append(Group(f"v{number}", "vertical", f"v{number}"))
    dressed.rules.append(_rule(f"v{number}", split_rule(own, seam.width)))
    dressed.pictures.append(
        synthesised(dressed.pictures[best], used, source.size, seam.size, model.density)
    )
    dressed.faces.append(seam)
    dressed.rows.append(row)
    dressed.columns.append(number)


def _sheet(model: Model, dressed: _Dressed, thickness: float | None) -> StyleSheet:
    standard, parts = model.standard, model.parts
    firsts = np.cumsum([0, *(len(part.plans) for part in parts)]).tolist()
    lost = standard.oblique + standard.sloped
    notes = [*standard.mesh.notes]
    if lost > WORTH_SAYING:
        notes.append(f"{lost:.0%} of the surface is oblique or sloped: approximated by steps")
    return StyleSheet(
        model.blocks.id,
        tuple(
            StyleBlock(block.id, block.role, (block.width, block.depth, block.height), block.floors)
            for block in model.blocks.blocks
        ),
        tuple(
            _floor(trimmed(plan), i, part)
            for i, part in enumerate(parts)
            for plan in part.plans.values()
        ),
        tuple(
            _wall(side, i, first, part, dressed, thickness)
            for i, (part, first) in enumerate(zip(parts, firsts, strict=False))
            for side in WALL_SIDES
        ),
        tuple(dressed.groups),
        tuple(dressed.rules),
        model.density,
        "textures/roof.png",
        standard.front,
        lost,
        tuple(dict.fromkeys(notes)),
        model.resolution,
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
            rule = splitting_rule([pictures[i] for i in members], max(sizes), axis, window)
            name = f"{direction[0]}{number}"
            groups.append(Group(name, direction, name))  # type: ignore[arg-type]
            rules.append(_rule(name, rule))
    return groups, rules


def _rule(name: str, rule: SplitRule) -> Rule:
    return Rule(name, rule.scalable, rule.insertable)


def _floor(slab: Slab, block: int, part: Part) -> StyleFloor:
    return StyleFloor(
        f"block-{block}",
        slab.bottom - float(part.low[2]),
        slab.top - float(part.low[2]),
        tuple((slab.xs - part.low[0]).tolist()),
        tuple((slab.ys - part.low[1]).tolist()),
        tuple("".join("01"[int(cell)] for cell in row) for row in slab.cells),
    )


def _wall(
    side: Side, block: int, first: int, part: Part, dressed: _Dressed, thickness: float | None
) -> Wall:
    """Return a wall; first: number of its block's lowest floor."""
    along, direction, depth, sign = SIDES[side]
    faces = dressed.faces
    floor_of = {slab: first + k for k, slab in enumerate(part.plans)}
    own = [i for i, f in enumerate(faces) if f.side == side and f.block == block]
    own.sort(key=lambda i: (faces[i].slab, direction * faces[i].start, faces[i].place))
    depths = _depths(part, depth, sign)
    lines = tuple(
        _polyline([faces[i] for i in own if faces[i].slab == k], part, side) for k in part.plans
    )
    styled = tuple(
        StyleFace(
            floor_of[faces[i].slab],
            faces[i].place - float(part.low[depth]),
            faces[i].start - float(part.low[along]),
            faces[i].end - float(part.low[along]),
            faces[i].bottom - float(part.low[2]),
            faces[i].top - float(part.low[2]),
            _file(i),
            f"h{dressed.rows[i]}",
            f"v{dressed.columns[i]}",
        )
        for i in own
    )
    inner = max(depths) if thickness is None else min(depths) + thickness
    return Wall(f"block-{block}", side, Thickness(min(depths), inner), lines, styled)


def _depths(part: Part, axis: int, sign: int) -> list[float]:
    """Return how deep (m) one looks into a block from a side before a wall stops the view.

    axis: 0 from left or right, 1 from front or back; sign: +1 from the greater coordinates.
    """
    found = []
    for plan in part.plans.values():
        lines, cells = (plan.xs, plan.cells) if axis == 0 else (plan.ys, plan.cells.T)
        seen = cells[cells.any(axis=1)]
        if sign > 0:
            places = part.high[axis] - lines[::-1][seen[:, ::-1].argmax(axis=1)]
        else:
            places = lines[seen.argmax(axis=1)] - part.low[axis]
        found += [float(place) for place in places]
    return found


def _polyline(faces: Sequence[WallFace], part: Part, side: Side) -> tuple[tuple[float, ...], ...]:
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
