"""Roofs, towers and chimneys on a finished mass.

Styles follow the element attributes; pitch and direction follow the boxes, so that the roofs of
wings run into each other (geometry/solids.py takes the upper envelope of the boxes' roofs).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..artifacts.attributes import ROOF_BITS, ElementAttributes
from ..artifacts.building import Axis, Box, Chimney, Roof, RoofStyle
from ..geometry.floors import FLOORS
from .attributes import ROOF_OF_STYLE
from .mass_taste import TOWER_RATIO, TOWER_WIDTH

CHIMNEY = 0.7  # width of a chimney (m)
BESIDE_TOWER = 2.0  # least distance of a chimney from a tower, where the ridge allows (m)
CHIMNEY_ABOVE = 0.7  # a chimney's top above the highest roof it passes (m)
CONE_PITCH = 58.0
LEAST_PITCH = 12.0  # of gables and hips (degrees)
TOWER_STEP = 0.9  # a tower's eaves above those of the house, where the floors allow (m)
TOP_STOREY = 2.3  # wall left to the top storey under a tower (m)
STEEP_STOREY = 2.2  # a mansard's lower slope at most (m)


@dataclass(frozen=True, slots=True)
class RoofPlan:
    """Choices that hold for a whole building: styles in order of use, pitch, overhang.

    like: roofs of another building, by style as the bits name it, that stand in for these.
    """

    styles: tuple[RoofStyle, ...]
    pitch: float
    overhang: float
    like: Mapping[str, Roof] = field(default_factory=dict)


def draw_roof_plan(element: ElementAttributes, *, rng: np.random.Generator) -> RoofPlan:
    """Draw the styles that the roof bits allow (gable where none is known), and a pitch."""
    seen = [name for name in ROOF_BITS if element.roof.get(name) == 1]
    free = [name for name in ROOF_BITS if element.roof.get(name) is None]
    styles = seen or (["gable"] if "gable" in free else free[:1]) or ["hip"]
    order = [styles[i] for i in rng.permutation(len(styles))]
    if len(order) > 1 and order[0] == "flat" and rng.random() < 0.7:
        order = [*order[1:], "flat"]
    pitch = {"gable": (28, 42), "hip": (20, 32)}.get(order[0], (22, 30))
    return RoofPlan(
        tuple(order),
        float(rng.integers(pitch[0], pitch[1] + 1)),
        float(rng.choice([0.3, 0.4, 0.5])),
    )


def roofed(boxes: Sequence[Box], plan: RoofPlan, *, tower: bool) -> tuple[Box, ...]:
    """Return the boxes with roofs; boxes that have one keep it. A tower gets a cone."""
    general = [box for box in boxes if box.kind == "general"]
    high = tower_of(general) if tower else None
    by_size = sorted(general, key=lambda box: -_volume(box))
    taken = {_style(box) for box in general if box.roof is not None}
    styles = [style for style in plan.styles if style not in taken]
    chosen: dict[str, RoofStyle] = {}
    for box in by_size:
        if box.roof is None and box is not high:
            chosen[box.id] = styles.pop(0) if styles else plan.styles[0]
    main = by_size[0] if by_size else None
    done = {box.id: box for box in boxes if box.roof is not None}
    for box in sorted(boxes, key=lambda box: -(box.height or 0.0)):
        if box.roof is None:
            roof = _roof(box, boxes, plan, chosen.get(box.id), main)
            done[box.id] = replace(box, roof=_under_higher(box, roof, done.values()))
    return tuple(done[box.id] for box in boxes)


def _under_higher(box: Box, roof: Roof, higher: Iterable[Box]) -> Roof:
    """Return a gable so low that its end does not stick out of a higher box that it runs into.

    A lower box may reach the outer wall of a higher one, as a garage under an upper storey does.
    Where a roof of `LEAST_PITCH` were still too high, a garage gets none of its own; a general
    box keeps that, as it may carry the building's only gable.
    """
    if roof.style != "gable" or box.kind == "porch":
        return roof
    along_x = roof.direction == "x"
    half = (box.width if along_x else box.depth) / 2
    ends = [
        (box.x + turn * half * along_x, box.y + turn * half * (not along_x)) for turn in (-1, 1)
    ]
    covers = [other for other in higher if (other.height or 0.0) > (box.height or 0.0) + 1e-6]
    rooms = [top - (box.height or 0.0) for x, y in ends if (top := roof_height(covers, x, y)) > 0]
    span = box.depth if along_x else box.width
    pitch = math.degrees(math.atan(min(rooms, default=math.inf) / (span / 2)))
    if pitch >= roof.pitch:
        return roof
    if pitch < LEAST_PITCH and box.kind == "garage":
        return Roof("flat")
    return replace(roof, pitch=max(math.floor(pitch), LEAST_PITCH))


def _style(box: Box) -> str:
    return ROOF_OF_STYLE.get(box.roof.style, "") if box.roof else ""


def _volume(box: Box) -> float:
    return box.width * box.depth * (box.height or 0.0)


def _roof(
    box: Box, boxes: Sequence[Box], plan: RoofPlan, style: RoofStyle | None, main: Box | None
) -> Roof:
    if box.kind == "porch":
        return _porch_roof(box, boxes, plan)
    if style is None and box.kind == "general":
        return Roof("cone", CONE_PITCH, "x", 0.2)
    style = style or plan.styles[0]
    if style == "flat":
        return Roof("flat")
    direction = _ridge(box, main)
    like = plan.like.get(style) if box.kind == "general" else None
    if like is not None:
        return Roof(like.style, _pitch(box, direction, like.pitch), direction, like.overhang)
    return Roof(style, _pitch(box, direction, plan.pitch), direction, plan.overhang)


def _ridge(box: Box, main: Box | None) -> Axis:
    """Return the ridge's axis: the longer one; of a wing, the one along which it stands out."""
    long: Axis = "x" if box.width >= box.depth else "y"
    if main is None or main is box:
        return long
    sides = (
        max(main.x - main.width / 2 - (box.x - box.width / 2), 0.0)
        + max(box.x + box.width / 2 - (main.x + main.width / 2), 0.0),
        max(main.y - main.depth / 2 - (box.y - box.depth / 2), 0.0)
        + max(box.y + box.depth / 2 - (main.y + main.depth / 2), 0.0),
    )
    if max(box.width, box.depth) > 1.6 * min(box.width, box.depth) or max(sides) < 0.3:
        return long
    return "x" if sides[0] > sides[1] else "y"


def _pitch(box: Box, direction: Axis, pitch: float) -> float:
    """Return the building's pitch, less where the span would make a roof higher than 4.5 m."""
    span = box.depth if direction == "x" else box.width
    steepest = math.degrees(math.atan(4.5 / (span / 2)))
    return round(max(min(pitch, steepest), LEAST_PITCH), 1)


def _porch_roof(box: Box, boxes: Sequence[Box], plan: RoofPlan) -> Roof:
    """Return a shed that falls to the front where it fits under the eaves, else a hip or flat."""
    middle = np.mean([b.y for b in boxes if b.kind != "porch"] or [0.0])
    height = box.height or 0.0
    eaves = max((b.height or 0.0 for b in boxes if b.kind == "general"), default=height)
    if plan.styles[0] == "flat" or min(box.width, box.depth) > 5.0:
        return Roof("flat")
    room = math.degrees(math.atan(max(eaves - height, 0.0) / box.depth))
    if box.y < middle and room >= 8.0:
        return Roof("shed", min(round(room, 1), 14.0), "y", 0.25)
    return Roof("hip", 12.0, "x" if box.width >= box.depth else "y", 0.25)


# --- towers -----------------------------------------------------------------------------------


def tower_of(general: Sequence[Box]) -> Box | None:
    """Return the box that can carry a cone: small, about square, as high as any other."""
    top = max((box.height or 0.0 for box in general), default=0.0)
    fit = [
        box
        for box in general
        if box.roof is None
        and (box.height or 0.0) >= top - 1e-6
        and max(box.width, box.depth) <= min(TOWER_WIDTH, TOWER_RATIO * min(box.width, box.depth))
    ]
    return min(fit, key=_volume) if fit and len(general) > 1 else None


def with_tower(boxes: Sequence[Box], *, rng: np.random.Generator) -> tuple[Box, ...]:
    """Return boxes among which one can carry a tower's cone.

    Where none can, a small one is set into a front corner of the highest box, flush with it: it
    changes none of the mass attributes. Unchanged where the highest box is too small.
    """
    general = [box for box in boxes if box.kind == "general"]
    if not general or tower_of(general) is not None:
        return tuple(boxes)
    host = max(general, key=lambda box: (box.height or 0.0, _volume(box)))
    side = round(min(3.4, 0.42 * min(host.width, host.depth)), 3)
    if side < 1.8:
        return tuple(boxes)
    turn = 1 if rng.random() < 0.5 else -1
    x = host.x + turn * (host.width - side) / 2
    y = host.y - (host.depth - side) / 2
    names = {box.id for box in boxes}
    name = next(n for n in ("tower", "tower-2", "tower-3") if n not in names)
    return (*boxes, Box(name, "general", x, y, side, side, host.height))


def under_tower(
    boxes: Sequence[Box], kept: Collection[str], storey_height: float
) -> tuple[Box, ...]:
    """Return the boxes with the eaves of the others under the tower's, as far as floors allow.

    A cone whose eaves are those of the house sinks into its roof. No floor comes or goes and the
    top storey stays at least 2.3 m high, so that no mass attribute changes. kept: ids that stay.
    """
    tower = tower_of([box for box in boxes if box.kind == "general"])
    if tower is None:
        return tuple(boxes)
    return tuple(
        box
        if box is tower or box.kind != "general" or box.id in kept
        else replace(box, height=_stepped(box.height or 0.0, tower.height or 0.0, storey_height))
        for box in boxes
    )


def _stepped(height: float, tower: float, storey_height: float) -> float:
    below = sum(height > (floor + 0.5) * storey_height + 1e-6 for floor in range(1, FLOORS))
    least = below * storey_height + max(TOP_STOREY, 0.5 * storey_height + 0.05)
    return round(min(height, max(tower - TOWER_STEP, least)), 3)


def missing_styles(element: ElementAttributes, boxes: Sequence[Box]) -> tuple[str, ...]:
    """Return the roof styles that the bits ask for and no general box carries."""
    there = {_style(box) for box in boxes if box.kind == "general" and box.roof}
    return tuple(name for name in ROOF_BITS if element.roof.get(name) == 1 and name not in there)


# --- chimneys -----------------------------------------------------------------------------------


def roof_height(boxes: Sequence[Box], x: float, y: float) -> float:
    """Return a height (m) that the roof of the mass does not exceed at a point of the plan.

    Exact on flat, shed, gable and hip roofs; cones and mansards count with their top. 0 outside.
    """
    over = (
        box
        for box in boxes
        if box.kind != "porch"
        and abs(x - box.x) <= box.width / 2 + 1e-9
        and abs(y - box.y) <= box.depth / 2 + 1e-9
    )
    return max(((box.height or 0.0) + _rise(box, x, y) for box in over), default=0.0)


def _rise(box: Box, x: float, y: float) -> float:
    """Return how far the roof of a box rises above its eaves at a point (m)."""
    roof = box.roof or Roof("flat")
    slope = math.tan(math.radians(roof.pitch))
    left, right = x - box.x + box.width / 2, box.x + box.width / 2 - x
    near, far = y - box.y + box.depth / 2, box.y + box.depth / 2 - y
    along_x = roof.direction == "x"
    within = {
        "flat": 0.0,
        "shed": left if along_x else near,
        "gable": min(near, far) if along_x else min(left, right),
        "hip": min(near, far, left, right),
    }
    if roof.style in within:
        return max(within[roof.style], 0.0) * slope
    return min(box.width, box.depth) / 2 * slope + (STEEP_STOREY if roof.style == "mansard" else 0)


def chimney_of(boxes: Sequence[Box], *, rng: np.random.Generator) -> Chimney | None:
    """Return a chimney on the main box: on its ridge, or inside its outer wall under the ridge.

    Where a tower stands at one end it is the other.
    """
    hosts = [b for b in boxes if b.kind == "general" and b.roof and b.roof.style != "cone"]
    if not hosts:
        return None
    main = max(hosts, key=_volume)
    along_x = (main.roof is None) or main.roof.direction == "x"
    length, span = (main.width, main.depth) if along_x else (main.depth, main.width)
    size = min(CHIMNEY, 0.3 * span)
    inset = (
        span / 2 if main.roof and main.roof.style == "hip" and length > span else size / 2 + 0.05
    )
    reach = max(length / 2 - inset, 0.0)
    share = float(rng.choice([-1.0, -0.6, 0.6, 1.0]))
    places = [
        (main.x + shift, main.y) if along_x else (main.x, main.y + shift)
        for shift in (round(share * reach, 3), round(-share * reach, 3))
    ]
    x, y = next((place for place in places if not _by_tower(boxes, *place)), places[0])
    corners = [(x + i * size / 2, y + j * size / 2) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    top = max(roof_height(boxes, *corner) for corner in corners) + CHIMNEY_ABOVE
    return Chimney(round(x, 6), round(y, 6), round(size, 3), round(size, 3), round(top, 3))


def _by_tower(boxes: Sequence[Box], x: float, y: float) -> bool:
    """Tell whether a point of the plan is close to a tower."""
    return any(
        abs(x - box.x) < box.width / 2 + BESIDE_TOWER
        and abs(y - box.y) < box.depth / 2 + BESIDE_TOWER
        for box in boxes
        if box.roof and box.roof.style == "cone"
    )
