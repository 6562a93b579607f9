"""Railings cut one by one: the top of each where it is to be expected.

A solver cuts all tiles of a floor at one height. Where floors derive each for itself, railings do
so too: those of one floor differ, and where the belief wavers between window and railing, the mean
of the border is nearer to either reading than the likelier of the two.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ..artifacts.grammar import Grammar, Node
from .deriving import Frame

Plane = NDArray[np.float32]

WINDOW, RAILING = "window", "balcony"
LEAST = 1e-3  # belief in a window at its centre: less says nothing


def cut_railings(tree: Node, grammar: Grammar, window: Plane, frame: Frame) -> Node:
    """Return the derivation with the railings before windows cut each for itself.

    window: belief in windows at working resolution (height, width), top row first, NaN where
    something hides the facade. Only tiles of rows that derive each for itself change, and only the
    border inside them. Tiles that touch share their railing, and its top: the mean of what is
    expected before each of their windows.
    """
    if not tree.children:
        return tree
    rule = grammar.rules.get(tree.symbol)
    each = rule is not None and grammar.rules[rule.like or tree.symbol].derive == "each"
    if each and tree.split == "right":
        return replace(tree, children=tuple(_row(tree.children, window, frame)))
    children = tuple(cut_railings(child, grammar, window, frame) for child in tree.children)
    return replace(tree, children=children)


def _row(tiles: Sequence[Node], window: Plane, frame: Frame) -> Iterator[Node]:
    """Yield the tiles of a row, railing by railing."""
    for railed, run in groupby(tiles, key=_railed):
        own = list(run)
        yield from _cut(own, window, frame) if railed else own


def _railed(tile: Node) -> bool:
    return len(tile.children) == 2 and tile.children[0].label == RAILING


def _cut(tiles: list[Node], window: Plane, frame: Frame) -> list[Node]:
    """Return tiles that share a railing with its top where it is expected."""
    expected = [expected_border(tile, window, frame) for tile in tiles]
    known = [border for border in expected if border is not None]
    if not known:
        return tiles
    first = max(tile.scope[1] for tile in tiles) + 1
    border = float(min(max(round(np.mean(known)), first), tiles[0].scope[3]))
    return [_with_border(tile, border) for tile in tiles]


def _with_border(tile: Node, border: float) -> Node:
    railing, above = tile.children
    lower = replace(railing, scope=(railing.scope[0], border, *railing.scope[2:]))
    upper = replace(above, scope=(*above.scope[:3], border))
    return replace(tile, children=(lower, upper))


def expected_border(tile: Node, window: Plane, frame: Frame) -> float | None:
    """Return where a tile's window is expected to end, pixels of the picture.

    None where it holds no window, or belief says nothing of it, or a row of it is hidden.
    """
    glass = tile.children[1]
    if glass.label != WINDOW:
        return None
    x0, top, x1, low = glass.scope
    down, across = (w / p for w, p in zip(frame.working, frame.picture, strict=True))
    left = min(round(x0 * across), window.shape[1] - 1)
    right = max(round(x1 * across), left + 1)
    centre = int((top + low) / 2 * down)
    strip = window[centre : round(tile.scope[3] * down), left:right]
    seen = np.isfinite(strip)
    count = seen.sum(axis=1)
    if not len(strip) or not count.all():
        return None
    profile = np.where(seen, strip, 0).sum(axis=1) / count
    if profile[0] < LEAST:
        return None
    return (centre + expected_length(profile)) / down


def expected_length(profile: NDArray[np.floating]) -> float:
    """Return how many rows from the first on are expected to belong together.

    profile: belief of each row; a row belongs where all before it do, the first surely.
    """
    falling = np.minimum.accumulate(profile.astype(np.float64))
    return float((falling / falling[0]).sum())
