"""A layout as windows and doors of a building's facade piece."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from ..artifacts.building import Element
from ..artifacts.layout import Layout, LayoutShape

STYLES = ("sash", "sliding", "casement", "bay", "fixed")


def facade_elements(layout: Layout) -> tuple[Element, ...]:
    """Return the windows and doors among the visible shapes of a layout.

    A shape is one where its look says so (`element: {kind: window, style: sash}`), or where its
    mesh or one of its symbols is called window, door or garage-door, possibly with a style, as
    `{window}` or `{window sash}`. Ordered by v, then u. Only the first main door stays main.
    """
    found = [made for shape in layout.shapes if shape.visible for made in _made(shape)]
    found.sort(key=lambda e: (round(e.v, 9), round(e.u, 9), e.kind))
    return tuple(_one_main(found))


def _made(shape: LayoutShape) -> Iterator[Element]:
    words = dict(shape.element) if shape.element is not None else _named(shape)
    if words is not None:
        yield Element(
            words["kind"],
            str(words.get("style", "sash" if words["kind"] == "window" else "plain")),
            shape.x0,
            shape.y0,
            shape.x1 - shape.x0,
            shape.y1 - shape.y0,
            bool(words.get("main", False)),
        )


def _named(shape: LayoutShape) -> dict[str, Any] | None:
    for text in (*shape.symbols, shape.mesh or ""):
        words = text.lstrip("~").removesuffix(".obj").lower().replace("_", " ").split()
        kind = next((word for word in words if word in ("window", "door", "garage-door")), None)
        if kind is not None:
            style = next((word for word in words if word in STYLES), None)
            return {"kind": kind} | ({"style": style} if style and kind == "window" else {})
    return None


def _one_main(elements: list[Element]) -> Iterator[Element]:
    seen = False
    for element in elements:
        main = element.main and not seen
        seen = seen or main
        yield replace(element, main=main)
