"""The procedures of right-hand sides: each makes shapes of one shape (KSTTP09 2.1)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..artifacts.shape_grammar import Operation
from ..errors import InvalidInput
from ..geometry.arrays import Floats
from . import expressions
from .roofing import Roof, RoofFace, RoofPlan, roof_over, side_of
from .scopes import AXES, FLAT, UP, Scope, Shape, cut, simplified

SLACK = 1e-6  # metres that parts may be too long by rounding
MOST_PARTS = 10_000
BURIED = 1.02  # a dormer reaches this much farther back than its slope


@dataclass(frozen=True, slots=True)
class Measure:
    """Evaluates the amounts of a rule for one shape."""

    names: Mapping[str, expressions.Value]
    rng: np.random.Generator

    def number(self, amount: object) -> float:
        """Return a plain amount."""
        return expressions.number(amount, self.names, self.rng)

    def length(self, amount: object, whole: float) -> float:
        """Return metres; `35%` is a share of the whole."""
        if isinstance(amount, str) and amount.strip().endswith("%"):
            return self.number(amount.strip()[:-1]) / 100.0 * whole
        return self.number(amount)


def transformed(shape: Shape, operation: Operation, measure: Measure) -> Shape:
    """Return the shape after the transformation operators of an operation."""
    if operation.box:
        shape = replace(shape, outline=None)
    if operation.upright:
        shape = upright(shape)
    if operation.translate:
        shape = _translated(shape, operation.translate, measure)
    if operation.scale:
        shape = _scaled(shape, operation.scale, measure)
    if operation.rotate:
        shape = _rotated(shape, operation.rotate, measure)
    if operation.extrude is not None:
        shape = extruded(shape, measure.number(operation.extrude))
    return shape


def _translated(shape: Shape, by: Mapping[str, object], measure: Measure) -> Shape:
    step = np.zeros(3)
    for axis, amount in by.items():
        step[AXES[axis]] = measure.length(amount, float(shape.scope.size[AXES[axis]]))
    return replace(shape, scope=shape.scope.moved(step, shape.scope.size))


def _rotated(shape: Shape, by: Mapping[str, object], measure: Measure) -> Shape:
    """Turn a scope about its middle, about x, then y, then z."""
    scope = shape.scope
    for axis in sorted(by):
        angle = np.radians(measure.number(by[axis]))
        a, b = [(1, 2), (2, 0), (0, 1)][AXES[axis]]
        turn = np.eye(3)
        turn[[a, b], [a, b]] = np.cos(angle)
        turn[a, b], turn[b, a] = np.sin(angle), -np.sin(angle)
        middle = scope.size / 2
        scope = scope.turned(turn, middle - middle @ turn, scope.size)
    return replace(shape, scope=scope)


def _scaled(shape: Shape, to: Mapping[str, object], measure: Measure) -> Shape:
    size = shape.scope.size.copy()
    for axis, amount in to.items():
        k = AXES[axis]
        size[k] = measure.length(amount, float(shape.scope.size[k]))
        if size[k] < 0.0:
            raise InvalidInput(f"the scope gets a size of {size[k]:.6g} m along {axis}")
    outline = shape.outline
    if outline is not None:
        plane = [0, 2 if shape.plane == "y" else 1]
        old = shape.scope.size[plane]
        factor = np.divide(size[plane], old, out=np.ones(2), where=old > FLAT)
        outline = [ring * factor for ring in outline]
    return replace(shape, scope=replace(shape.scope, size=size), outline=outline)


def extruded(shape: Shape, by: float) -> Shape:
    """Return a flat shape with a thickness (m): a plan upwards, a wall outwards; < 0 the other way.

    Raises InvalidInput for a solid.
    """
    axis = AXES[shape.plane]
    if shape.scope.size[axis] > FLAT:
        raise InvalidInput("extrude needs a flat shape, a footprint or a face")
    step, size = np.zeros(3), shape.scope.size.copy()
    size[axis] = abs(by)
    if (by > 0.0) == (shape.plane == "y"):
        step[axis] = -abs(by)
    return replace(shape, scope=shape.scope.moved(step, size), normal=shape.plane)


def upright(shape: Shape) -> Shape:
    """Return the box with a vertical front that stands on the lower edge of a sloping face.

    Its depth is the face's run, its height the face's rise. Raises InvalidInput for a face that
    does not slope.
    """
    slope = shape.scope.axes[2]
    run = float(np.hypot(*slope[:2]))
    if shape.plane != "y" or shape.thickness > FLAT or not 1e-6 < run < 1.0 - 1e-6:
        raise InvalidInput("upright needs a sloping face of a roof")
    back = np.array([slope[0], slope[1], 0.0]) / run
    axes = np.array([shape.scope.axes[0], back, UP])
    width, _, length = shape.scope.size
    size = np.array([width, BURIED * length * run, length * float(slope[2])])
    return replace(shape, scope=Scope(shape.scope.origin, axes, size), outline=None, normal="z")


# --- splits ---------------------------------------------------------------------------------------
def split(
    shape: Shape, axis: str, parts: Sequence[Mapping[str, object]], measure: Measure
) -> Iterator[Shape]:
    """Yield the parts of a scope along an axis.

    Sizes are metres, `35%` of the scope, or `~2`: shares of what is left. Raises InvalidInput where
    the parts need more than there is.
    """
    whole = float(shape.scope.size[AXES[axis]])
    rows = [row for part in parts for row in part.items()]
    at = 0.0
    for (symbol, _), size in zip(rows, _sizes(rows, whole, measure), strict=True):
        stop = min(at + size, whole)
        if stop - at > SLACK:
            for piece in cut(shape, AXES[axis], at, stop):
                yield replace(piece, symbol=symbol)
        at = stop


def _sizes(rows: Sequence[tuple[str, object]], whole: float, measure: Measure) -> list[float]:
    flexible = [isinstance(amount, str) and amount.strip().startswith("~") for _, amount in rows]
    sizes = [
        measure.number(str(amount).strip()[1:] or 1) if flex else measure.length(amount, whole)
        for (_, amount), flex in zip(rows, flexible, strict=True)
    ]
    for (symbol, _), size in zip(rows, sizes, strict=True):
        if size < -SLACK:
            raise InvalidInput(f"{symbol} gets a size of {size:.6g} m")
    fixed = sum(size for size, flex in zip(sizes, flexible, strict=True) if not flex)
    total = sum(size for size, flex in zip(sizes, flexible, strict=True) if flex)
    if fixed > whole + SLACK * max(1.0, whole):
        raise InvalidInput(f"the parts need {fixed:.6g} m and the scope has {whole:.6g} m")
    share = max(whole - fixed, 0.0) / total if total > 0 else 0.0
    return [
        max(size * share if flex else size, 0.0) for size, flex in zip(sizes, flexible, strict=True)
    ]


def repeat(shape: Shape, axis: str, each: float, symbol: str) -> Iterator[Shape]:
    """Yield as many equal parts as come nearest to the size `each` (m), at least one.

    Raises InvalidInput on a size that is none, or that gives too many parts.
    """
    whole = float(shape.scope.size[AXES[axis]])
    if each <= 0.0:
        raise InvalidInput(f"repeats a part of {each:.6g} m")
    count = max(1, int(np.floor(whole / each + 0.5)))
    if count > MOST_PARTS:
        raise InvalidInput(f"repeats {count} parts; at most {MOST_PARTS} are made")
    ends = np.linspace(0.0, whole, count + 1)
    for index in range(count):
        for piece in cut(shape, AXES[axis], float(ends[index]), float(ends[index + 1])):
            yield replace(piece, symbol=symbol, index=index, count=count)


def mirror(shape: Shape, axis: str, symbol: str) -> Iterator[Shape]:
    """Yield both halves of a scope, the second one mirrored."""
    k = AXES[axis]
    half = float(shape.scope.size[k]) / 2
    for piece in cut(shape, k, 0.0, half):
        yield replace(piece, symbol=symbol, index=0, count=2)
    for piece in cut(shape, k, half, 2 * half):
        yield replace(_reflected(piece, k), symbol=symbol, index=1, count=2)


def _reflected(shape: Shape, axis: int) -> Shape:
    scope, axes, step = shape.scope, np.eye(3), np.zeros(3)
    axes[axis, axis], step[axis] = -1.0, scope.size[axis]
    outline = shape.outline
    if outline is not None and axis != AXES[shape.plane]:
        column = 0 if axis == 0 else 1
        sign, shift = np.ones(2), np.zeros(2)
        sign[column], shift[column] = -1.0, scope.size[axis]
        outline = [(ring * sign + shift)[::-1] for ring in outline]
    return replace(shape, scope=scope.turned(axes, step, scope.size), outline=outline)


# --- faces ----------------------------------------------------------------------------------------
def component_split(shape: Shape, into: Mapping[str, str]) -> Iterator[Shape]:
    """Yield the faces of a solid that `into` names by side, by `side`, `top`, `bottom`, `all`.

    Raises InvalidInput on what is no upright solid.
    """
    if shape.thickness <= FLAT or shape.plane == "y":
        raise InvalidInput("faces needs a solid that stands on its outline")
    faces = [*_walls(shape), *_caps(shape)]
    for number, face in enumerate(faces):
        general = "side" if face.side not in ("top", "bottom") else face.side
        symbol = next((into[key] for key in (face.side, general, "all") if key in into), None)
        if symbol is not None:
            yield replace(face, symbol=symbol, index=number, count=len(faces))


def _walls(shape: Shape) -> Iterator[Shape]:
    height = float(shape.scope.size[2])
    for ring in shape.rings():
        for start, stop in zip(ring, np.roll(ring, -1, axis=0), strict=True):
            length = float(np.hypot(*(stop - start)))
            if length <= FLAT:
                continue
            x, y = (stop - start) / length
            axes = np.array([[x, y, 0.0], [-y, x, 0.0], UP])
            scope = shape.scope.turned(
                axes, np.array([*start, 0.0]), np.array([length, 0.0, height])
            )
            yield Shape("", scope, side=side_of(np.array([y, -x])))


def _caps(shape: Shape) -> Iterator[Shape]:
    width, depth, height = shape.scope.size
    flat = np.array([width, depth, 0.0])
    scope = shape.scope.moved(np.array([0.0, 0.0, height]), flat)
    yield simplified(replace(shape, scope=scope, side="top", normal="z"))
    turned = shape.scope.turned(np.diag([1.0, -1.0, -1.0]), np.array([0.0, depth, 0.0]), flat)
    outline = shape.outline and [
        (ring * np.array([1.0, -1.0]) + np.array([0.0, depth]))[::-1] for ring in shape.outline
    ]
    yield simplified(replace(shape, scope=turned, outline=outline, side="bottom", normal="z"))


# --- roofs ----------------------------------------------------------------------------------------
def roof(shape: Shape, operation: Operation, measure: Measure) -> tuple[Roof, list[Shape]]:
    """Return the roof over the top of a shape, and the faces that `into` names.

    Selectors: lower, upper or gable, then the side, then all. Raises InvalidInput where the shape
    does not lie level.
    """
    if shape.plane == "y" or abs(shape.scope.axes[2] @ UP) < 1.0 - 1e-9:
        raise InvalidInput("a roof needs a level outline")
    plan = RoofPlan(
        operation.roof or "flat",
        _pair(operation.pitch, measure),
        _pair(operation.rise, measure),
        {side: measure.number(amount) for side, amount in operation.weights.items()},
        operation.direction,  # type: ignore[arg-type]
    )
    made = roof_over(shape.rings(), plan)
    into: Mapping[str, str] = operation.into if isinstance(operation.into, dict) else {}
    base = shape.scope.moved(np.array([0.0, 0.0, shape.scope.size[2]]), np.zeros(3))
    faces = []
    for number, face in enumerate(made.faces):
        named = [key for key in (face.kind, face.side, "all") if key in into]
        if named:
            placed = _roof_face(base, face)
            faces.append(
                replace(placed, symbol=into[named[0]], index=number, count=len(made.faces))
            )
    return made, faces


def _pair(value: object, measure: Measure) -> tuple[float | None, float | None]:
    if isinstance(value, tuple | list):
        return measure.number(value[0]), measure.number(value[1])
    return (None, None) if value is None else (measure.number(value), None)


def _roof_face(base: Scope, face: RoofFace) -> Shape:
    """Return a roof's face as a shape whose x runs level and whose z runs up the slope."""
    outer = face.rings[0]
    normal = _normal(outer)
    if normal[2] > 1.0 - 1e-9:
        axes, columns, kind = np.eye(3), [0, 1], "z"
    else:
        x = np.cross(UP, normal)
        x /= np.linalg.norm(x)
        axes, columns, kind = np.array([x, -normal, np.cross(normal, x)]), [0, 2], "y"
    local = [ring @ axes.T for ring in face.rings]
    low, high = local[0].min(axis=0), local[0].max(axis=0)
    size = np.zeros(3)
    size[columns] = (high - low)[columns]
    origin = np.where(np.isin(range(3), columns), low, local[0].mean(axis=0)) @ axes
    outline = [(ring - low)[:, columns] for ring in local]
    scope = base.turned(axes, origin, size)
    return simplified(Shape("", scope, outline, kind, face.side))


def _normal(points: Floats) -> Floats:
    after = np.roll(points, -1, axis=0)
    normal = np.cross(points - points[0], after - points[0]).sum(axis=0)
    return np.asarray(normal / np.linalg.norm(normal))
