"""Railings cut window by window: each where its border is to be expected.

A solver cuts all tiles of a floor at one height. Where floors derive each for itself, tiles do so
too: railings of one floor differ, and where the belief wavers between window and railing, the mean
of the border is nearer to either reading than the likelier of the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..artifacts.grammar import Grammar, Node
from .deriving import Frame

Plane = NDArray[np.float32]

WINDOW, RAILING = "window", "balcony"
LEAST = 1e-3  # belief in a window at its centre: less says nothing


def cut_railings(tree: Node, grammar: Grammar, belief: Mapping[str, Plane], frame: Frame) -> Node:
    """Return the derivation with the railings before windows cut each for itself.

    belief: a plane (height, width) of every label at working resolution, top row first. Only tiles
    of rows that derive each for itself change, and only the border inside them.
    """
    if WINDOW not in belief:
        return tree
    return _changed(tree, grammar, belief[WINDOW], frame, False)


def _changed(node: Node, grammar: Grammar, window: Plane, frame: Frame, each: bool) -> Node:
    if not node.children:
        return node
    if each and tuple(child.label for child in node.children) == (RAILING, WINDOW):
        return _cut(node, window, frame)
    rule = grammar.rules.get(node.symbol)
    own = rule is not None and grammar.rules[rule.like or node.symbol].derive == "each"
    inner = own and node.split == "right"
    children = tuple(_changed(c, grammar, window, frame, inner) for c in node.children)
    return replace(node, children=children)


def _cut(tile: Node, window: Plane, frame: Frame) -> Node:
    """Return a tile of railing and window with the border between them where it is expected."""
    railing, glass = tile.children
    x0, top, x1, _ = glass.scope
    bottom = tile.scope[3]
    down, across = (w / p for w, p in zip(frame.working, frame.picture, strict=True))
    left = min(round(x0 * across), window.shape[1] - 1)
    right = max(round(x1 * across), left + 1)
    centre = int((top + glass.scope[3]) / 2 * down)
    profile = window[centre : round(bottom * down), left:right].mean(axis=1)
    if not len(profile) or profile[0] < LEAST:
        return tile
    border = round((centre + expected_length(profile)) / down)
    border = int(min(max(border, top + 1), bottom))
    lower = replace(railing, scope=(x0, float(border), x1, bottom))
    upper = replace(glass, scope=(x0, top, x1, float(border)))
    return replace(tile, children=(lower, upper))


def expected_length(profile: NDArray[np.float32]) -> float:
    """Return how many rows from the first on are expected to belong together.

    profile: belief of each row; a row belongs where all before it do, the first surely.
    """
    falling = np.minimum.accumulate(profile.astype(np.float64))
    return float((falling / falling[0]).sum())
