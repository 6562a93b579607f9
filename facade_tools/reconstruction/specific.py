"""From an elevation to the specific grammar that builds it (KSTTP09 2.3 and Fig. 1).

The front is split as the picture is; the other sides repeat axes of its windows. Every terminal
knows which rectangle of which texture covers it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from ..artifacts.building import SIDES
from ..artifacts.shape_grammar import Operation, ShapeGrammar, ShapeRule, Terminal
from .elevation import Elevation, Rect
from .rules import OTHERWISE

PHOTO, FRONT, SIDE, WALL, ROOF = "photo", "front", "side", "wall-tile", "roof-tile"
CHEEK = 0.15  # metres of dormer beside its window
HEAD = 0.2  # and above it
DEPTHS = ((2.0, 0.35), (1e9, 0.7))  # metres: up to this width a balcony stands out by that
STACK = 0.6  # metres, depth of a chimney
MOST_STACK = 2.5  # and its greatest width
INSET = 1.2  # its distance from the sides' walls, where the roof slopes up
LOFT = 2.4  # metres, of a mansard where the picture shows none
TOP = 0.35  # height of a mansard's upper slope over that of its lower one
SLOPES = {"mansard": (75.0, 20.0), "hip": (32.0, None), "gable": (38.0, None)}
NEARLY = 0.02  # metres by which a face may differ from the parsed one
OVERLAPS = 0.25  # share of the narrower element at which two stand in one column


@dataclass(frozen=True, slots=True)
class Cover:
    """The part of a texture on a terminal: u0, v0, u1, v1 of it, or None where it repeats."""

    texture: str
    rect: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Axis:
    """One tile of the other sides: width (m) and what opens in it, v from the ground."""

    width: float
    openings: tuple[Rect, ...]


@dataclass(frozen=True, slots=True)
class Design:
    """What is not in the picture.

    roof: flat, gable, hip or mansard. party: sides without openings. axes: tiles of the other
    sides, in the order of the side texture. colors: of walls, roof, doors by label. fits: the
    front is the parsed facade; if it is too narrow for that, axes repeat on it, too.
    """

    roof: str
    axes: tuple[Axis, ...]
    party: frozenset[str] = frozenset()
    colors: Mapping[str, str] = field(default_factory=dict)
    fits: bool = True


@dataclass(frozen=True, slots=True)
class Specific:
    """A specific grammar, and what covers its terminals by symbol."""

    grammar: ShapeGrammar
    covers: Mapping[str, Cover]


def specific_grammar(plan: Elevation, design: Design, identity: str) -> Specific:
    """Return the grammar whose derivation is the building of an elevation."""
    build = _Build(plan, design)
    build.lots()
    if design.fits:
        build.front()
    build.sides()
    build.roof()
    grammar = ShapeGrammar(
        identity, "Lot", tuple(build.rules), build.terminals,
        {"hb": plan.eaves}, storey_height=plan.storey,
        title="The building of a parse: the rules of KSTTP09 equation 2 with its parameters",
    )  # fmt: skip
    return Specific(grammar, build.covers)


@dataclass
class _Build:
    plan: Elevation
    design: Design
    rules: list[ShapeRule] = field(default_factory=list)
    terminals: dict[str, Terminal] = field(default_factory=dict)
    covers: dict[str, Cover] = field(default_factory=dict)
    rows: dict[str, str] = field(default_factory=dict)  # symbol of each storey by its name

    def rule(self, symbol: str, *do: Operation, when: str = "") -> None:
        self.rules.append(ShapeRule(symbol, do, when))

    def terminal(self, symbol: str, label: str, cover: Cover | None = None) -> str:
        color = self.design.colors.get(label)
        style = {"window": "casement", "door": "panel"}.get(label, "")
        self.terminals[symbol] = Terminal(label, color, style)
        if cover is not None:
            self.covers[symbol] = cover
        return symbol

    # --- volumes ----------------------------------------------------------------------------------
    def lots(self) -> None:
        """Turn the footprint into a volume with a roof, the volume into its facades."""
        height = "lot_height if lot_height > 0 else hb"
        body = Operation(extrude=height, into="Body")
        top = Operation(translate={"z": height}, into="Roof")
        stacks = [self._stack(k, rect) for k, rect in enumerate(self.plan.chimneys)]
        main = f"abs(width - {self.plan.width:.9g}) < {NEARLY} and area > 0.999 * width * depth"
        self.rule("Lot", body, top, *stacks, when=main)
        self.rule("Lot", body, top, when=OTHERWISE)
        faces = dict.fromkeys(SIDES, "Facade") | dict.fromkeys(self.design.party, "Party")
        self.rule("Body", Operation(faces=faces))
        self.terminal("Party", "wall", Cover(WALL))
        parsed = f"side == 'front' and abs(width - {self.plan.width:.9g}) < {NEARLY}"
        same = f"abs(height - {self.plan.eaves:.9g}) < {NEARLY}"
        if self.design.fits:
            self.rule("Facade", Operation(into="Parsed"), when=f"{parsed} and {same}")
        self.rule("Facade", Operation(into="Unseen"), when=OTHERWISE)

    def _stack(self, number: int, rect: Rect) -> Operation:
        symbol = self.terminal(f"Chimney{number}", "chimney")
        height = f"{rect.v1:.9g} - hb"
        width = min(rect.width, MOST_STACK, self.plan.width / 4)
        inside = min(INSET, (self.plan.width - width) / 2)
        start = min(max(rect.middle - width / 2, inside), self.plan.width - width - inside)
        return Operation(
            box=True,
            translate={"x": start, "y": "45%", "z": "hb"},
            scale={"x": width, "y": STACK, "z": height},
            into=symbol,
        )

    # --- the parsed facade ------------------------------------------------------------------------
    def front(self) -> None:
        """Storeys, columns, elements, as the parse has them; balconies stand out."""
        plan = self.plan
        whole = Rect("", 0.0, 0.0, plan.width, plan.eaves)
        total = plan.eaves + plan.loft
        frame = _Frame(FRONT, plan.width, total)
        split = self.storeys("F", whole, [*plan.openings, *plan.shops], frame)
        stands = [self._balcony(k, rect, total) for k, rect in enumerate(plan.balconies)]
        self.rule("Parsed", split, *stands)

    def _balcony(self, number: int, rect: Rect, total: float) -> Operation:
        width, eaves = self.plan.width, self.plan.eaves
        cover = _Frame(PHOTO, width, total).cover(rect)
        symbol = self.terminal(f"Balcony{number}", "balcony", cover)
        depth = next(depth for most, depth in DEPTHS if rect.width <= most)
        return Operation(
            translate={"x": _share(rect.u0, width), "z": _share(rect.v0, eaves)},
            scale={"x": _share(rect.width, width), "z": _share(rect.height, eaves)},
            extrude=depth,
            into=symbol,
        )

    def storeys(self, name: str, whole: Rect, found: Sequence[Rect], frame: _Frame) -> Operation:
        """Return the split of a wall into the plan's storeys, with rules for what is below."""
        lines = self.plan.lines
        parts = []
        for k, (low, high) in enumerate(pairwise(lines)):
            inside = [r for r in found if low <= (r.v0 + r.v1) / 2 < high]
            storey = Rect("", whole.u0, low, whole.u1, high)
            self.rows[f"{name}{k}"] = self.row(f"{name}{k}", storey, inside, frame)
            parts.append((self.rows[f"{name}{k}"], high - low))
        return Operation(split="z", into=_parts(parts))

    def row(self, name: str, rect: Rect, found: Sequence[Rect], frame: _Frame) -> str:
        """Return the symbol of a storey: columns of elements between walls."""
        parts = []
        at = rect.u0
        for k, group in enumerate(_columns(found)):
            start = max(min(r.u0 for r in group), at)
            stop = min(max(r.u1 for r in group), rect.u1)
            if stop - start < 0.05:
                continue
            if start - at > 1e-6:
                wall = Rect("wall", at, rect.v0, start, rect.v1)
                parts.append((self.wall(f"{name}W{k}", wall, frame), start - at))
            column = Rect("", start, rect.v0, stop, rect.v1)
            parts.append((self.column(f"{name}C{k}", column, group, frame), stop - start))
            at = stop
        if rect.u1 - at > 1e-6:
            last = Rect("wall", at, rect.v0, rect.u1, rect.v1)
            parts.append((self.wall(f"{name}W", last, frame), rect.u1 - at))
        if len(parts) == 1:
            return parts[0][0]
        self.rule(name, Operation(split="x", into=_parts(parts)))
        return name

    def column(self, name: str, rect: Rect, group: Sequence[Rect], frame: _Frame) -> str:
        """Return the symbol of a column: elements over one another."""
        parts = []
        at = rect.v0
        for k, element in enumerate(sorted(group, key=lambda r: (r.v0, r.u0))):
            low, high = max(element.v0, at), min(element.v1, rect.v1)
            if high - low < 0.2:
                continue
            if low - at > 1e-6:
                wall = Rect("wall", rect.u0, at, rect.u1, low)
                parts.append((self.wall(f"{name}S{k}", wall, frame), low - at))
            band = Rect("", rect.u0, low, rect.u1, high)
            parts.append((self.element(f"{name}E{k}", band, element, frame), high - low))
            at = high
        if rect.v1 - at > 1e-6:
            last = Rect("wall", rect.u0, at, rect.u1, rect.v1)
            parts.append((self.wall(f"{name}S", last, frame), rect.v1 - at))
        if len(parts) == 1:
            return parts[0][0]
        self.rule(name, Operation(split="z", into=_parts(parts)))
        return name

    def element(self, name: str, band: Rect, element: Rect, frame: _Frame) -> str:
        """Return the symbol of an element in a band that may be wider."""
        u0, u1 = max(element.u0, band.u0), min(element.u1, band.u1)
        symbol = f"{name}-{element.label}"
        cover = frame.cover(Rect("", u0, band.v0, u1, band.v1))
        self.terminal(symbol, element.label, cover)
        if u1 - u0 > band.width - 0.02:
            return symbol
        left = self.wall(f"{name}L", replace(band, u1=u0), frame)
        right = self.wall(f"{name}R", replace(band, u0=u1), frame)
        parts = [(left, u0 - band.u0), (symbol, u1 - u0), (right, band.u1 - u1)]
        self.rule(name, Operation(split="x", into=_parts([p for p in parts if p[1] > 1e-6])))
        return name

    def wall(self, name: str, rect: Rect, frame: _Frame) -> str:
        """Return the symbol of a piece of wall."""
        return self.terminal(name, frame.wall, frame.cover(rect))

    # --- the other sides --------------------------------------------------------------------------
    def sides(self) -> None:
        """Axes of windows repeat; a wall of another height repeats their first upper storey."""
        axes = self.design.axes
        if not axes:
            self.terminal("Unseen", "wall", Cover(WALL))
            return
        width = axes[0].width
        same = f"abs(height - {self.plan.eaves:.9g}) < {NEARLY}"
        narrow = f"width < {0.6 * width:.9g}"
        self.rule("Unseen", Operation(into="Party"), when=narrow)
        repeat = Operation(repeat="x", each=width, into="Axis")
        self.rule("Unseen", repeat, when=f"not ({narrow}) and {same}")
        storeys = Operation(repeat="z", each=self.plan.storey, into="Storey")
        self.rule("Unseen", storeys, when=OTHERWISE)
        self.rule("Storey", Operation(repeat="x", each=width, into="StoreyAxis"))
        for k, axis in enumerate(axes):
            frame = _Frame(SIDE, width, self.plan.eaves, (k / len(axes), 1 / len(axes)))
            whole = Rect("", 0.0, 0.0, width, self.plan.eaves)
            mine = f"index % {len(axes)} == {k}"
            self.rule("Axis", self.storeys(f"A{k}F", whole, axis.openings, frame), when=mine)
            upper = f"A{k}F{min(1, len(self.plan.lines) - 2)}"
            self.rule("StoreyAxis", Operation(into=self.rows[upper]), when=mine)

    # --- the roof ---------------------------------------------------------------------------------
    def roof(self) -> None:
        """Roof the footprint; the slope that the picture shows carries its dormers."""
        style = self.design.roof
        self.terminal("Slope", "roof", Cover(ROOF))
        self.terminal("Top", "roof")
        self.terminal("Gable", "wall", Cover(WALL))
        into = {"lower": "Lower", "upper": "Top", "gable": "Gable"}
        loft = self.plan.loft or LOFT
        operation = Operation(roof=style, into=into)
        if style != "flat":
            pitch = tuple(p for p in SLOPES[style] if p is not None)
            operation = replace(operation, pitch=pitch if len(pitch) == 2 else pitch[0])
        if style == "mansard":
            operation = replace(operation, rise=(loft, TOP * loft))
        gables = dict.fromkeys(sorted(self.design.party & {"left", "right"}), 0.0)
        if style in ("gable", "mansard") and gables:
            operation = replace(operation, weights=gables)
        self.rule("Roof", operation)
        shown = self.design.fits and self.plan.loft > 0 and style != "flat"
        wide = f"side == 'front' and abs(width - {self.plan.width:.9g}) < {NEARLY}"
        self.rule("Lower", Operation(into="Slope"), when=OTHERWISE)
        if shown:
            self.rule("Lower", self._front_slope(loft), when=wide)

    def _front_slope(self, loft: float) -> Operation:
        """Return the split of the front's slope into dormers and roof between them."""
        plan = self.plan
        top = plan.eaves + loft
        frame = _Frame(FRONT, plan.width, top, wall="roof")
        around = [
            Rect("dormer", max(r.u0 - CHEEK, 0.0), max(r.v0, plan.eaves),
                 min(r.u1 + CHEEK, plan.width), min(r.v1 + HEAD, top - 0.02))
            for r in plan.dormers
        ] if self.design.roof == "mansard" else []  # fmt: skip
        rect = Rect("", 0.0, plan.eaves, plan.width, top)
        parts, at = [], 0.0
        for k, group in enumerate(_columns(around)):
            dormer = group[0]
            u0, u1 = max(dormer.u0, at), dormer.u1
            if u1 - u0 < 0.5:
                continue
            if u0 - at > 1e-6:
                wall = Rect("", at, rect.v0, u0, rect.v1)
                parts.append((self.wall(f"R{k}", wall, frame), u0 - at))
            window = min(plan.dormers, key=lambda r: abs(r.middle - (dormer.u0 + dormer.u1) / 2))
            parts.append((self._dormer(k, replace(dormer, u0=u0), window, rect), u1 - u0))
            at = u1
        last = Rect("", at, rect.v0, rect.u1, rect.v1)
        parts.append((self.wall("R", last, frame), rect.u1 - at))
        return Operation(split="x", into=_parts(parts))

    def _dormer(self, number: int, dormer: Rect, window: Rect, slope: Rect) -> str:
        """Return the symbol of a strip of the slope with a dormer in it."""
        name = f"D{number}"
        frame = _Frame(FRONT, self.plan.width, slope.v1, wall="roof")
        below = replace(slope, u0=dormer.u0, u1=dormer.u1, v1=dormer.v0)
        above = replace(slope, u0=dormer.u0, u1=dormer.u1, v0=dormer.v1)
        parts = [
            (self.wall(f"{name}B", below, frame), below.height), (f"{name}U", dormer.height),
            (self.wall(f"{name}A", above, frame), above.height),
        ]  # fmt: skip
        self.rule(name, Operation(split="z", into=_parts([p for p in parts if p[1] > 1e-6])))
        faces = {"front": f"{name}F", "side": "Cheek", "top": "Top"}
        self.terminal("Cheek", "wall", Cover(ROOF))
        self.rule(f"{name}U", Operation(upright=True, faces=faces))
        wall = _Frame(FRONT, self.plan.width, slope.v1)
        column = self.column(
            f"{name}C", dormer, [replace(window, u0=max(window.u0, dormer.u0))], wall
        )
        self.rule(f"{name}F", Operation(into=column))
        return name


@dataclass(frozen=True, slots=True)
class _Frame:
    """A texture over a wall of `width` and `height` metres; span: start and share of its width."""

    texture: str
    width: float
    height: float
    span: tuple[float, float] = (0.0, 1.0)
    wall: str = "wall"

    def cover(self, rect: Rect) -> Cover:
        """Return the part of the texture that lies on a rectangle of the wall."""
        start, share = self.span
        u0, u1 = (start + share * u / self.width for u in (rect.u0, rect.u1))
        return Cover(self.texture, (u0, rect.v0 / self.height, u1, rect.v1 / self.height))


def _share(part: float, whole: float) -> str:
    return f"{100.0 * part / whole:.12g}%"


def _parts(parts: Iterable[tuple[str, float]]) -> tuple[dict[str, object], ...]:
    """Return the parts of a split as shares of their scope; the last one takes what is left."""
    rows = list(parts)
    total = sum(size for _, size in rows)
    shares: list[dict[str, object]] = [{symbol: _share(size, total)} for symbol, size in rows]
    shares[-1] = {rows[-1][0]: "~1"}
    return tuple(shares)


def _columns(found: Sequence[Rect]) -> list[list[Rect]]:
    """Return groups of elements that stand over one another, from the left."""
    groups: list[list[Rect]] = []
    for rect in sorted(found, key=lambda r: (r.u0, r.v0)):
        last = groups[-1] if groups else []
        reach = max((r.u1 for r in last), default=-1e9)
        narrow = min([rect.width, *(r.width for r in last)])
        if last and reach - rect.u0 > OVERLAPS * narrow:
            last.append(rect)
        else:
            groups.append([rect])
    return groups
