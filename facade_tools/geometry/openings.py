"""Openings cut into a solid's walls: each becomes a recess with reveals and a closing face."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from shapely import Polygon, box

from ..artifacts.building import SIDES, Building
from .arrays import Floats, Points3
from .detail_boxes import LocalFrame, side_frame
from .solids import Face, Label, Solid
from .triangulate import newell_normal

RECESS = 0.12  # how deep a window stands in its wall, metres
MARGIN = 0.02  # an opening keeps this distance from the wall's edges

log = logging.getLogger("facade_tools.geometry")


@dataclass(frozen=True, slots=True)
class Opening:
    """A rectangle (u0, v0, u1, v1, metres) in a wall's frame; wall: key of the wall it is in."""

    name: str
    kind: str
    style: str
    frame: LocalFrame
    rectangle: tuple[float, float, float, float]
    wall: str = ""


def openings_of(building: Building) -> list[Opening]:
    """Return all elements of a building's facades as openings, named like the scene's parts."""
    out = []
    for side in SIDES:
        if side not in building.facades:
            continue
        for index, piece in enumerate(building.facades[side].pieces, 1):
            count: Counter[str] = Counter()
            frame = side_frame(side, piece.origin)
            for e in piece.elements:
                count[e.kind] += 1
                name = f"{side}/piece-{index}/{e.kind}-{count[e.kind]}"
                rectangle = (e.u, e.v, e.u + e.width, e.v + e.height)
                out.append(Opening(name, e.kind, e.style, frame, rectangle))
    return out


def pierced(solid: Solid, openings: Sequence[Opening]) -> tuple[Solid, list[Opening | None]]:
    """Return the solid with recessed openings, and for each face the opening that it closes.

    The recess is at most RECESS deep and shallower near a corner, so that two never meet; an
    opening that touches its wall's edge is cut down to MARGIN from it; one that no wall face can
    hold is left out with a warning. Walls with openings are owned by `wall-<number>`, their
    reveals too.
    """
    walls = [index for index, label in enumerate(solid.labels) if label.semantic == "wall"]
    held: dict[int, list[tuple[Opening, float]]] = {}
    for opening in openings:
        found = _wall_of(solid, walls, opening, held)
        if found is None:
            log.warning("%s lies in no wall; left out of LoD3", opening.name)
        else:
            held.setdefault(found[0], []).append(found[1:])
    return _assembled(solid, held)


def _wall_of(
    solid: Solid,
    walls: Sequence[int],
    opening: Opening,
    held: dict[int, list[tuple[Opening, float]]],
) -> tuple[int, Opening, float] | None:
    for index in walls:
        outline = _outline(solid, index, opening.frame)
        if outline is None:
            continue
        fitted = _fitted(outline, opening.rectangle)
        if fitted is None:
            continue
        shape = box(*fitted)
        others = [box(*_in_frame(other, opening.frame)) for other, _ in held.get(index, ())]
        if any(shape.distance(other) < MARGIN / 2 for other in others):
            continue
        depth = min(RECESS, 0.7 * float(outline.exterior.distance(shape)))
        return index, replace(opening, rectangle=fitted, wall=f"wall-{index}"), depth
    return None


def _in_frame(other: Opening, frame: LocalFrame) -> tuple[float, float, float, float]:
    """Return the other opening's rectangle in a parallel frame of the same wall."""
    du, dv = ((other.frame.origin - frame.origin) @ frame.axes.T)[:2]
    u0, v0, u1, v1 = other.rectangle
    return u0 + du, v0 + dv, u1 + du, v1 + dv


def _outline(solid: Solid, index: int, frame: LocalFrame) -> Polygon | None:
    """Return a wall face in a frame's (u, v), or None where it lies in another plane."""
    face = solid.faces[index]
    points = solid.vertices[list(face[0])]
    local = (points - frame.origin) @ frame.axes.T
    if np.abs(local[:, 2]).max() > 1e-5 or newell_normal(points) @ frame.axes[2] <= 0.0:
        return None
    holes = [((solid.vertices[list(r)] - frame.origin) @ frame.axes.T)[:, :2] for r in face[1:]]
    return Polygon(local[:, :2], holes)


def _fitted(
    outline: Polygon, rectangle: tuple[float, float, float, float]
) -> tuple[float, float, float, float] | None:
    """Return the rectangle, cut down to the wall's bounds less MARGIN, if the wall holds it."""
    low_u, low_v, high_u, high_v = outline.bounds
    u0, v0 = max(rectangle[0], low_u + MARGIN), max(rectangle[1], low_v + MARGIN)
    u1, v1 = min(rectangle[2], high_u - MARGIN), min(rectangle[3], high_v - MARGIN)
    if u1 - u0 < MARGIN or v1 - v0 < MARGIN:
        return None
    area = (rectangle[2] - rectangle[0]) * (rectangle[3] - rectangle[1])
    kept = (u1 - u0) * (v1 - v0) > 0.5 * area
    safe = outline.buffer(-MARGIN / 2).contains(box(u0, v0, u1, v1))
    return (u0, v0, u1, v1) if kept and safe else None


def _assembled(
    solid: Solid, held: dict[int, list[tuple[Opening, float]]]
) -> tuple[Solid, list[Opening | None]]:
    points: list[Points3] = [solid.vertices]
    count = len(solid.vertices)
    faces: list[Face] = []
    labels: list[Label] = []
    closes: list[Opening | None] = []
    for index, (face, label) in enumerate(zip(solid.faces, solid.labels, strict=True)):
        rows = held.get(index, [])
        owner = f"wall-{index}" if rows else label.owner
        holes = []
        extra: list[tuple[Face, Opening | None]] = []
        for opening, depth in rows:
            outer = tuple(range(count, count + 4))
            inner = tuple(range(count + 4, count + 8))
            points.append(_corners(opening, depth))
            count += 8
            holes.append(outer[::-1])
            extra += [((quad,), None) for quad in _reveals(outer, inner)]
            extra.append(((inner,), opening))
        faces.append((*face, *holes))
        labels.append(Label(label.semantic, owner))
        closes.append(None)
        for added, closed in extra:
            faces.append(added)
            labels.append(Label("wall", owner))
            closes.append(closed)
    return Solid(np.concatenate(points), tuple(faces), tuple(labels)), closes


def _corners(opening: Opening, depth: float) -> Floats:
    u0, v0, u1, v1 = opening.rectangle
    ring = np.array([(u0, v0), (u1, v0), (u1, v1), (u0, v1)])
    local = [np.column_stack([ring, np.full(4, w)]) for w in (0.0, -depth)]
    return opening.frame.world(np.concatenate(local))


def _reveals(outer: tuple[int, ...], inner: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    for k in range(4):
        j = (k + 1) % 4
        yield outer[k], outer[j], inner[j], inner[k]
