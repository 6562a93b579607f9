"""Derivation trees: walking them, and drawing them into label maps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from ..artifacts.grammar import Node


def leaves(node: Node) -> Iterator[Node]:
    """Yield the leaves in the rules' order."""
    if not node.children:
        yield node
    for child in node.children:
        yield from leaves(child)


def nodes(node: Node) -> Iterator[Node]:
    """Yield a node and all below it, parents first."""
    yield node
    for child in node.children:
        yield from nodes(child)


def painted(tree: Node, shape: tuple[int, int], index: Mapping[str, int]) -> NDArray[np.uint8]:
    """Return the label map (height, width) of a plane derivation; scopes are pixels, y down."""
    out = np.zeros(shape, np.uint8)
    for leaf in leaves(tree):
        x0, y0, x1, y1 = (round(v) for v in leaf.scope)
        out[y0:y1, x0:x1] = index[leaf.label or ""]
    return out
