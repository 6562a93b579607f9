"""The derivation of a shape grammar: from a footprint to a tree of shapes (KSTTP09 2.2)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..artifacts.grammar import Geometry, Node
from ..artifacts.shape_grammar import Operation, ShapeGrammar, ShapeRule, Terminal
from ..errors import InvalidInput
from ..geometry.polygons import Rings
from . import expressions, operators
from .operators import Measure
from .rules import CUTS, OTHERWISE, check_shape_grammar
from .scopes import FLAT, Faces, Scope, Shape, faces_of, simplified
from .volumes import Volume, is_upright, prism_volume, roof_volume

MAX_DEPTH = 60
MAX_SHAPES = 200_000
LARGEST, FARTHEST = 1e6, 1e8  # metres, of a scope and from the origin
WALLS = ("wall", "roof", "chimney")  # labels of solid leaves that are a part of the mass


@dataclass(frozen=True, slots=True)
class Leaf:
    """A shape that no rule replaces: its name in the scene, its look and its geometry."""

    name: str
    shape: Shape
    terminal: Terminal
    faces: Faces


@dataclass(frozen=True, slots=True)
class Derived:
    """What a grammar made of a footprint.

    volumes: what makes the mass, in the order of their making.
    """

    root: Node
    leaves: tuple[Leaf, ...]
    volumes: tuple[Volume, ...]
    parameters: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Lot:
    """A footprint: outline (m, outer ring counter-clockwise), height of its eaves or 0."""

    rings: Rings
    height: float = 0.0


def default_lot(
    grammar: ShapeGrammar, values: Mapping[str, float], rng: np.random.Generator
) -> Lot:
    """Return the rectangle that the grammar stands on where no footprint is given.

    Raises InvalidInput on lengths that are none.
    """
    try:
        width = expressions.number(grammar.lot.width, values, rng)
        depth = expressions.number(grammar.lot.depth, values, rng)
    except InvalidInput as error:
        raise InvalidInput(error.message, pointer="/lot") from None
    if min(width, depth) <= 0:
        raise InvalidInput(f"{width:g} × {depth:g} m; expected lengths", pointer="/lot")
    if max(width, depth) > LARGEST:
        message = f"{width:g} × {depth:g} m; expected at most {LARGEST:g} m"
        raise InvalidInput(message, pointer="/lot")
    w, d = width / 2, depth / 2
    return Lot([np.array([[-w, -d], [w, -d], [w, d], [-w, d]])])


def drawn_parameters(
    grammar: ShapeGrammar, given: Mapping[str, float], rng: np.random.Generator
) -> dict[str, float]:
    """Return the values of a grammar's parameters; `given` ones replace the grammar's own.

    Raises InvalidInput for a name that the grammar does not have.
    """
    for name in given:
        if name not in grammar.parameters:
            known = ", ".join(grammar.parameters) or "none"
            raise InvalidInput(f"{name!r} is no parameter of {grammar.id!r} (has {known})")
    values: dict[str, float] = {}
    for name, amount in grammar.parameters.items():
        try:
            values[name] = expressions.number(given.get(name, amount), values, rng)
        except InvalidInput as error:
            raise InvalidInput(error.message, pointer=f"/parameters/{name}") from None
    return values


def derive(
    grammar: ShapeGrammar,
    lots: Sequence[Lot] = (),
    *,
    rng: np.random.Generator,
    given: Mapping[str, float] | None = None,
) -> Derived:
    """Return the derivation of a grammar on footprints, without any on its own lot.

    Of several rules that apply to a shape one is drawn by weight. Raises InvalidInput, with the
    pointer to the rule, for unknown symbols, derivations that do not end and negative scopes.
    """
    check_shape_grammar(grammar)
    values = drawn_parameters(grammar, given or {}, rng)
    return _Engine(grammar, values, rng).run(lots or [default_lot(grammar, values, rng)])


@dataclass
class _Engine:
    grammar: ShapeGrammar
    values: dict[str, float]
    rng: np.random.Generator
    lot_height: float = 0.0
    shapes: int = 0
    leaves: list[Leaf] = field(default_factory=list)
    volumes: list[Volume] = field(default_factory=list)
    names: Counter[str] = field(default_factory=Counter)

    def run(self, lots: Sequence[Lot]) -> Derived:
        self.rules: dict[str, list[tuple[int, ShapeRule]]] = {}
        for number, rule in enumerate(self.grammar.rules):
            self.rules.setdefault(rule.symbol, []).append((number, rule))
        nodes = [self._lot(lot) for lot in lots]
        root = nodes[0] if len(nodes) == 1 else _joined(nodes)
        return Derived(root, tuple(self.leaves), tuple(self.volumes), self.values)

    def _lot(self, lot: Lot) -> Node:
        self.lot_height = lot.height
        low, high = lot.rings[0].min(axis=0), lot.rings[0].max(axis=0)
        scope = Scope(np.array([*low, 0.0]), np.eye(3), np.array([*(high - low), 0.0]))
        outline = [ring - low for ring in lot.rings]
        return self._node(simplified(Shape(self.grammar.axiom, scope, outline)), 0, "/axiom")

    def _node(self, shape: Shape, depth: int, place: str) -> Node:
        """Derive a shape and all below it; place: the operation that made it."""
        self.shapes += 1
        if depth > MAX_DEPTH or self.shapes > MAX_SHAPES:
            why = f"{depth} levels" if depth > MAX_DEPTH else f"{self.shapes} shapes"
            message = f"the derivation does not end: {why} down at {shape.symbol!r}"
            raise InvalidInput(message, pointer=place)
        _check_reach(shape, place)
        if shape.symbol not in self.rules:
            return self._leaf(shape)
        names = {**self.values, **shape.names(), "lot_height": self.lot_height}
        number, rule = self._rule(shape.symbol, names)
        measure = Measure(names, self.rng)
        made: list[tuple[Shape, str]] = []
        for j, operation in enumerate(rule.do):
            pointer = f"/rules/{number}/do/{j}"
            try:
                made += [(child, pointer) for child in self._applied(shape, operation, measure)]
            except InvalidInput as error:
                message = f"{shape.symbol}: {error.message}"
                raise InvalidInput(message, pointer=pointer) from None
        children = tuple(self._node(child, depth + 1, pointer) for child, pointer in made)
        kind = "+".join(dict.fromkeys(map(_kind, rule.do)))[:100]
        bounds = shape.scope.bounds()
        return Node(shape.symbol, bounds, kind, None, children, number)

    def _rule(self, symbol: str, names: Mapping[str, expressions.Value]) -> tuple[int, ShapeRule]:
        """Draw one of the rules whose condition holds, or else of those for what is left over."""
        fitting = []
        for number, rule in self.rules[symbol]:
            try:
                if rule.when != OTHERWISE and expressions.holds(rule.when, names, self.rng):
                    fitting.append((number, rule))
            except InvalidInput as error:
                pointer = f"/rules/{number}/when"
                raise InvalidInput(f"{symbol}: {error.message}", pointer=pointer) from None
        fitting = fitting or [row for row in self.rules[symbol] if row[1].when == OTHERWISE]
        if not fitting:
            sizes = ", ".join(f"{name} {names[name]:.4g}" for name in ("width", "depth", "height"))
            message = f"no rule of {symbol!r} applies ({sizes}); add one with `when: otherwise`"
            raise InvalidInput(message, pointer=f"/rules/{self.rules[symbol][-1][0]}")
        if len(fitting) == 1:
            return fitting[0]
        weights = np.cumsum([rule.weight for _, rule in fitting])
        at = int(np.searchsorted(weights, self.rng.random() * weights[-1], side="right"))
        return fitting[min(at, len(fitting) - 1)]

    def _applied(self, shape: Shape, operation: Operation, measure: Measure) -> Iterator[Shape]:
        shape = operators.transformed(shape, operation, measure)
        if operation.split:
            parts = operation.into if isinstance(operation.into, tuple | list) else ()
            yield from operators.split(shape, operation.split, parts, measure)
        elif operation.repeat:
            each = measure.number(operation.each)
            yield from operators.repeat(shape, operation.repeat, each, str(operation.into))
        elif operation.mirror:
            yield from operators.mirror(shape, operation.mirror, str(operation.into))
        elif operation.faces:
            faces = list(operators.component_split(shape, operation.faces))
            if is_upright(shape.scope):
                self.volumes.append(prism_volume(shape))
            yield from faces
        elif operation.roof:
            made, faces = operators.roof(shape, operation, measure)
            self.volumes.append(roof_volume(shape, made, operation.roof))
            yield from faces
        else:
            yield replace(shape, symbol=str(operation.into))

    def _leaf(self, shape: Shape) -> Node:
        terminal = self.grammar.terminals[shape.symbol]
        faces = faces_of(shape)
        bounds = shape.scope.bounds()
        if not faces.faces:
            return Node(shape.symbol, bounds, None, terminal.label)
        stem = f"{shape.side or 'body'}/{shape.symbol}"
        self.names[stem] += 1
        self.leaves.append(Leaf(f"{stem}-{self.names[stem]}", shape, terminal, faces))
        solid = shape.thickness > FLAT and shape.plane == "z"
        if solid and terminal.label in WALLS and is_upright(shape.scope):
            self.volumes.append(prism_volume(shape))
        geometry = Geometry(tuple(map(tuple, faces.points.tolist())), faces.faces)
        return Node(shape.symbol, bounds, None, terminal.label, (), None, geometry)


def _check_reach(shape: Shape, place: str) -> None:
    """Raise InvalidInput on a scope that is larger or farther away than artifacts may hold."""
    size, away = (float(np.abs(v).max()) for v in (shape.scope.size, shape.scope.origin))
    if not size <= LARGEST:
        message = f"{shape.symbol} has a size of {size:g} m; expected at most {LARGEST:g} m"
        raise InvalidInput(message, pointer=place)
    if not away <= FARTHEST:
        message = f"{shape.symbol} lies {away:g} m away; expected at most {FARTHEST:g} m"
        raise InvalidInput(message, pointer=place)


def _kind(operation: Operation) -> str:
    """Return the name of what an operation does."""
    cuts = [name for name in CUTS if getattr(operation, name)]
    if cuts:
        axis = getattr(operation, cuts[0])
        return f"{cuts[0]} {axis}" if isinstance(axis, str) else cuts[0]
    if operation.extrude is not None:
        return "extrude"
    names = ("upright", "box", "scale", "rotate", "translate")
    return next((name for name in names if getattr(operation, name)), "name")


def _joined(nodes: Sequence[Node]) -> Node:
    boxes = np.array([node.scope for node in nodes])
    low, high = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
    return Node("site", (*low.tolist(), *high.tolist()), "lots", None, tuple(nodes))
