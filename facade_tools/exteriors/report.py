"""The report of a learned model: one HTML file, all pictures inline, no script."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from math import cos, pi, sin

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.model import Model
from ..randomness import item_generator
from .coordinates import Floats, Readings
from .holdout import Comparison
from .layout import Layout
from .sampling import draw_block
from .serialisation import network_of
from .shared_values import shared_values
from .style_pictures import StylePicture

STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:78em;margin:2em auto;padding:0 1em;
color:#222}h1,h2{font-weight:600}table{border-collapse:collapse}td,th{padding:.2em .8em;
text-align:right;border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}
.columns{display:flex;flex-wrap:wrap;gap:0 2em}figcaption{font-size:13px;color:#555}
figure{display:inline-block;margin:.5em;max-width:30em}svg{background:#fff}"""
DATA, DRAWN = "#8aa4c8", "#c2553f"
BINS = 24


def report_page(
    model: Model,
    rows: Readings,
    comparison: Sequence[Comparison],
    *,
    seed: int = 0,
    pictures: Iterable[StylePicture] = (),
) -> str:
    """Return the HTML page of a model learned from `rows`.

    Cardinalities, lateral edges, score trace, samples of each style (`pictures`; a sample without
    a picture is drawn as a glyph), marginals of data and samples, and the held-out table where
    there is one.
    """
    columns = (
        "<h2>Cardinalities</h2>" + cardinalities(model),
        "<h2>Lateral edges</h2>" + figure(edge_graph(model), f"{len(model.edges)} edges"),
        "<h2>Score</h2>" + figure(trace_graph(model.trace), score_caption(model)),
    )
    is_table = network_of(model).layout.is_table
    noun = "row" if is_table else "building"
    source = "so unknown to the samples" if is_table else "taken from the prior"
    unobserved = escape(", ".join(model.unobserved)) or "nothing"
    parts = [
        f"<h1>Model of {model.count} {noun}s ({escape(model.variant)})</h1>",
        f"<div class='columns'>{''.join(f'<div>{column}</div>' for column in columns)}</div>",
        f"<p>Not observed by any {noun}, {source}: {unobserved}.</p>",
    ]
    if comparison:
        parts.append(f"<h2>Held-out negative log-likelihood (nats a {noun})</h2>")
        parts.append(held_out(comparison))
    if figures := "".join(style_figures(model, pictures)):
        parts.append(f"<h2>Samples of each style</h2>{figures}")
    parts.append("<h2>Data (blue) and samples (red)</h2>" + "".join(marginals(model, rows, seed)))
    body = "\n".join(parts)
    head = f"<meta charset='utf-8'><title>facade learn</title><style>{STYLE}</style>"
    return f"<!doctype html><html lang='en'><head>{head}</head><body>\n{body}\n</body></html>\n"


def figure(picture: str, caption: str) -> str:
    """Return a picture with its caption."""
    return f"<figure>{picture}<figcaption>{escape(caption)}</figcaption></figure>"


def svg(width: int, height: int, inside: Iterable[str]) -> str:
    """Return an inline picture."""
    size = f"width='{width}' height='{height}' viewBox='0 0 {width} {height}'"
    return f"<svg xmlns='http://www.w3.org/2000/svg' {size}>{''.join(inside)}</svg>"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return an HTML table of text."""
    lines = [f"<tr>{''.join(f'<th>{escape(cell)}</th>' for cell in head)}</tr>"]
    lines += [f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows]
    return f"<table>{''.join(lines)}</table>"


def cardinalities(model: Model) -> str:
    """Return the table of cardinalities."""
    rows = [(name, str(size)) for name, size in model.cardinalities.items()]
    return table(("variable", "values"), rows)


def score_caption(model: Model) -> str:
    """Return what the score trace shows."""
    return (
        f"best Cheeseman-Stutz score so far, a step each time that |S| changes; "
        f"{len(model.search)} configurations tried"
    )


def held_out(comparison: Sequence[Comparison]) -> str:
    """Return the held-out table."""
    head = ("variant", "NLL", "s.e.", f"minus {comparison[0].variant}", "s.e.")
    rows = [
        (c.variant, *(f"{x:.3f}" for x in (c.nll, c.error, c.difference, c.difference_error)))
        for c in comparison
    ]
    return table(head, rows)


def edge_graph(model: Model) -> str:
    """Return the lateral edges, groups on a circle."""
    names = [g.name for g in model.groups]
    names += sorted({name for edge in model.edges for name in edge} - set(names))
    turn = {name: 2 * pi * i / len(names) - pi / 2 for i, name in enumerate(names)}
    place = {name: (200 + 140 * cos(a), 180 + 140 * sin(a)) for name, a in turn.items()}
    out = [
        "<defs><marker id='a' viewBox='0 0 8 8' refX='8' refY='4' markerWidth='7' "
        f"markerHeight='7' orient='auto'><path d='M0 0L8 4L0 8z' fill='{DRAWN}'/></marker></defs>"
    ]
    for start, end in model.edges:
        (x0, y0), (x1, y1) = place[start], place[end]
        length = max(((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5, 1.0)
        dx, dy = 14 * (x1 - x0) / length, 14 * (y1 - y0) / length
        out.append(
            f"<line x1='{x0 + dx:.1f}' y1='{y0 + dy:.1f}' x2='{x1 - dx:.1f}' y2='{y1 - dy:.1f}' "
            f"stroke='{DRAWN}' marker-end='url(#a)'/>"
        )
    for name, (x, y) in place.items():
        out.append(f"<circle cx='{x:.1f}' cy='{y:.1f}' r='12' fill='{DATA}'/>")
        tx, ty = 200 + 172 * cos(turn[name]), 184 + 164 * sin(turn[name])
        out.append(f"<text x='{tx:.1f}' y='{ty:.1f}' text-anchor='middle'>{escape(name)}</text>")
    return svg(400, 370, out)


def trace_graph(trace: Sequence[float]) -> str:
    """Return the score trace as a line."""
    if not trace:
        return svg(400, 40, ["<text x='10' y='25'>no search</text>"])
    low, high = min(trace), max(trace)
    span = max(high - low, 1e-9)
    step = 360 / max(len(trace) - 1, 1)
    points = " ".join(
        f"{20 + i * step:.1f},{160 - 140 * (value - low) / span:.1f}"
        for i, value in enumerate(trace)
    )
    line = f"<polyline points='{points}' fill='none' stroke='{DRAWN}' stroke-width='2'/>"
    ends = f"<text x='20' y='15'>{high:.0f}</text><text x='20' y='178'>{low:.0f}</text>"
    return svg(400, 185, [line, ends])


# --- samples ------------------------------------------------------------------------------------


def style_figures(model: Model, pictures: Iterable[StylePicture]) -> Iterator[str]:
    """Yield a figure a sample: its building, or else its glyph."""
    for one in pictures:
        caption = f"style {one.style} ({model.style[one.style]:.0%})"
        yield figure(glyph(one.sample) if one.png is None else png_image(one.png), caption)


def png_image(data: bytes) -> str:
    """Return an inline picture."""
    return f"<img alt='' src='data:image/png;base64,{b64encode(data).decode()}'>"


def glyph(a: Attributes) -> str:
    """Return plan (below) and front elevation (above) of an attribute vector."""
    w, d, h = (float(x or 1.0) for x in a.mass.bbox)
    scale = 90 / max(w, d, h, 1.0)
    left, ground, top = 60 - w * scale / 2, 75.0, 95.0
    wall = f"<rect x='{left:.1f}' y='{ground - h * scale * 0.7:.1f}' width='{w * scale:.1f}' "
    out = [wall + f"height='{h * scale * 0.7:.1f}' fill='#e8dcc6' stroke='#555'/>"]
    glass = max(float(a.facade.wwr[0] or 0.0), 0.0) ** 0.5
    out.append(
        f"<rect x='{60 - w * scale * glass / 2:.1f}' width='{w * scale * glass:.1f}' "
        f"y='{ground - h * scale * 0.35 * (1 + glass):.1f}' "
        f"height='{h * scale * 0.7 * glass:.1f}' fill='{DATA}'/>"
    )
    plan = [(0.5, 0.5, w, d, "#e8dcc6")]
    for part, color in ((a.mass.garage, "#9a9"), *((p, DRAWN) for p in a.mass.porch)):
        if part[2]:
            px, py, wide, deep = (float(x or 0.0) for x in part[:4])
            plan.append((px, py, wide, deep, color))
    for px, py, width, depth, color in plan:
        x = left + (px * w - width / 2) * scale
        y = top + 55 - ((py - 0.5) * d * 0.5 + depth * 0.25) * scale
        out.append(
            f"<rect x='{x:.1f}' y='{y:.1f}' width='{width * scale:.1f}' "
            f"height='{depth * scale * 0.5:.1f}' fill='{color}' fill-opacity='.7' stroke='#555'/>"
        )
    return svg(120, 190, out)


def marginals(model: Model, data: Readings, seed: int) -> Iterator[str]:
    """Yield one histogram a coordinate, data and samples overlaid, atoms at their own values."""
    network = network_of(model)
    rng, shared = item_generator(seed, "report"), shared_values(model, network)
    drawn = draw_block(network, rng=rng, shared=shared).readings
    for name, ours, theirs in _columns(network.layout, data, drawn):
        if len(ours) and len(theirs):
            yield figure(histogram(ours, theirs), name)


def _columns(
    layout: Layout, data: Readings, drawn: Readings
) -> Iterator[tuple[str, Floats, Floats]]:
    for group, ours, theirs in zip(layout.groups, data.values, drawn.values, strict=True):
        for i, coordinate in enumerate(group.coordinates):
            pair = [column[np.isfinite(column)] for column in (ours[:, i], theirs[:, i])]
            yield coordinate.name, pair[0], pair[1]
    for i, name in enumerate(layout.bits):
        seen = data.bits[:, i]
        yield name, seen[seen >= 0].astype(np.float64), drawn.bits[:, i].astype(np.float64)


def histogram(ours: Floats, theirs: Floats) -> str:
    """Return two overlaid histograms over the range of the data."""
    low, high = float(ours.min()), float(ours.max())
    high = high if high > low else low + 1.0
    shares = [
        np.histogram(np.clip(values, low, high), BINS, (low, high))[0] / max(len(values), 1)
        for values in (ours, theirs)
    ]
    top = max(share.max() for share in shares)
    bars = []
    paints = (f"fill='{DATA}'", f"fill='none' stroke='{DRAWN}'")
    for share, paint in zip(shares, paints, strict=True):
        for i, value in enumerate(share):
            height = 70 * value / top
            bars.append(
                f"<rect x='{5 + i * 6}' y='{78 - height:.1f}' width='6' "
                f"height='{height:.1f}' {paint}/>"
            )
    ends = f"<text x='5' y='94' font-size='11'>{low:.3g}</text>"
    ends += f"<text x='149' y='94' font-size='11' text-anchor='end'>{high:.3g}</text>"
    return svg(154, 98, [*bars, ends])
