"""A derivation as an artifact, and such an artifact as a scene."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from ..artifacts.derivation import Derivation
from ..artifacts.grammar import Geometry, Node
from ..artifacts.shape_grammar import ShapeGrammar
from ..geometry.mesh import Material, Mesh, Scene
from ..geometry.solids import Label, Solid, triangulated
from ..randomness import item_generator
from .drawing import color_of, derived_scene, mass_of
from .engine import Derived, derive
from .skins import Skins

PLACES = 9  # decimals of metres


def derivation_of(derived: Derived, grammar: ShapeGrammar, identity: str) -> Derivation:
    """Return the artifact of a derivation. Raises InvalidInput where it has no volume."""
    solid = mass_of(derived)
    mass = Geometry(tuple(map(tuple, np.round(solid.vertices, PLACES).tolist())), solid.faces)
    terminals = dict(grammar.terminals)
    return Derivation(
        identity, grammar.id, _rounded(derived.root), mass, terminals, derived.parameters
    )


def _rounded(node: Node) -> Node:
    """Return a tree whose numbers have no digits of rounding errors."""
    geometry = node.geometry
    if geometry is not None:
        points = np.round(np.array(geometry.points), PLACES) + 0.0
        geometry = Geometry(tuple(map(tuple, points.tolist())), geometry.faces)
    scope = tuple(round(value, PLACES) + 0.0 for value in node.scope)
    children = tuple(map(_rounded, node.children))
    return Node(node.symbol, scope, node.split, node.label, children, node.rule, geometry)


def derivation_scene(derivation: Derivation) -> Scene:
    """Return the scene of a derivation's artifact: the mass, and the leaves' faces around it."""
    mass = derivation.mass
    labels = tuple(Label("wall") for _ in mass.faces)
    points, faces, _ = triangulated(Solid(np.array(mass.points, float), mass.faces, labels))
    skins = Skins()
    count: Counter[str] = Counter()
    for leaf in _leaves(derivation.root):
        count[leaf.symbol] += 1
        assert leaf.geometry is not None
        own = np.array(leaf.geometry.points, float).reshape(-1, 3)
        for face in leaf.geometry.faces:
            skins.add(f"{leaf.symbol}-{count[leaf.symbol]}", leaf.symbol, own, face)
    materials = {
        name: Material(name, color_of(look)) for name, look in derivation.terminals.items()
    }
    meshes = (Mesh("mass", points, faces, "mass"), *skins.meshes())
    return Scene(derivation.id, meshes, {"mass": Material("mass", "#cfc6b2"), **materials})


def grammar_scene(grammar: ShapeGrammar) -> Scene:
    """Return the scene of a building that a grammar makes (seed 0)."""
    derived = derive(grammar, rng=item_generator(0, "view", grammar.id))
    return derived_scene(derived, grammar.id)


def derivation_problems(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a derivation's geometry: pointer and message."""
    edges = Counter(
        (a, b)
        for face in derivation.mass.faces
        for ring in face
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True)
    )
    count = len(derivation.mass.points)
    if any(max(edge) >= count for edge in edges):
        yield "/mass/faces", f"names a point that is not there; there are {count}"
    elif any(number != 1 or edges[b, a] != 1 for (a, b), number in edges.items()):
        yield "/mass/faces", "the solid is not closed: an edge without its counterpart"
    for leaf in _leaves(derivation.root):
        geometry = leaf.geometry
        if leaf.symbol not in derivation.terminals:
            yield "/terminals", f"has no {leaf.symbol!r}, the symbol of a leaf"
            return
        if geometry and max((k for f in geometry.faces for r in f for k in r), default=-1) >= len(
            geometry.points
        ):
            yield "/root", f"a face of a leaf {leaf.symbol!r} names a point that is not there"
            return


def _leaves(node: Node) -> Iterator[Node]:
    if node.geometry is not None:
        yield node
    for child in node.children:
        yield from _leaves(child)
