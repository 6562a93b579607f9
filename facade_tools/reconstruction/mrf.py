"""`parse-image --method mrf`: a facade read by the grammar's chain MRFs (KSTTP09 section 3).

Nothing is learned: rows and columns of windows are what repeats, and what differs from the wall.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.grammar import Node
from ..artifacts.parse import LABELS, Floor, ImageInfo, Parse, Region
from ..errors import Infeasible
from ..grammar.derivation import leaves, painted
from ..grammar.reading import Method, Reading, ReadOptions, label_index, shrunk_mask
from ..imaging.image_io import Photo, fitted
from . import storeys as floors_module
from .dormers import with_dormers
from .evidence import agreement, profiles, window_evidence, with_belief
from .lines import differences, segments
from .periods import storey_period
from .potentials import CELL
from .shops import with_shop
from .storeys import STOREY, Band, Facade, skyline, storeys
from .stripes import Span, roof_spans, spans, stripes

ROWS, PIXELS = 320, 160_000  # the working picture
MOST = 1500  # cells a side
LEAST_SIDE = 24  # pixels of the working picture
REACH = 0.12  # share of the height on either side of a line whose colours are compared
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Scale:
    """Metres: height of the building to the top of its roof, or of a storey; None: unknown."""

    height: float | None = None
    storey: float | None = None


def mrf_method(options: ReadOptions, windows: NDArray[np.float32] | None = None) -> Method:
    """Return the unsupervised method of KSTTP09, told what another believes of windows."""
    scale = Scale(options.height, options.storey_height)
    return partial(read_facade, scale, windows=windows)


def read_facade(
    scale: Scale,
    photo: Photo,
    identity: str,
    *,
    rng: np.random.Generator,
    mask: NDArray[np.bool_] | None = None,
    windows: NDArray[np.float32] | None = None,
) -> Reading:
    """Return the parse of a rectified photograph.

    Exact inference draws nothing from `rng`. `mask` is true where something hides the facade.
    windows: another method's belief in windows, 0..1, of any size: evidence beside the picture's.
    Raises Infeasible where the picture is too small for a floor of windows.
    """
    del rng
    facade = in_cells(photo, scale, mask, windows)
    bands, energy = storeys(facade)
    bands = with_dormers(facade, with_shop(facade.plane, bands))
    chain = stripes(facade)
    columns = spans(chain, bands, facade.plane)
    shape = photo.pixels.shape[:2]
    tree = _tree(facade, bands, columns, shape)
    parse = Parse(
        id=identity,
        image=ImageInfo(photo.name, (shape[1], shape[0]), photo.sha256),
        rectification=IDENTITY,
        method="mrf",
        solver="chain",
        grammar="ksttp09",
        classifier="none",
        energy=energy + chain.energy,
        working=(facade.plane.shape[1], facade.plane.shape[0]),
        regions=tuple(_regions(tree)),
        floors=tuple(_floors(tree)),
        columns=_borders(facade, columns, shape),
        bound=energy + chain.energy,
        optimal=True,
        derivation=tree,
        tags=_tags(scale, facade, shape),
    )
    return Reading(parse, painted(tree, shape, label_index()), _raw(facade, shape))


def in_cells(
    photo: Photo,
    scale: Scale,
    mask: NDArray[np.bool_] | None = None,
    windows: NDArray[np.float32] | None = None,
) -> Facade:
    """Return a picture in cells of 10 cm. Without a scale a storey is taken to be 3 m high.

    windows: what another method believes. The skyline and the scale are of the picture alone.
    Raises Infeasible where it has too few pixels or cells for a floor and a window.
    """
    working = fitted(photo.pixels, ROWS, PIXELS)
    if min(working.shape[:2]) < LEAST_SIDE:
        height, width = working.shape[:2]
        size = f"{width}×{height} pixels at working size"
        raise Infeasible(f"the picture is too small: {size}; expected {LEAST_SIDE} a side or more")
    hidden = None if mask is None else shrunk_mask(mask, photo.pixels.shape, working.shape)
    evidence = window_evidence(working, hidden)
    height = len(working)
    found, reach = segments(working, evidence.seen), max(2, int(REACH * height))
    rows = agreement(evidence.plane, profiles(evidence.plane)[1], 3.0, 0.5)
    sky = skyline(differences(found, reach), rows)
    colour = differences(found, reach, sky)
    storey = storey_period(rows[sky:], evidence.plane[sky:])
    cell = _cell(scale, storey, height - sky)
    facade = _facade(working, evidence.plane, colour, sky, cell, storey)
    if windows is None:
        return facade
    return replace(facade, plane=_shrunk(with_belief(evidence, windows), facade.shown.shape))


def _cell(scale: Scale, storey: float, height: int) -> float:
    """Return the working pixels of a cell."""
    if scale.height is not None:
        return height * CELL / scale.height
    return storey * CELL / (scale.storey or STOREY)


def _facade(
    working: NDArray[np.uint8],
    shown: NDArray[np.float32],
    colour: NDArray[np.float64],
    sky: int,
    cell: float,
    storey: float,
) -> Facade:
    height, width = working.shape[:2]
    cell = max(cell, height / MOST, width / MOST)
    n, m = round(height / cell), round(width / cell)
    rows = round(sky * n / height), round(storey * n / height)
    floors_module.refuse_small((n - rows[0], m))
    picture = cv2.resize(working, (m, n), interpolation=cv2.INTER_AREA).astype(np.float64) / 255
    plane = _shrunk(shown, (n, m))
    lines = np.interp(np.arange(n + 1) * height / n, np.arange(height + 1), colour)
    return Facade(picture, plane, plane, lines, *rows)


def _shrunk(plane: NDArray[np.float32], cells: tuple[int, ...]) -> NDArray[np.float32]:
    """Return a plane's means over cells (rows, columns)."""
    return cv2.resize(plane, cells[::-1], interpolation=cv2.INTER_AREA).astype(np.float32)


@dataclass(frozen=True, slots=True)
class _Pixels:
    """From cells to pixels of the picture."""

    x: float
    y: float

    def box(self, x0: int, y0: int, x1: int, y1: int) -> tuple[float, ...]:
        """Return a scope in whole pixels."""
        return (
            float(round(x0 * self.x)), float(round(y0 * self.y)),
            float(round(x1 * self.x)), float(round(y1 * self.y)),
        )  # fmt: skip


def _pixels(facade: Facade, shape: tuple[int, ...]) -> _Pixels:
    n, m = facade.plane.shape
    return _Pixels(shape[1] / m, shape[0] / n)


WALLS = {"ground": "shop", "floor": "wall", "roof": "roof"}
SYMBOLS = {"ground": "Gf", "floor": "Fl", "roof": "Rf"}


def _tree(facade: Facade, bands: list[Band], columns: list[Span], shape: tuple[int, ...]) -> Node:
    """Return the derivation: up into ground floor, floors, roof and sky; right into windows."""
    at = _pixels(facade, shape)
    height, width = facade.plane.shape
    children = []
    for band in bands:
        own = band.kind == "roof" and band.high > band.low
        stripes_ = roof_spans(facade, band, bands) if own else columns
        if len(stripes_) > len(columns):
            stripes_ = columns
        children.append(_storey(band, stripes_, width, at))
    if facade.sky > 0:
        children.append(Node("Sky", at.box(0, 0, width, facade.sky), label="sky"))
    return Node("Fc", at.box(0, 0, width, height), "up", None, tuple(children))


def _storey(band: Band, stripes_: list[Span], width: int, at: _Pixels) -> Node:
    """Return a storey: wall under, windows, wall over."""
    windows = band.high > band.low and bool(stripes_)
    label = "wall" if windows and band.kind == "ground" else WALLS[band.kind]
    scope = at.box(0, band.y0, width, band.y1)
    if not windows:
        return Node(SYMBOLS[band.kind], scope, label=label)
    row = []
    before = 0
    for x0, x1 in stripes_:
        row.append(("Wa", before, x0, label))
        row.append(("Win", x0, x1, "window"))
        before = x1
    row.append(("Wa", before, width, label))
    parts = tuple(
        Node(symbol, at.box(x0, band.low, x1, band.high), label=name)
        for symbol, x0, x1, name in row
        if x1 > x0
    )
    middle = Node("Row", at.box(0, band.low, width, band.high), "right", None, parts)
    under = Node("Wa", at.box(0, band.high, width, band.y1), label=label)
    over = Node("Wa", at.box(0, band.y0, width, band.low), label=label)
    children = tuple(node for node in (under, middle, over) if node.scope[3] > node.scope[1])
    return Node(SYMBOLS[band.kind], scope, "up", None, children)


def _regions(tree: Node) -> list[Region]:
    out = []
    for leaf in leaves(tree):
        x0, y0, x1, y1 = (round(v) for v in leaf.scope)
        if x1 > x0 and y1 > y0:
            out.append(Region(leaf.label or "", x0, y0, x1, y1))
    return out


def _floors(tree: Node) -> list[Floor]:
    """Return the storeys from the ground; those without windows have one column."""
    out = []
    for storey in tree.children:
        if storey.symbol == "Sky":
            continue
        rows = [child for child in storey.children if child.symbol == "Row"]
        x: tuple[float, ...] = (storey.scope[0], storey.scope[2])
        if rows:
            x = (rows[0].scope[0], *(part.scope[2] for part in rows[0].children))
        columns = tuple(round(at) for at in x)
        out.append(Floor(storey.symbol, round(storey.scope[1]), round(storey.scope[3]), columns))
    return out


def _borders(facade: Facade, columns: list[Span], shape: tuple[int, ...]) -> tuple[int, ...]:
    at = _pixels(facade, shape)
    edges = {0, facade.plane.shape[1], *(x for span in columns for x in span)}
    return tuple(round(x * at.x) for x in sorted(edges))


def _tags(scale: Scale, facade: Facade, shape: tuple[int, ...]) -> dict[str, object]:
    """Return the metres of a pixel, and where they come from."""
    known = "height" if scale.height else "storey-height" if scale.storey else "relative"
    return {
        "scale": known,
        "metres_per_pixel": CELL * facade.plane.shape[0] / shape[0],
    }


def _raw(facade: Facade, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return the label map of the evidence alone: sky, window where it is positive, wall."""
    labels = np.where(facade.plane > 0, LABELS.index("window"), LABELS.index("wall"))
    labels[: facade.sky] = LABELS.index("sky")
    size = (shape[1], shape[0])
    return cv2.resize(labels.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(
        np.uint8
    )
