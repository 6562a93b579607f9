"""A random derivation as a parse: what parse-image should find in its picture."""

from __future__ import annotations

from dataclasses import replace

from ..artifacts.grammar import Grammar, Node
from ..artifacts.parse import ImageInfo, Parse
from .deriving import floors_of, regions_of

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def random_parse(
    tree: Node, grammar: Grammar, identity: str, size: tuple[int, int], digest: str
) -> Parse:
    """Return the parse of a derivation drawn on a canvas of `size` pixels, y up in the tree.

    digest: SHA-256 of the rendered picture's file.
    """
    turned = in_pixels(tree, size[1])
    floors = floors_of(turned)
    return Parse(
        id=identity,
        image=ImageInfo(f"{identity}.png", size, digest),
        rectification=IDENTITY,
        method="sample-grammar",
        solver="none",
        grammar=grammar.id,
        classifier="",
        energy=0.0,
        working=size,
        regions=regions_of(turned),
        floors=floors,
        columns=max((floor.columns for floor in floors), key=len, default=()),
        derivation=turned,
    )


def in_pixels(node: Node, height: int) -> Node:
    """Return a derivation with scopes on whole pixels, y down."""
    x0, y0, x1, y1 = (round(v) for v in node.scope)
    children = tuple(in_pixels(child, height) for child in node.children)
    scope = (x0, height - y1, x1, height - y0)
    return replace(node, scope=scope, children=children)
