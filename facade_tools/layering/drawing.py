"""Colour-coded drawings of layouts: the facade, and its words, columns and sizes beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from html import escape
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..artifacts.layout import Group, Layout
from ..errors import InvalidInput
from ..formats.png import write as write_png

Picture = NDArray[np.uint8]

FACADE = 520.0  # pixels of the facade's longer side
ROW = 24.0  # height of a word's row
MARGIN = 26.0
LABEL = 132.0  # width of the layers' names
SHORT = 20  # characters of a name that are shown
MOST_ROWS = 14
LINE = "#c0392b"
INK = "#333333"
PALE = "#f2f2f2"
LETTER = 5.6  # width of a character of the lines below, at most


class Rect(NamedTuple):
    """A filled rectangle, its border in `stroke`, pixels from the top left."""

    x: float
    y: float
    width: float
    height: float
    fill: str
    stroke: str = ""


class Rule(NamedTuple):
    """A straight line."""

    x0: float
    y0: float
    x1: float
    y1: float
    color: str


class Text(NamedTuple):
    """A text centred at (x, y), or starting there."""

    x: float
    y: float
    text: str
    size: float = 11.0
    start: bool = False
    color: str = INK


Primitive = Rect | Rule | Text


@dataclass(frozen=True, slots=True)
class Drawing:
    """Primitives in painting order on a white page of some pixels."""

    width: float
    height: float
    items: tuple[Primitive, ...]


@dataclass(frozen=True, slots=True)
class _Strip:
    """A word with its letters' borders (m), shared by layers that have it."""

    layers: tuple[str, ...]
    columns: tuple[tuple[str, ...], ...]
    borders: tuple[float, ...]

    @property
    def name(self) -> str:
        more = f" +{len(self.layers) - 1}" if len(self.layers) > 1 else ""
        return f"{self.layers[0][: SHORT - len(more)]}{more}"


def draw(layout: Layout) -> Drawing:
    """Return the drawing of a layout: words across above, words upwards at the left.

    Column borders are red; a letter's box is as wide as the letter, grey where it is transparent.
    """
    canvas = layout.canvas
    scale = FACADE / max(canvas.width, canvas.height)
    across = [_strips(group) for group in layout.x.values()]
    upwards = [_strips(group) for group in layout.y.values()]
    left = MARGIN + max(LABEL, ROW * 1.6 * _count(upwards))
    top = MARGIN + ROW * _count(across) + 12
    width, height = canvas.width * scale, canvas.height * scale
    items = [
        *_facade(layout, scale, left, top + height),
        *_across(layout, across, (scale, left, top, height)),
        *_upwards(layout, upwards, (scale, left, top + height, width)),
        *_titles(layout, left, top + height, width),
    ]
    longest = max(len(item.text) for item in _titles(layout, left, top, width))
    wide = max(width, longest * LETTER)
    return Drawing(left + wide + MARGIN, top + height + MARGIN + 30, tuple(items))


def _count(groups: Sequence[Sequence[_Strip]]) -> int:
    return sum(min(len(strips), MOST_ROWS) for strips in groups)


def _strips(group: Group) -> list[_Strip]:
    rows: dict[object, _Strip] = {}
    for name, columns, borders in zip(group.layers, group.columns, group.borders, strict=True):
        key = columns, borders
        known = rows.get(key)
        layers = (*known.layers, name) if known else (name,)
        rows[key] = _Strip(layers, columns, borders)
    return list(rows.values())


def _facade(layout: Layout, scale: float, left: float, bottom: float) -> Iterator[Primitive]:
    width, height = layout.canvas.width * scale, layout.canvas.height * scale
    yield Rect(left, bottom - height, width, height, "#f4f1ea", "#bbbbbb")
    for shape in reversed(layout.shapes):
        if shape.visible:
            w, h = (shape.x1 - shape.x0) * scale, (shape.y1 - shape.y0) * scale
            fill = shape.color or "#a9866a"
            yield Rect(left + shape.x0 * scale, bottom - shape.y1 * scale, w, h, fill, "#5c5047")
            label = "".join(symbol.lstrip("~") for symbol in shape.symbols)
            if len(label) <= 4 and w > 7.0 * len(label) and h > 12:
                x = left + (shape.x0 + shape.x1) / 2 * scale
                y = bottom - (shape.y0 + shape.y1) / 2 * scale
                yield Text(x, y, label, 10.0, color=_ink_on(fill))


def _across(
    layout: Layout, groups: list[list[_Strip]], frame: tuple[float, float, float, float]
) -> Iterator[Primitive]:
    scale, left, top, height = frame
    y = MARGIN
    for group, strips in zip(layout.x.values(), groups, strict=True):
        shown = strips[:MOST_ROWS]
        for position in group.boundaries if len(groups) == 1 else ():
            yield Rule(left + position * scale, y - 5, left + position * scale, top + height, LINE)
        for strip in shown:
            yield Text(4, y + ROW / 2, strip.name, 10.0, True)
            for name, clear, s, t in _boxes(strip, group):
                box = Rect(
                    left + s * scale, y + 2, (t - s) * scale, ROW - 4, _tint(name, clear), "#777777"
                )
                yield box
                if box.width > 6.5 * len(name):
                    yield Text(box.x + box.width / 2, y + ROW / 2, name)
            y += ROW
        if len(groups) > 1:
            for position in group.boundaries:
                x = left + position * scale
                yield Rule(x, y - ROW * len(shown), x, y, LINE)


def _upwards(
    layout: Layout, groups: list[list[_Strip]], frame: tuple[float, float, float, float]
) -> Iterator[Primitive]:
    scale, left, bottom, width = frame
    x = left - ROW * 1.6 * _count(groups) - 4
    for group, strips in zip(layout.y.values(), groups, strict=True):
        for position in group.boundaries:
            y = bottom - position * scale
            yield Rule(x if len(groups) > 1 else left - 4, y, left + width, y, LINE)
        for strip in strips[:MOST_ROWS]:
            for name, clear, s, t in _boxes(strip, group):
                box = Rect(
                    x + 2,
                    bottom - t * scale,
                    ROW * 1.6 - 4,
                    (t - s) * scale,
                    _tint(name, clear),
                    "#777777",
                )
                yield box
                if box.height > 12:
                    yield Text(box.x + box.width / 2, box.y + box.height / 2, name[:6])
            x += ROW * 1.6


def _boxes(strip: _Strip, group: Group) -> Iterator[tuple[str, bool, float, float]]:
    """Yield name, whether unsized, lower and upper bound of every letter or piece."""
    unsized = set(group.unsized)
    places = iter(zip(strip.borders, strip.borders[1:], strict=False))
    ends = iter(group.boundaries[1:])
    for column in strip.columns:
        end = next(ends)
        for k, name in enumerate(column):
            s, t = next(places)
            yield name, name.lstrip("~") in unsized, s, end if k == len(column) - 1 else t


def _titles(layout: Layout, left: float, bottom: float, width: float) -> Iterator[Text]:
    for axis, groups, line in (("x", layout.x, 14), ("y", layout.y, 29)):
        yield Text(left, bottom + line, f"{axis}: {_numbers(groups)}", 10.5, True)
    yield Text(left + width - 60, 12, layout.id[:24], 11.0)


def _numbers(groups: Mapping[str, Group]) -> str:
    group = next(iter(groups.values()))
    sizes = ", ".join(f"{name}={size:.2f}" for name, size in list(group.sizes.items())[:7])
    error = sum(g.alignment_error for g in groups.values())
    proved = "optimal" if all(g.optimal for g in groups.values()) else "not proved"
    return f"error {error:.3f}, {group.tolerance:.0%}, {proved}; {sizes}"


def _ink_on(fill: str) -> str:
    """Return a colour that can be read on another."""
    return PALE if sum(_rgb(fill)) < 330 else INK


def _tint(name: str, clear: bool) -> str:
    """Return a pale colour that depends on the symbol alone."""
    if clear:
        return "#ececec"
    digest = blake2b(name.lstrip("~").encode(), digest_size=3).digest()
    return "#" + "".join(f"{150 + byte * 100 // 255:02x}" for byte in digest)


def svg_bytes(drawing: Drawing) -> bytes:
    """Return a drawing as SVG."""
    size = f'width="{drawing.width:.0f}" height="{drawing.height:.0f}"'
    view = f'viewBox="0 0 {drawing.width:.2f} {drawing.height:.2f}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} {view} font-family="sans-serif">',
        '<rect width="100%" height="100%" fill="#ffffff"/>',
        *map(_svg, drawing.items),
        "</svg>",
    ]
    return ("\n".join(lines) + "\n").encode()


def _svg(item: Primitive) -> str:
    match item:
        case Rect(x, y, width, height, fill, stroke):
            border = f' stroke="{stroke}" stroke-width="0.7"' if stroke else ""
            place = f'x="{x:.2f}" y="{y:.2f}" width="{width:.2f}" height="{height:.2f}"'
            return f'<rect {place} fill="{fill}"{border}/>'
        case Rule(x0, y0, x1, y1, color):
            place = f'x1="{x0:.2f}" y1="{y0:.2f}" x2="{x1:.2f}" y2="{y1:.2f}"'
            return f'<line {place} stroke="{color}" stroke-width="0.8" stroke-opacity="0.7"/>'
        case Text(x, y, text, size, start, color):
            anchor = "start" if start else "middle"
            look = f'font-size="{size}" text-anchor="{anchor}" fill="{color}"'
            return f'<text x="{x:.2f}" y="{y + size * 0.36:.2f}" {look}>{escape(text)}</text>'


def picture(drawing: Drawing, zoom: int = 2) -> Picture:
    """Return a drawing as an RGB picture (h, w, 3), drawn `zoom` times as large and averaged."""
    import cv2

    height, width = int(np.ceil(drawing.height)), int(np.ceil(drawing.width))
    page = np.full((height * zoom, width * zoom, 3), 255, dtype=np.uint8)
    for item in drawing.items:
        _paint(page, item, zoom)
    small = cv2.resize(page, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)


def _paint(page: Picture, item: Primitive, zoom: int) -> None:
    import cv2

    match item:
        case Rect(x, y, width, height, fill, stroke):
            a = round(x * zoom), round(y * zoom)
            b = round((x + width) * zoom), round((y + height) * zoom)
            cv2.rectangle(page, a, b, _rgb(fill), cv2.FILLED)
            if stroke:
                cv2.rectangle(page, a, b, _rgb(stroke), 1)
        case Rule(x0, y0, x1, y1, color):
            ends = [(round(x * zoom), round(y * zoom)) for x, y in ((x0, y0), (x1, y1))]
            cv2.line(page, ends[0], ends[1], _rgb(color), 1, cv2.LINE_AA)
        case Text(x, y, text, size, start, color):
            plain = text.encode("ascii", "replace").decode()
            factor, font = size * zoom / 30.0, cv2.FONT_HERSHEY_SIMPLEX
            (width, height), _ = cv2.getTextSize(plain, font, factor, 1)
            at = round(x * zoom) - (0 if start else width // 2), round(y * zoom + height / 2)
            cv2.putText(page, plain, at, font, factor, _rgb(color), 1, cv2.LINE_AA)


def _rgb(color: str) -> tuple[int, int, int]:
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def layout_picture(layout: Layout) -> Picture:
    """Return the drawing of a layout as a picture, for `facade view`."""
    return picture(draw(layout))


def sheet(layouts: Sequence[Layout], columns: int = 3) -> Drawing:
    """Return the drawings of several layouts on one page."""
    drawings = [draw(layout) for layout in layouts]
    columns = max(1, min(columns, len(drawings)))
    items: list[Primitive] = []
    y = width = 0.0
    for start in range(0, len(drawings), columns):
        row = drawings[start : start + columns]
        x = 0.0
        for drawing in row:
            items += [_moved(item, x, y) for item in drawing.items]
            x += drawing.width
        width, y = max(width, x), y + max(drawing.height for drawing in row)
    return Drawing(width, y, tuple(items))


def _moved(item: Primitive, x: float, y: float) -> Primitive:
    if isinstance(item, Rule):
        return Rule(item.x0 + x, item.y0 + y, item.x1 + x, item.y1 + y, item.color)
    return item._replace(x=item.x + x, y=item.y + y)


def sheet_bytes(layouts: Sequence[Layout], ending: str) -> bytes:
    """Return a contact sheet as .svg or .png. Raises InvalidInput on another ending."""
    if ending not in (".svg", ".png"):
        raise InvalidInput(f"{ending or 'no ending'}: expected a sheet that ends in .svg or .png")
    drawing = sheet(layouts)
    if ending == ".svg":
        return svg_bytes(drawing)
    return write_png(picture(drawing))
