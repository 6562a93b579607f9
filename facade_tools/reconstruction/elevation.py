"""A parse as an elevation in metres: what is built of it (KSTTP09 section 4)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS, Parse, Region
from ..errors import InvalidInput
from ..geometry.arrays import Floats
from .doors import door_head

STOREY = 3.0  # metres, where nobody says
STOREYS = 6.0  # in a picture whose parse has no floors
MOST_PIXELS = 64_000_000  # of a label map: one of a broken parse would fill any memory
LEAST = (0.3, 0.35)  # metres, width and height of the smallest element
NEAR = 0.3  # metres between balconies that are one
STEEP = 0.6  # share of a window's width that a balcony below it must cover to stand before it
LOWEST_LOFT = 0.8  # metres of roof in a picture that are worth a slope
MOST_STOREY = (2.0, 6.0)  # metres
LARGEST = 300.0  # metres, of a facade
DOOR = 0.6  # metres above the ground from which a door is none


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle of the elevation: u to the right, v up from the ground, metres."""

    label: str
    u0: float
    v0: float
    u1: float
    v1: float

    @property
    def middle(self) -> float:
        """Where it stands along the wall."""
        return (self.u0 + self.u1) / 2

    @property
    def width(self) -> float:
        """Extent along the wall."""
        return self.u1 - self.u0

    @property
    def height(self) -> float:
        """Extent upwards."""
        return self.v1 - self.v0


@dataclass(frozen=True, slots=True)
class Elevation:
    """The parsed facade in metres.

    width, eaves: of the wall. loft: height of the roof that the picture shows above it. lines: of
    the storeys, from 0 to the eaves. openings: windows and doors; dormers: windows in the roof.
    pixels: left, top, right, bottom of wall and roof in the rectified picture.
    """

    width: float
    eaves: float
    loft: float
    lines: tuple[float, ...]
    openings: tuple[Rect, ...]
    shops: tuple[Rect, ...]
    balconies: tuple[Rect, ...]
    dormers: tuple[Rect, ...]
    chimneys: tuple[Rect, ...]
    pixels: tuple[int, int, int, int]

    @property
    def storey(self) -> float:
        """Mean height of a storey, metres."""
        return self.eaves / (len(self.lines) - 1)


def elevation(
    parse: Parse, storey_height: float | None = None, height: float | None = None
) -> Elevation:
    """Return the elevation of a parse.

    storey_height: metres from floor to floor (median). height: of the building up to the top of
    the roof that is seen; without either, what the parse says, or storeys of 3 m. Raises
    InvalidInput where the parse shows no building.
    """
    labels = label_map(parse)
    top, eaves, ground = building_lines(labels)
    scale = _scale(parse, (top, eaves, ground), storey_height, height)
    place = _Place(scale, ground)
    rects = [place.rect(region) for region in parse.regions]
    wall = (ground - eaves) * scale
    loft = (eaves - top) * scale
    low = [rect for rect in rects if (rect.v0 + rect.v1) / 2 < wall]
    high = [rect for rect in rects if (rect.v0 + rect.v1) / 2 >= wall]
    width = labels.shape[1] * scale
    if max(width, wall) > LARGEST:
        message = f"the facade is {width:.0f} m wide and {wall:.0f} m high; at most {LARGEST:g} m"
        raise InvalidInput(message, pointer="/floors")
    frame = Rect("", 0.0, 0.0, width, wall)
    balconies = _joined([_cut(r, frame) for r in low if r.label == "balcony"])
    return Elevation(
        width, wall, loft if loft >= LOWEST_LOFT else 0.0,
        _lines(parse, place, wall),
        tuple(_openings(low, balconies, frame)),
        tuple(r for r in (_cut(r, frame) for r in low if r.label == "shop") if _large(r)),
        tuple(r for r in balconies if _large(r)),
        tuple(_dormers(high, wall, loft)) if loft >= LOWEST_LOFT else (),
        tuple(_chimneys(high, wall + loft)),
        (0, top if loft >= LOWEST_LOFT else eaves, labels.shape[1], ground),
    )  # fmt: skip


def stretched(plan: Elevation, width: float, top: float | None = None) -> Elevation:
    """Return the elevation on a wall of another width, and up to other eaves (m) where given."""
    across, up = width / plan.width, 1.0 if top is None else top / plan.eaves

    def changed(rects: Sequence[Rect]) -> tuple[Rect, ...]:
        return tuple(
            replace(r, u0=r.u0 * across, u1=r.u1 * across, v0=r.v0 * up, v1=r.v1 * up)
            for r in rects
        )

    return Elevation(
        width, plan.eaves * up, plan.loft * up, tuple(v * up for v in plan.lines),
        changed(plan.openings), changed(plan.shops), changed(plan.balconies),
        changed(plan.dormers), changed(plan.chimneys), plan.pixels,
    )  # fmt: skip


# --- lines of the building ------------------------------------------------------------------------
def label_map(parse: Parse) -> NDArray[np.uint8]:
    """Return the regions as a map (height, width) of indices into LABELS.

    Raises InvalidInput where they are larger than any picture.
    """
    width = max(region.x1 for region in parse.regions)
    height = max(region.y1 for region in parse.regions)
    if width * height > MOST_PIXELS:
        raise InvalidInput(f"regions of {width}×{height} pixels; expected a picture")
    out = np.zeros((height, width), np.uint8)
    for region in parse.regions:
        index = LABELS.index(region.label) if region.label in LABELS else 0
        out[region.y0 : region.y1, region.x0 : region.x1] = index
    return out


def building_lines(labels: NDArray[np.uint8]) -> tuple[int, int, int]:
    """Return the rows of the roof's top, of the eaves and of the ground.

    Sky ends and wall begins where the fewest pixels of rows speak against it. Raises InvalidInput
    where there is no wall.
    """
    share = {name: (labels == k).mean(axis=1) for k, name in enumerate(LABELS)}
    air = share["sky"] + share["chimney"]
    wall = share["wall"] + share["shop"] + share["door"] + share["balcony"]
    body = wall + share["window"] + share["roof"]
    ground = int(np.flatnonzero(body > 0.3).max(initial=-1)) + 1
    if ground <= 0 or not wall.any():
        raise InvalidInput("the parse shows no wall; expected a facade", pointer="/regions")
    top = _change(air[:ground], body[:ground])
    eaves = top + _change(share["roof"][top:ground], wall[top:ground])
    if ground - eaves < 2:
        raise InvalidInput("the parse shows no wall; expected a facade", pointer="/regions")
    return top, eaves, ground


def _change(above: Floats, below: Floats) -> int:
    """Return the row at which `above` gives way to `below` with the least sum of errors."""
    before = np.concatenate([[0.0], np.cumsum(below)])
    after = np.concatenate([[0.0], np.cumsum(above[::-1])])[::-1]
    return int(np.argmin(before + after))


def _scale(
    parse: Parse,
    rows: tuple[int, int, int],
    storey_height: float | None,
    height: float | None,
) -> float:
    """Return metres per pixel."""
    top, eaves, ground = rows
    if height is not None:
        return height / (ground - top)
    said = parse.tags.get("metres_per_pixel")
    known = isinstance(said, float) and parse.tags.get("scale") in ("height", "storey-height")
    if storey_height is None and known and isinstance(said, float) and said > 0:
        return float(said)
    feet = np.array(sorted({f.y1 for f in parse.floors if f.y1 > eaves}), float)
    gaps = np.diff(feet)
    gap = float(np.median(gaps)) if len(gaps) else (ground - eaves) / STOREYS
    least = (ground - eaves) / 60.0
    return (storey_height or STOREY) / max(gap, least)


def _lines(parse: Parse, place: _Place, wall: float) -> tuple[float, ...]:
    """Return the storey lines from the ground to the eaves; a very low storey joins the next."""
    feet = sorted({round((place.ground - floor.y1) * place.scale, 6) for floor in parse.floors})
    lines = [0.0]
    for foot in feet:
        if foot - lines[-1] >= MOST_STOREY[0] and wall - foot >= MOST_STOREY[0] * 0.8:
            lines.append(foot)
    if len(lines) == 1 and wall > MOST_STOREY[1]:
        lines = np.linspace(0.0, wall, max(2, round(wall / STOREY) + 1))[:-1].tolist()
    return (*lines, wall)


# --- elements -------------------------------------------------------------------------------------
@dataclass(frozen=True, slots=True)
class _Place:
    scale: float
    ground: int

    def rect(self, region: Region) -> Rect:
        s, g = self.scale, self.ground
        return Rect(region.label, region.x0 * s, (g - region.y1) * s, region.x1 * s,
                    (g - region.y0) * s)  # fmt: skip


def _cut(rect: Rect, frame: Rect) -> Rect:
    """Return what of a rectangle lies in a frame; it may be empty."""
    u0, v0 = max(rect.u0, frame.u0), max(rect.v0, frame.v0)
    return Rect(rect.label, u0, v0, max(min(rect.u1, frame.u1), u0),
                max(min(rect.v1, frame.v1), v0))  # fmt: skip


def _large(rect: Rect) -> bool:
    return rect.width >= LEAST[0] and rect.height >= LEAST[1]


def _joined(rects: Sequence[Rect]) -> list[Rect]:
    """Return rectangles with those made one that stand side by side in a row."""
    out: list[Rect] = []
    for rect in sorted(rects, key=lambda r: (r.u0, r.v0)):
        for k, other in enumerate(out):
            together = min(rect.v1, other.v1) - max(rect.v0, other.v0)
            near = rect.u0 - other.u1 <= NEAR and other.u0 - rect.u1 <= NEAR
            if near and together > 0.5 * min(rect.height, other.height):
                out[k] = Rect(
                    other.label, min(rect.u0, other.u0), min(rect.v0, other.v0),
                    max(rect.u1, other.u1), max(rect.v1, other.v1),
                )  # fmt: skip
                break
        else:
            out.append(rect)
    return out


def _openings(low: Sequence[Rect], balconies: Sequence[Rect], frame: Rect) -> Iterator[Rect]:
    """Yield doors and windows, windows down to the floor of the balcony before them.

    Fragments of doors are left out, low ones get the usual height.
    """
    for rect in low:
        if rect.label not in ("window", "door"):
            continue
        if rect.label == "door" and rect.v0 > DOOR:
            rect = replace(rect, label="window")
        if rect.label == "window":
            rect = _lowered(rect, balconies)
        else:
            head = door_head(rect.width, rect.v1, frame.v1)
            if head is None:
                continue
            rect = replace(rect, v1=head)
        cut = _cut(rect, frame)
        if _large(cut):
            yield cut


def _lowered(window: Rect, balconies: Sequence[Rect]) -> Rect:
    for balcony in balconies:
        before = min(window.u1, balcony.u1) - max(window.u0, balcony.u0) > STEEP * window.width
        touches = balcony.v0 < window.v0 <= balcony.v1 + 0.15
        if before and touches and balcony.height < 1.6:
            return replace(window, v0=balcony.v0)
    return window


def _dormers(high: Sequence[Rect], wall: float, loft: float) -> Iterator[Rect]:
    """Yield the windows of the roof, with the balconies that stand before them."""
    frame = Rect("", -1e9, wall, 1e9, wall + loft)
    balconies = [r for r in high if r.label == "balcony"]
    for rect in high:
        if rect.label == "window":
            cut = _cut(_lowered(rect, balconies), frame)
            if _large(cut):
                yield cut


def _chimneys(high: Sequence[Rect], top: float) -> Iterator[Rect]:
    """Yield the stacks that rise above the roof."""
    for rect in _joined([r for r in high if r.label == "chimney"]):
        if rect.v1 > top + 0.2 and rect.width >= LEAST[0]:
            yield rect
